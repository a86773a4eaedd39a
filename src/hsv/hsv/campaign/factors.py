"""What varies from flight to flight, and the scenario of a flight."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import tomli_w

from hsv.errors import CampaignError
from hsv.simulation.commands import CommandTable
from hsv.simulation.metrics import METRICS
from hsv.simulation.scenario import Scenario, parse_scenario
from hsv.units import rounded
from hsv.vehicle.parameters import uncertainty_bounds

OPTIONAL = {"fault_start": "s", "fault_value": "1", "initial_altitude": "m", "initial_velocity": "m/s"}
"""Factors beside the uncertain parameters, with their SI units. The commanded target does not move with the start."""


@dataclass(frozen=True)
class Factor:
    """A quantity that lies between ``low`` and ``high`` (SI); parameters are relative changes."""

    name: str
    unit: str
    low: float
    high: float


def factors_of(
    scenario: Scenario, scale: float, ranges: Mapping[str, tuple[float, float] | None]
) -> tuple[Factor, ...]:
    """Return the factors of a campaign; arguments as for :func:`hsv.campaign.campaign.plan`.

    Raises:
        CampaignError, ScenarioError: A range that is empty or that the scenario does not admit.
    """
    if not 0.0 <= scale <= 10.0:
        raise CampaignError(f"scale = {scale}: expected 0 to 10")
    bounds = uncertainty_bounds() if scale else {}
    factors = [Factor(name, "1", -rounded(scale * bound), rounded(scale * bound)) for name, bound in bounds.items()]
    for name, limits in ranges.items():
        if name not in OPTIONAL:
            raise CampaignError(f"factor {name!r}: expected one of {', '.join(OPTIONAL)}")
        if limits is None:
            continue
        if not limits[0] < limits[1]:
            raise CampaignError(f"{name} from {limits[0]:.6g} to {limits[1]:.6g}: expected a range that increases")
        if name.startswith("fault_") and len(scenario.fault) != 1:
            raise CampaignError(f"{name}: the scenario has {len(scenario.fault)} faults, expected one")
        factors.append(Factor(name, OPTIONAL[name], *map(rounded, limits)))
    if not factors:
        raise CampaignError("scale = 0 and no other factor: expected something that varies")
    for ends in ([f.low for f in factors], [f.high for f in factors]):
        parse_scenario(scenario_toml(scenario, factors, ends), scenario.name)
    return tuple(factors)


def check_names(names: Iterable[str]) -> None:
    """Refuse a factor that this version does not know.

    Raises:
        CampaignError: Names it.
    """
    known = (*uncertainty_bounds(), *OPTIONAL)
    for name in names:
        if name not in known:
            raise CampaignError(f"factor {name!r}: expected one of {', '.join(known)}")


def flown_scenario(base: Scenario, factors: Sequence[Factor], sample: Sequence[float]) -> Scenario:
    """Return the scenario of a flight: ``base`` with the values (one a factor, SI) of its sample."""
    values = {factor.name: float(value) for factor, value in zip(factors, sample, strict=True)}
    changes = {name: value for name, value in values.items() if name not in OPTIONAL}
    update: dict[str, object] = {}
    if changes:
        update["vehicle"] = base.vehicle.model_copy(update={"perturbation": {**base.vehicle.perturbation, **changes}})
    initial = {name: values[f"initial_{name}"] for name in ("altitude", "velocity") if f"initial_{name}" in values}
    if initial:
        update["initial"] = base.initial.model_copy(update=initial)
        update["command"] = _to_the_same_goals(base, initial)
    fault = {name: values[f"fault_{name}"] for name in ("start", "value") if f"fault_{name}" in values}
    if fault:
        update["fault"] = (base.fault[0].model_copy(update=fault),)
    return base.model_copy(update=update)


def _to_the_same_goals(base: Scenario, initial: Mapping[str, float]) -> tuple[CommandTable, ...]:
    """Return the commands that lead from another start to what ``base`` commands: its step at t = 0 changes."""
    reference, steps = base.commands, [command for command in base.command if command.end == 0.0]
    goals = {"altitude": reference.altitudes[0], "velocity": reference.velocities[0]}
    changes = {f"{axis}_change": sum(getattr(step, f"{axis}_change") for step in steps) for axis in goals}
    changes |= {f"{axis}_change": rounded(goals[axis] - start) for axis, start in initial.items()}
    return (CommandTable().model_copy(update=changes), *(c for c in base.command if c.end > 0.0))


def scenario_toml(base: Scenario, factors: Sequence[Factor], sample: Sequence[float]) -> str:
    """Return :func:`flown_scenario` as a file that ``hsv run`` takes; no digit is lost on the way."""
    flown = flown_scenario(base, factors, sample)
    table = {**flown.model_dump(exclude={"name", "limits", "own"}, exclude_defaults=True), **flown.own}
    for path, unit in _UNITS.items():
        *tables, key = path.split(".")
        for place in _places(table, tables):
            if key in place:
                place[key] = _quantity(place[key], unit)
    if flown.limits:
        table["limits"] = {name: _quantity(limit, METRICS[name].unit) for name, limit in flown.limits.items()}
    return tomli_w.dumps(table)


def _quantity(value: object, unit: str) -> object:
    if isinstance(value, list | tuple):
        return [_quantity(entry, unit) for entry in value]
    return value if unit == "1" else f"{value!r} {unit}"


_UNITS = {
    "duration": "s",
    "initial.altitude": "m",
    "initial.velocity": "m/s",
    "command.altitude_change": "m",
    "command.velocity_change": "m/s",
    "command.start": "s",
    "command.end": "s",
    "tube.change.start": "s",
    "fault.start": "s",
    "integral.rate": "1/s",
    "notch.zero_frequency": "rad/s",
    "notch.pole_frequency": "rad/s",
}
"""Fields that a scenario file writes with a unit."""


def _places(table: dict[str, object], path: Sequence[str]) -> list[dict[str, object]]:
    places: list[object] = [table]
    for key in path:
        found = [place[key] for place in places if isinstance(place, dict) and key in place]
        places = [entry for value in found for entry in (value if isinstance(value, list | tuple) else [value])]
    return [place for place in places if isinstance(place, dict)]
