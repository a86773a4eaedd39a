"""The verdict on a flight: its metrics against the limits that its scenario states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hsv.simulation.scenario import Scenario


@dataclass(frozen=True)
class Verdict:
    """A limit (SI) and the metric it is for; ``value`` is None where the flight does not define the metric."""

    limit: float
    value: float | None

    @property
    def within(self) -> bool:
        """Whether the magnitude of the metric stays within the limit."""
        return self.value is not None and abs(self.value) <= self.limit


def verdicts(scenario: Scenario, metrics: Mapping[str, float]) -> dict[str, Verdict]:
    """Return the verdict for each metric that ``scenario`` limits."""
    return {name: Verdict(limit, metrics.get(name)) for name, limit in scenario.limits.items()}
