"""Definition of a campaign: a scenario, a design, and the factors that are drawn for every flight."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomli_w

from hsv.base.errors import CampaignError, one_of
from hsv.base.files import parse_json
from hsv.base.units import percent, rounded, written
from hsv.control.design import design_of
from hsv.control.library import library_digest
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.flight.assembly import assemble_flight, blamed_on, design_parameters
from hsv.flight.campaign.run import Batch
from hsv.flight.distribution import KINDS, Distribution
from hsv.flight.scenario import Scenario, scenario_at_means, scenario_table, scenario_text, set_field
from hsv.model.dynamics import COEFFICIENT_UNITS

METHODS = ("uniform", "latin_hypercube", "sobol", "corners")

MAX_SAMPLES = 10**7

_MAX_HYPERCUBE = 10**6
"""Largest number of samples of a Latin hypercube, which every worker draws and keeps completely"""

_BATCHES = 256
"""Number of batches to aim at"""

_BATCH_LIMITS = (32, 256)
"""Smallest and largest batch: multiples of the lanes of every processor, as are all sizes in between"""

_SEEDS = int(SEED_PARAMETER.maximum) + 1

_PERTURBATION = "vehicle.perturbation."


@dataclass(frozen=True, kw_only=True)
class Factor(Distribution):
    """Range or distribution of one field of the scenario; uncertain parameters are relative changes."""

    name: str
    """Name of an uncertain parameter, or the field"""

    @property
    def is_perturbation(self) -> bool:
        """Whether the factor is an uncertain parameter of the vehicle."""
        return self.name in COEFFICIENT_UNITS

    @property
    def field(self) -> str:
        """The field of the scenario."""
        return _PERTURBATION + self.name if self.is_perturbation else self.name


@dataclass(frozen=True)
class Campaign:
    """Everything that its flights depend on; equal campaigns give equal results, byte for byte."""

    scenario_name: str
    scenario_text: str
    design: Mapping[str, Any]
    """Flat parameters of the controller's design, kept whole: its file may change later."""
    method: str
    """Sampling method, one of :data:`METHODS`."""
    samples: int
    """Number of flights."""
    seed: int
    factors: tuple[Factor, ...]
    commit: str
    """Version of the program, so that no result mixes two."""
    library: str = ""
    """SHA-256 of the controller's library, for the same reason; empty where it is in none."""

    @cached_property
    def table(self) -> dict[str, Any]:
        """The scenario as written."""
        return scenario_table(self.scenario_text, self.scenario_name)

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario without any change, distributions at their means."""
        return scenario_at_means(self.table, self.scenario_name)[0]

    @cached_property
    def perturbed(self) -> tuple[str, ...]:
        """The uncertain parameters of the vehicle that vary, one a factor; empty where anything else varies, too."""
        names = tuple(factor.name for factor in self.factors)
        return names if all(factor.is_perturbation for factor in self.factors) else ()

    def flown(self, flight: int, sample: Sequence[float]) -> Scenario:
        """Return the scenario of a flight with its sample (one value a factor)."""
        return scenario_at_means(self._flown_table(flight, sample), self.scenario_name)[0]

    def file(self, flight: int, sample: Sequence[float], **replaced: str) -> str:
        """Return the scenario of a flight with its sample as a file; ``replaced``: other values, by key."""
        return tomli_w.dumps(self._flown_table(flight, sample) | replaced)

    def flight_seed(self, flight: int) -> int:
        """Return the seed of the random numbers within a flight; flights of other campaigns have others."""
        return (self.seed * MAX_SAMPLES + int(flight)) % _SEEDS

    def _flown_table(self, flight: int, sample: Sequence[float]) -> dict[str, Any]:
        flown = copy.deepcopy(self.table) | {"seed": self.flight_seed(flight)}
        starts = {}
        for factor, value in zip(self.factors, sample, strict=True):
            text = percent(float(value)) if factor.is_perturbation else written(float(value), factor.unit)
            set_field(flown, factor.field, text, self.scenario_name)
            if factor.field.startswith("initial."):
                starts[factor.field.removeprefix("initial.")] = float(value)
        if starts:
            fixed = {**flown, "initial": self.table["initial"]}
            flown["command"] = _commands_to_same_goals(fixed, self.scenario_name, starts)
        return flown

    def draw(self, flights: range) -> tuple[np.ndarray, np.ndarray]:
        """Return the samples (flights, factors), in the factors' units, and the seed (flights) that each is drawn from.

        Uniform samples have a seed each, so that any can be drawn alone; the other methods draw from the campaign's.
        """
        d, seeds = len(self.factors), np.full(len(flights), self.seed, np.uint64)
        if self.method == "uniform":
            keys = (np.random.SeedSequence(self.seed, spawn_key=(flight,)) for flight in flights)
            seeds = np.array([key.generate_state(1, np.uint64)[0] for key in keys], np.uint64)
            shares = np.stack([np.random.default_rng(own).random(d) for own in seeds.tolist()])
        elif self.method == "latin_hypercube":
            shares = self._hypercube[flights.start : flights.stop]
        elif self.method == "sobol":
            from scipy.stats import qmc

            engine = qmc.Sobol(d, seed=self.seed)
            if flights.start:
                engine.fast_forward(flights.start)
            shares = np.asarray(engine.random(len(flights)))
        else:
            # Corners: the binary digits of the flight's number, the first factor's first.
            shares = (np.array(flights)[:, None] >> np.arange(d)[::-1] & 1).astype(float)
        # Each column has the shares of a factor's distribution below the samples, 0 to 1.
        return np.column_stack([f.quantiles(column) for f, column in zip(self.factors, shares.T, strict=True)]), seeds

    @cached_property
    def _hypercube(self) -> np.ndarray:
        """All samples (samples, factors): the strata of each factor are shuffled over all flights."""
        from scipy.stats import qmc

        return np.asarray(qmc.LatinHypercube(len(self.factors), seed=self.seed).random(self.samples))

    @property
    def batch(self) -> int:
        """Number of flights of a batch, the unit that is flown and stored at once."""
        low, high = _BATCH_LIMITS
        return max(low, min(high, self.samples // _BATCHES // low * low))

    @cached_property
    def batches(self) -> list[Batch]:
        """All batches."""
        flights = map(self.flights, range(-(-self.samples // self.batch)))
        return [Batch(f"flights {some.start} to {some.stop - 1}", len(some)) for some in flights]

    def flights(self, batch: int) -> range:
        """Return the numbers of the flights of a batch."""
        return range(batch * self.batch, min((batch + 1) * self.batch, self.samples))

    @cached_property
    def text(self) -> str:
        """The campaign as JSON, the same text for the same campaign."""
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Return the campaign written by :attr:`text`.

        Raises:
            CampaignError: Another version wrote it, or it is damaged.
        """
        commit = "unknown"
        try:
            values = parse_json(text)
            commit = values.get("commit", commit)
            found = cls(**values | {"factors": tuple(Factor(**factor) for factor in values["factors"])})
            if found.method not in METHODS:
                raise ValueError(f"method {found.method!r}")
            scenario, drawn = scenario_at_means(found.table, found.scenario_name)
            known = (*scenario.vehicle.described.uncertainty, *drawn)
            for factor in found.factors:
                if factor.name not in known:
                    raise CampaignError(f"factor {factor.name!r}: expected {one_of(known, factor.name)}")
                if factor.kind not in KINDS:
                    raise CampaignError(f"factor {factor.name!r}: kind {factor.kind!r}, expected {' or '.join(KINDS)}")
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise CampaignError(
                f"campaign written by commit {commit}, which this version does not read: {error}"
            ) from error
        return found

    def difference(self, other: Campaign) -> str:
        """Return the first setting in which ``other`` differs, in words; empty if in none."""
        for field in fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if mine != theirs:
                short = isinstance(mine, str | int) and len(str(mine)) < 60
                return f"{field.name} = {mine} there, {theirs} here" if short else f"its {field.name} differ"
        return ""


def plan(
    scenario_name: str,
    *,
    method: str = "uniform",
    samples: int = 1000,
    seed: int = 1,
    scale: float = 1.0,
    commit: str = "unknown",
    factors: Mapping[str, tuple[object, object]] | None = None,
) -> Campaign:
    """Return the campaign over the uncertain parameters of the paper's section 5.1, and over further ``factors``.

    Args:
        scenario_name: Shipped scenario or path of a TOML file.
        method: One of :data:`METHODS`; ``"corners"`` flies all combinations of least and largest value.
        samples: Number of flights; not used for corners.
        seed: Determines all samples.
        scale: Factor on the bounds of the uncertain parameters; 0 leaves them alone.
        commit: Version of the program.
        factors: Least and largest value, as a file has them, by field of the scenario.

    Raises:
        CampaignError, ScenarioError, DesignError: Names the setting that is wrong.
    """
    text = scenario_text(scenario_name)
    name = Path(scenario_name).stem
    table = scenario_table(text, name)
    if factors:
        for field, ends in factors.items():
            place = _PERTURBATION + field if field in COEFFICIENT_UNITS else field
            set_field(table, place, {"uniform": list(ends)}, name)
        text = tomli_w.dumps(table)
    scenario, drawn = scenario_at_means(table, name)
    found = _factors(scenario, drawn, scale)
    if method not in METHODS:
        raise CampaignError(f"method = {method!r}: expected {one_of(METHODS, method)}")
    if method == "corners":
        samples = 2 ** len(found)
    largest = _MAX_HYPERCUBE if method == "latin_hypercube" else MAX_SAMPLES
    if not 1 <= samples <= largest:
        raise CampaignError(f"samples = {samples}: expected 1 to {largest}")
    if method == "sobol" and samples & (samples - 1):
        raise CampaignError(f"samples = {samples}: expected a power of two, where a Sobol sequence is balanced")
    if not 0 <= seed < 2**63:
        raise CampaignError(f"seed = {seed}: expected 0 to 2^63 - 1")
    with blamed_on(scenario):
        design, library = design_parameters(scenario), library_digest(scenario.controller)
    campaign = Campaign(name, text, design, method, samples, seed, found, commit, library)
    _check_ends(campaign)
    return campaign


def _factors(scenario: Scenario, drawn: Mapping[str, Distribution], scale: float) -> tuple[Factor, ...]:
    """Return the vehicle's uncertain parameters and the ``drawn`` distributions, which replace a parameter's bounds."""
    if not 0.0 <= scale <= 10.0:
        raise CampaignError(f"scale = {scale}: expected 0 to 10")
    uncertainty = scenario.vehicle.described.uncertainty
    bounds = {_PERTURBATION + parameter: rounded(scale * bound) for parameter, bound in uncertainty.items()}
    found = {field: Distribution(unit="1", low=-bound, high=bound) for field, bound in bounds.items() if scale}
    found |= drawn
    if not found:
        raise CampaignError("scale = 0, no other factor and no distribution: expected something that varies")
    return tuple(
        Factor(name=field.removeprefix(_PERTURBATION), **vars(distribution)) for field, distribution in found.items()
    )


def _check_ends(campaign: Campaign) -> None:
    """Refuse factors that the scenario does not admit at their ends, all at once or one by one, the others half-way."""
    low, high, mean = ([getattr(f, end) for f in campaign.factors] for end in ("low", "high", "middle"))
    for ends in (low, high):
        assemble_flight(campaign.flown(0, ends), design_of(campaign.design))
        for index, value in enumerate(ends):
            campaign.flown(0, [*mean[:index], value, *mean[index + 1 :]])


def _commands_to_same_goals(table: dict[str, Any], name: str, starts: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the commands from other ``starts`` (SI, by axis) to the same targets: the step at t = 0 changes."""
    scenario, _ = scenario_at_means(table, name)
    steps = [command for command in scenario.command if command.end == 0.0]
    goals = {"altitude": scenario.commands.altitudes[0], "velocity": scenario.commands.velocities[0]}
    changes = {axis: sum(getattr(step, f"{axis}_change") for step in steps) for axis in goals}
    changes |= {axis: rounded(goals[axis] - start) for axis, start in starts.items()}
    units = {"altitude": "m", "velocity": "m/s"}
    step = {f"{axis}_change": written(change, units[axis]) for axis, change in changes.items()}
    later = [given for given, command in zip(table.get("command", ()), scenario.command, strict=True) if command.end]
    return [step, *later]
