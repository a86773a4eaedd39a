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
    ended: bool = True
    """Whether the flight came to its end; one that did not may exceed a limit, but kept none."""

    @property
    def within(self) -> bool:
        """Whether the flight came to its end and the magnitude of the metric stayed within the limit."""
        return self.words == "within"

    @property
    def words(self) -> str:
        """The verdict: ``within``, ``over``, ``not reached`` or ``not flown to the end``."""
        if self.value is not None and not abs(self.value) <= self.limit:
            return "over"
        if not self.ended:
            return "not flown to the end"
        return "not reached" if self.value is None else "within"


def verdicts(scenario: Scenario, metrics: Mapping[str, float], *, ended: bool) -> dict[str, Verdict]:
    """Return the verdict for each metric that ``scenario`` limits, on a flight that came to its end or did not."""
    return {name: Verdict(limit, metrics.get(name), ended) for name, limit in scenario.limits.items()}
