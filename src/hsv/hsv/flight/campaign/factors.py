"""Quantities that vary from flight to flight, and the scenario of a flight."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hsv.base.errors import CampaignError
from hsv.base.units import percent, rounded, written
from hsv.flight.distribution import KINDS, Distribution
from hsv.flight.scenario import scenario_at_means, set_field
from hsv.model.dynamics import COEFFICIENT_UNITS

_PERTURBATION = "vehicle.perturbation."


@dataclass(frozen=True, kw_only=True)
class Factor(Distribution):
    """Range or distribution of one field of the scenario; uncertain parameters are relative changes."""

    name: str
    """Name of an uncertain parameter, or the field."""

    @property
    def is_perturbation(self) -> bool:
        """Whether it is an uncertain parameter of the vehicle."""
        return self.name in COEFFICIENT_UNITS

    @property
    def field(self) -> str:
        """The field of the scenario."""
        return _PERTURBATION + self.name if self.is_perturbation else self.name


def with_factors(table: dict[str, Any], name: str, ranges: Mapping[str, tuple[object, object]]) -> dict[str, Any]:
    """Return the scenario in ``table`` with a uniform distribution from least to largest value in each of some fields.

    Args:
        table: A scenario as a file has it.
        name: Name of the parameter.
        ranges: By field, values as a file has them.

    Raises:
        ScenarioError: There is no such field.
    """
    changed = copy.deepcopy(table)
    for field, ends in ranges.items():
        place = _PERTURBATION + field if field in COEFFICIENT_UNITS else field
        set_field(changed, place, {"uniform": list(ends)}, name)
    return changed


def factors_of(table: Mapping[str, Any], name: str, scale: float) -> tuple[Factor, ...]:
    """Return the factors of a campaign over the scenario in ``table``; ``scale`` as for ``plan``.

    A distribution in the scenario takes the place of a parameter's bounds.

    Raises:
        CampaignError, ScenarioError: A range that the scenario does not admit, or nothing varies.
    """
    if not 0.0 <= scale <= 10.0:
        raise CampaignError(f"scale = {scale}: expected 0 to 10")
    scenario, drawn = scenario_at_means(dict(table), name)
    uncertainty = scenario.vehicle.described.uncertainty
    bounds = {_PERTURBATION + parameter: rounded(scale * bound) for parameter, bound in uncertainty.items()}
    found = {field: Distribution(unit="1", low=-bound, high=bound) for field, bound in bounds.items() if scale} | drawn
    factors = {
        field: Factor(name=field.removeprefix(_PERTURBATION), **vars(distribution))
        for field, distribution in found.items()
    }
    if not factors:
        raise CampaignError("scale = 0, no other factor and no distribution: expected something that varies")
    return tuple(factors.values())


def check_factors(factors: Iterable[Factor], table: Mapping[str, Any], name: str) -> None:
    """Refuse a factor that this version does not know, or that the scenario in ``table`` does not have.

    Raises:
        CampaignError, ScenarioError: Names it.
    """
    scenario, drawn = scenario_at_means(dict(table), name)
    known = (*scenario.vehicle.described.uncertainty, *drawn)
    for factor in factors:
        if factor.name not in known:
            raise CampaignError(f"factor {factor.name!r}: expected one of {', '.join(known)}")
        if factor.kind not in KINDS:
            raise CampaignError(f"factor {factor.name!r}: kind {factor.kind!r}, expected one of {', '.join(KINDS)}")


def flown_table(
    table: Mapping[str, Any], name: str, factors: Sequence[Factor], sample: Sequence[float], seed: int
) -> dict[str, Any]:
    """Return the scenario of a flight as a file has it: ``table`` with the values (one a factor) of its sample.

    The commanded target does not move with the start. ``seed``: of what is random in the flight itself.

    Raises:
        ScenarioError: The scenario does not admit them together.
    """
    flown = copy.deepcopy(dict(table)) | {"seed": seed}
    starts = {}
    for factor, value in zip(factors, sample, strict=True):
        text = percent(float(value)) if factor.is_perturbation else written(float(value), factor.unit)
        set_field(flown, factor.field, text, name)
        if factor.field.startswith("initial."):
            starts[factor.field.removeprefix("initial.")] = float(value)
    if starts:
        flown["command"] = _to_the_same_goals({**flown, "initial": table["initial"]}, name, starts)
    return flown


def _to_the_same_goals(table: dict[str, Any], name: str, starts: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the commands that lead from other ``starts`` (SI, by axis) to what ``table`` commands from its own.

    The step at t = 0 changes.
    """
    scenario, _ = scenario_at_means(table, name)
    steps = [command for command in scenario.command if command.end == 0.0]
    goals = {"altitude": scenario.commands.altitudes[0], "velocity": scenario.commands.velocities[0]}
    changes = {axis: sum(getattr(step, f"{axis}_change") for step in steps) for axis in goals}
    changes |= {axis: rounded(goals[axis] - start) for axis, start in starts.items()}
    units = {"altitude": "m", "velocity": "m/s"}
    step = {f"{axis}_change": written(change, units[axis]) for axis, change in changes.items()}
    later = [given for given, command in zip(table.get("command", ()), scenario.command, strict=True) if command.end]
    return [step, *later]
