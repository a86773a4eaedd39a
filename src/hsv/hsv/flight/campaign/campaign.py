"""Definition of a campaign: a scenario, a design, and the factors that are drawn for every flight."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomli_w

from hsv.base.errors import CampaignError, ParameterError, one_of, require
from hsv.base.files import parse_json
from hsv.base.units import percent, rounded, written
from hsv.control.design import design_of
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.flight.assembly import assemble_flight, blamed_on, design_parameters, without_code
from hsv.flight.campaign.run import Batch
from hsv.flight.distribution import KINDS, Distribution
from hsv.flight.scenario import Scenario, parse_scenario, scenario_at_means, scenario_table, scenario_text
from hsv.flight.tables import set_field
from hsv.model.dynamics import COEFFICIENT_UNITS
from hsv.plugins.library import library_digest

METHODS = ("uniform", "latin_hypercube", "sobol", "corners")

WORST, RARE = SEARCHES = ("worst", "rare")
"""Methods of searches, whose samples are not drawn but chosen flight by flight (:mod:`hsv.flight.search`)."""

MAX_SAMPLES = 10**7

_MAX_HYPERCUBE = 10**6
"""Maximum number of samples of a Latin hypercube; every worker process draws all of them and keeps them in memory"""

_BATCHES = 256
"""Number of batches into which a campaign is divided, as far as :data:`_BATCH_LIMITS` permit"""

_BATCH_LIMITS = (32, 256)
"""Minimum and maximum number of flights in a batch; sizes are multiples of the minimum, which fills the core's lanes"""

_SEEDS = int(SEED_PARAMETER.maximum) + 1

_PERTURBATION = "vehicle.perturbation."


@dataclass(frozen=True, kw_only=True)
class Factor(Distribution):
    """A scenario field that differs from flight to flight, with its range or distribution.

    For an uncertain parameter of the vehicle, the values are relative changes.
    """

    name: str
    """Name of an uncertain parameter, such as ``mass``, or of any other field, such as ``fault[0].start``"""

    @property
    def is_perturbation(self) -> bool:
        """Whether the factor is an uncertain parameter of the vehicle."""
        return self.name in COEFFICIENT_UNITS

    @property
    def field(self) -> str:
        """Full name of the field in a scenario file, such as ``vehicle.perturbation.mass``."""
        return _PERTURBATION + self.name if self.is_perturbation else self.name


@dataclass(frozen=True)
class Campaign:
    """A campaign: everything that its flights depend on, except the code of a controller in Python.

    With the same code, equal campaigns give equal results, byte for byte; with a solver in flight, on one machine only.
    """

    scenario_name: str
    scenario_text: str
    design: Mapping[str, Any]
    """All parameters of the controller's design by name, stored because the design file may change later."""
    method: str
    """Sampling method, one of :data:`METHODS` or :data:`SEARCHES`."""
    samples: int
    """Number of flights: the same samples fly at each point of the grid, point after point."""
    seed: int
    factors: tuple[Factor, ...]
    commit: str = "unknown"
    """Git commit of the program; results of different commits are not mixed."""
    goal: str = ""
    """Of a search: the metric whose largest value or smallest margin is searched"""
    budget: int = 0
    """Of a search: largest number of flights"""
    library: str = ""
    """SHA-256 of the controller's shared library, empty without one; results of different builds are not mixed."""

    @cached_property
    def table(self) -> dict[str, Any]:
        """The scenario file as a nested table."""
        return scenario_table(self.scenario_text, self.scenario_name)

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario from which the samples deviate, with the mean in place of every distribution."""
        return scenario_at_means(self.table, self.scenario_name)[0]

    @cached_property
    def perturbed(self) -> tuple[str, ...]:
        """Names of the factors if all of them are uncertain parameters of the vehicle, otherwise empty."""
        names = tuple(factor.name for factor in self.factors)
        return names if all(factor.is_perturbation for factor in self.factors) else ()

    def flown(self, flight: int, sample: Sequence[float]) -> Scenario:
        """Return the scenario of a flight; ``sample`` has one value per factor, in the factor's unit."""
        return scenario_at_means(self._flown_table(flight, sample), self.scenario_name)[0]

    def file(self, flight: int, sample: Sequence[float], **replaced: str) -> str:
        """Return the text of the scenario file of a flight with its sample; ``replaced`` overrides top-level keys."""
        title = {"title": f"{self.scenario_name}, flight {flight}"}
        return tomli_w.dumps(self._flown_table(flight, sample) | title | replaced)

    @cached_property
    def grid(self) -> list[Factor]:
        """The factors with a grid; the last one varies fastest."""
        return [factor for factor in self.factors if factor.values]

    @property
    def vehicles(self) -> int:
        """Number of flights at each point of the grid; without a grid, of all flights."""
        return self.samples // math.prod(len(factor.values) for factor in self.grid)

    def flight_seed(self, flight: int) -> int:
        """Return the seed for the random numbers within a flight, from the campaign's seed and the sample's number.

        All flights of a search for the worst one have the seed of flight 0, so that they differ in their samples only.
        """
        number = 0 if self.method == WORST else int(flight) if self.method == RARE else int(flight) % self.vehicles
        return (self.seed * MAX_SAMPLES + number) % _SEEDS

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
        """Return the samples, shape (flights, factors), in the factors' units, and their seeds, shape (flights,).

        With the method ``uniform``, every sample is drawn with a seed of its own. With the other methods, the seed of
        every sample is the campaign's; corners do not depend on it.
        """
        points, numbers = np.divmod(np.array(flights), self.vehicles)
        d, seeds = len(self.factors) - len(self.grid), np.full(len(flights), self.seed, np.uint64)
        if self.method == "uniform":
            keys = (np.random.SeedSequence(self.seed, spawn_key=(number,)) for number in numbers.tolist())
            seeds = np.array([key.generate_state(1, np.uint64)[0] for key in keys], np.uint64)
            shares = np.stack([np.random.default_rng(own).random(d) for own in seeds.tolist()])
        elif self.method == "latin_hypercube":
            shares = self._hypercube[numbers]
        elif self.method == "sobol":
            from scipy.stats import qmc

            engine, first = qmc.Sobol(d, seed=self.seed), int(numbers.min())
            if first:
                engine.fast_forward(first)
            shares = np.asarray(engine.random(int(numbers.max()) + 1 - first))[numbers - first]
        else:
            # Corners: bit by bit of the sample's number, 0 for the least value; the first factor has the highest bit.
            shares = (numbers[:, None] >> np.arange(d)[::-1] & 1).astype(float)
        # Each column of shares has the cumulative probabilities (0 to 1) of one factor's samples.
        columns, places = iter(shares.T), iter(np.unravel_index(points, [len(f.values) for f in self.grid] or [1]))
        samples = [np.array(f.values)[next(places)] if f.values else f.quantiles(next(columns)) for f in self.factors]
        return np.column_stack(samples), seeds

    @cached_property
    def _hypercube(self) -> np.ndarray:
        """The Latin hypercube: values from 0 to 1, shape (vehicles, factors without a grid)."""
        from scipy.stats import qmc

        d = len(self.factors) - len(self.grid)
        return np.asarray(qmc.LatinHypercube(d, seed=self.seed).random(self.vehicles))

    @property
    def batch(self) -> int:
        """Number of flights that are flown and stored together as a batch; the last batch may have fewer."""
        low, high = _BATCH_LIMITS
        return max(low, min(high, self.samples // _BATCHES // low * low))

    @cached_property
    def batches(self) -> list[Batch]:
        """All batches, in the order of their flights."""
        flights = map(self.flights, range(-(-self.samples // self.batch)))
        return [Batch(f"flights {some.start} to {some.stop - 1}", len(some)) for some in flights]

    def flights(self, batch: int) -> range:
        """Return the flight numbers of a batch, which is given by its number."""
        return range(batch * self.batch, min((batch + 1) * self.batch, self.samples))

    @cached_property
    def text(self) -> str:
        """The campaign as JSON; equal campaigns have equal texts."""
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Return the campaign from its JSON ``text``, the inverse of :attr:`text`.

        Raises:
            CampaignError: The text was written by an incompatible version, or is damaged.
        """
        commit = "unknown"
        try:
            values = parse_json(text)
            commit = values.get("commit", commit)
            found = cls(**values | {"factors": tuple(_factor(factor) for factor in values["factors"])})
            if found.method not in (*METHODS, *SEARCHES):
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
        """Return the first setting in which ``other`` ("here") differs from this campaign ("there"); empty: none."""
        for field in fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if mine != theirs:
                if isinstance(mine, str | int) and len(str(mine)) < 60:
                    return f"{field.name} = {mine} there, {theirs} here"
                return f"another {field.name.replace('_', ' ')}"
        return ""


def _factor(given: dict[str, Any]) -> Factor:
    return Factor(**given | {"values": tuple(given.get("values", ()))})


def plan(
    scenario: str | Scenario,
    *,
    method: str = "uniform",
    samples: int = 1000,
    seed: int = 1,
    scale: float = 1.0,
    factors: Mapping[str, Sequence[object]] | None = None,
    changes: Mapping[str, object] | None = None,
    with_code: bool = True,
) -> Campaign:
    """Return the campaign that varies the vehicle's uncertain parameters, the scenario's distributions and ``factors``.

    Args:
        scenario: Name of a shipped scenario, path of a TOML file, or a scenario that was loaded.
        method: One of :data:`METHODS`; ``"corners"`` flies all combinations of the factors' least and largest values.
        samples: Number of flights at each point of the grid, a power of two for ``sobol``; ignored for corners.
        seed: Seed from which samples, except corners, are drawn; the seeds of the flights depend on it, too.
        scale: Factor on the vehicle's bounds of uncertain parameters (section 5.1 of the paper), not on distributions.
        factors: Fields or uncertain parameters by name: a pair of least and largest value, or a list of the values of
            a grid, as written in a scenario file.
        changes: Changes of the fields of a scenario that is given by name or path.
        with_code: Whether a custom controller flies, whose code is then loaded to check its parameters.

    Raises:
        CampaignError, ScenarioError, DesignError: A setting is wrong; the message names it.
    """
    for argument, value, kind in (("samples", samples, Integral), ("seed", seed, Integral), ("scale", scale, Real)):
        require(argument, value, kind, "an integer" if kind is Integral else "a number")
    require("factors", {} if factors is None else factors, Mapping, "least and largest values by field")
    if isinstance(scenario, Scenario):
        text, name = scenario.text, scenario.name
        if not text or parse_scenario(text, name) != scenario:
            raise CampaignError("scenario: changed after it was loaded, expected hsv.load with these changes")
    else:
        text, name = scenario_text(scenario, changes), Path(scenario).stem
    table = scenario_table(text, name)
    if factors:
        for field, values in factors.items():
            require("factors", field, str, "names of fields")
            require(field, values, (list, tuple), "a pair of least and largest value, or a list of values")
            place = _PERTURBATION + field if field in COEFFICIENT_UNITS else field
            set_field(table, place, {"grid" if isinstance(values, list) else "uniform": list(values)}, name)
        try:
            text = tomli_w.dumps(table)
        except TypeError:
            raise ParameterError(f"factors = {factors!r}: expected values as written in a scenario file") from None
    mean, drawn = scenario_at_means(table, name)
    found = _factors(mean, drawn, scale)
    grid = [len(factor.values) for factor in found if factor.values]
    if method not in METHODS:
        raise CampaignError(f"method = {method!r}: expected {one_of(METHODS, method)}")
    if method == "corners":
        samples = 2 ** (len(found) - len(grid))
    if len(grid) == len(found) and method in ("latin_hypercube", "sobol"):
        raise CampaignError(f"method = {method!r}: expected a factor that is drawn, or uniform")
    largest = _MAX_HYPERCUBE if method == "latin_hypercube" else MAX_SAMPLES
    largest //= math.prod(grid)
    if not 1 <= samples <= largest:
        raise CampaignError(f"samples = {samples}: expected 1 to {largest}")
    if method == "sobol" and samples & (samples - 1):
        raise CampaignError(f"samples = {samples}: expected a power of two, where a Sobol sequence is balanced")
    if not 0 <= seed < 2**63:
        raise CampaignError(f"seed = {seed}: expected 0 to 2^63 - 1")
    with blamed_on(mean):
        design, library = design_parameters(mean), library_digest(mean.controller)
    campaign = Campaign(name, text, design, method, samples * math.prod(grid), seed, found, library=library)
    _check_ends(campaign, with_code)
    return campaign


def _factors(scenario: Scenario, drawn: Mapping[str, Distribution], scale: float) -> tuple[Factor, ...]:
    """Return a factor for each uncertain parameter of the vehicle and for each distribution of the scenario.

    ``drawn`` has the scenario's distributions by field. The distribution of an uncertain parameter replaces its bounds;
    the other parameters have the vehicle's bounds times ``scale``, and are left out if ``scale`` is 0.
    """
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


def _check_ends(campaign: Campaign, with_code: bool) -> None:
    """Raise an error if the scenario does not admit the least or largest values of the factors.

    Three kinds of samples are tried: all factors at their least values, all at their largest, and one factor at its
    least or largest value while the others are at middle values.
    """
    low, high, mean = ([getattr(f, end) for f in campaign.factors] for end in ("low", "high", "middle"))
    for ends in (low, high):
        flown = campaign.flown(0, ends)
        assemble_flight(flown if with_code else without_code(flown), design_of(campaign.design))
        for index, value in enumerate(ends):
            campaign.flown(0, [*mean[:index], value, *mean[index + 1 :]])


def _commands_to_same_goals(table: dict[str, Any], name: str, starts: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the commands with one step at t = 0, replacing any there, from varied initial values to the same targets.

    ``starts`` has the varied initial values by name: ``altitude`` (m), ``velocity`` (m/s), or only one of them.
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
