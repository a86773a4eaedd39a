"""Definition of a campaign: a scenario, a design, and the factors that are drawn for every flight."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import tomli_w

from hsv.base.errors import CampaignError
from hsv.base.files import parse_json
from hsv.control.library import library_digest
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.flight.assembly import assemble, blamed_on, design_parameters, scenario_parameters
from hsv.flight.campaign.factors import Factor, check_factors, factors_of, flown_table, with_factors
from hsv.flight.scenario import Scenario, scenario_at_means, scenario_table, scenario_text

METHODS = ("uniform", "latin_hypercube", "sobol", "corners")

_BATCHES = 256
_BATCH_LIMITS = (32, 256)  # multiples of the flights side by side on any processor, as all sizes in between

MOST_SAMPLES = 10**7

_SEEDS = int(SEED_PARAMETER.maximum) + 1

_MOST = {"latin_hypercube": 10**6}
"""Samples at most, where fewer than by the other methods: each worker has to draw and keep a hypercube whole."""


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
        """Return the scenario of a flight with its sample (one value a factor).

        Raises:
            ScenarioError: The scenario does not admit these values together.
        """
        return scenario_at_means(self._flown_table(flight, sample), self.scenario_name)[0]

    def file(self, flight: int, sample: Sequence[float], **replaced: str) -> str:
        """Return the scenario of a flight with its sample as a file, with errors as above.

        Args:
            flight: Its number.
            sample: One value a factor.
            replaced: Values to put in the place of the scenario's, by key.
        """
        return tomli_w.dumps(self._flown_table(flight, sample) | replaced)

    def flight_seed(self, flight: int) -> int:
        """Return the seed of what is random in a flight; flights of other campaigns have others."""
        return (self.seed * MOST_SAMPLES + int(flight)) % _SEEDS

    def _flown_table(self, flight: int, sample: Sequence[float]) -> dict[str, Any]:
        return flown_table(self.table, self.scenario_name, self.factors, sample, self.flight_seed(flight))

    @property
    def batch(self) -> int:
        """Flights a batch, the unit that is flown and stored at once."""
        low, high = _BATCH_LIMITS
        return max(low, min(high, self.samples // _BATCHES // low * low))

    @property
    def batches(self) -> int:
        """Number of batches."""
        return -(-self.samples // self.batch)

    def flights(self, batch: int) -> range:
        """Return the numbers of the flights of a batch."""
        return range(batch * self.batch, min((batch + 1) * self.batch, self.samples))

    @cached_property
    def text(self) -> str:
        """The campaign as JSON, the same text for the same campaign."""
        return json.dumps(asdict(self), sort_keys=True)

    @property
    def digest(self) -> str:
        """A name for this campaign and no other."""
        return hashlib.sha256(self.text.encode()).hexdigest()

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
            check_factors(found.factors, found.table, found.scenario_name)
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
        table = with_factors(table, name, factors)
        text = tomli_w.dumps(table)
    scenario, _ = scenario_at_means(table, name)
    found = factors_of(table, name, scale)
    if method not in METHODS:
        raise CampaignError(f"method = {method!r}: expected one of {', '.join(METHODS)}")
    if method == "corners":
        samples = 2 ** len(found)
    most = _MOST.get(method, MOST_SAMPLES)
    if not 1 <= samples <= most:
        raise CampaignError(f"samples = {samples}: expected 1 to {most}")
    if method == "sobol" and samples & (samples - 1):
        raise CampaignError(f"samples = {samples}: expected a power of two, where a Sobol sequence is balanced")
    if not 0 <= seed < 2**63:
        raise CampaignError(f"seed = {seed}: expected 0 to 2^63 - 1")
    with blamed_on(scenario):
        design, library = design_parameters(scenario), library_digest(scenario.controller)
    campaign = Campaign(name, text, design, method, samples, seed, found, commit, library)
    _check_ends(campaign)
    return campaign


def _check_ends(campaign: Campaign) -> None:
    """Refuse factors that the scenario does not admit at their ends, all at once or one by one, the others half-way."""
    low, high, mean = ([getattr(f, end) for f in campaign.factors] for end in ("low", "high", "middle"))
    for ends in (low, high):
        flown = campaign.flown(0, ends)
        with blamed_on(flown):
            assemble({**campaign.design, **scenario_parameters(flown)})
        for index, value in enumerate(ends):
            campaign.flown(0, [*mean[:index], value, *mean[index + 1 :]])
