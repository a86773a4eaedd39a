"""The verdict on a flight: its metrics against the limits and requirements that its scenario states."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hsv.base.units import UnitSystem, in_system, significant
from hsv.flight.metrics import CRITERIA, NOT_REACHED, metric_of, spaced
from hsv.flight.requirement import Requirement
from hsv.flight.scenario import Scenario


@dataclass(frozen=True)
class Verdict:
    """A ``limit`` (SI) of a metric and the metric's ``value``, None if the flight does not define the metric.

    If the metric is the margin of a ``requirement``, the value must be at least the limit, which is 0; otherwise its
    magnitude must be at most the limit.
    """

    limit: float
    value: float | None
    ended: bool = True
    """Whether the flight reached its end; a flight that did not may exceed a limit but never keeps one"""
    missing: str = NOT_REACHED
    """The reason if there is no value, as in :attr:`hsv.flight.metrics.FlightData.missing`"""
    requirement: Requirement | None = None

    @property
    def applies(self) -> bool:
        """Whether the metric applies to the flight; otherwise, the limit is not judged."""
        return self.value is not None or self.missing.startswith(NOT_REACHED) or not self.ended

    @property
    def kept(self) -> bool:
        """Whether the flight reached its end and kept the limit or requirement."""
        return not self.applies or self.words in ("within", "kept")

    @property
    def words(self) -> str:
        """The verdict: ``within`` or ``kept``, ``over`` or ``broken``, ``not flown to the end``, or a reason."""
        if self.requirement and self.ended:
            return "kept" if self.value is not None and self.value >= self.limit else "broken"
        if self.value is not None and not self.requirement and not abs(self.value) <= self.limit:
            return "over"
        if not self.ended:
            return "not flown to the end"
        if self.value is not None:
            return "within"
        return self.missing if self.applies else f"does not apply: {self.missing}"


def verdicts(
    scenario: Scenario, metrics: Mapping[str, float], missing: Mapping[str, str], *, ended: bool
) -> dict[str, Verdict]:
    """Return the verdict on each limit and requirement of ``scenario``, by the name of the metric.

    ``metrics``, margins included, and ``missing`` are those of the flight; ``ended``: it reached its end.
    """
    limited = {
        name: Verdict(limit, metrics.get(name), ended, missing.get(name, NOT_REACHED))
        for name, limit in scenario.limits.items()
    }
    required = {r.metric: Verdict(0.0, metrics.get(r.metric), ended, requirement=r) for r in scenario.requirement}
    return limited | required


def missed(margin: Mapping[str, Any] | None) -> bool:
    """Return whether the verdict on the disk ``margin`` is that the design misses it; not if it is not judged."""
    return margin is not None and margin["kept"] is False


def in_units(name: str, value: float, system: UnitSystem) -> str:
    """Return the ``value`` (SI) of the metric ``name`` as text in ``system``: three significant digits and the unit."""
    metric = metric_of(name)
    number, unit = in_system(value, metric.unit, system, share=metric.share)
    return significant(number) + ("" if unit == "1" else f" {unit}")


def not_judged(judged: Mapping[str, Verdict], metrics: Mapping[str, float]) -> list[str]:
    """Return the names of the metrics of a flight that have no limit, beginning with the criteria of the paper."""
    free = [name for name in metrics if name not in judged]
    return sorted(free, key=lambda name: name not in CRITERIA)


def verdict_sentence(
    judged: Mapping[str, Verdict],
    metrics: Mapping[str, float],
    system: UnitSystem,
    margin: Mapping[str, Any] | None = None,
) -> str:
    """Return one line: whether a flight kept its limits, which it did not keep, and which criteria have no limit.

    Other metrics without a limit are counted. If the scenario has no limits, the line says only that. ``margin`` is
    the verdict on the disk margin, see :func:`limits_kept`.
    """
    text = limits_kept(judged, system, margin)
    words = criteria_not_judged(judged, metrics, system)
    others = len(not_judged(judged, metrics)) - len(words)
    if others and judged and not words:
        return f"{text}; {others} further metric{'s have' if others > 1 else ' has'} no limit"
    words += [f"{others} other{'s' if others > 1 else ''}"] if others else []
    return f"{text}; not judged: {', '.join(words)}" if words and judged else text


def criteria_not_judged(judged: Mapping[str, Verdict], metrics: Mapping[str, float], system: UnitSystem) -> list[str]:
    """Return the paper's criteria that the flight defines and the scenario does not limit, as texts with values."""
    named = [name for name in not_judged(judged, metrics) if name in CRITERIA]
    return [f"{spaced(name)} ({in_units(name, metrics[name], system)})" for name in named]


def limits_kept(judged: Mapping[str, Verdict], system: UnitSystem, margin: Mapping[str, Any] | None = None) -> str:
    """Return in words whether a flight kept its limits, and which limits it did not keep.

    The line ends with the verdict on the disk ``margin``, see :func:`hsv.flight.margins.margin_verdict`.
    """
    if margin:
        return "; ".join([*([limits_kept(judged, system)] if judged else []), margin["words"]])
    if not judged:
        return "not judged: the scenario has no limits"
    others = Counter(verdict.missing for verdict in judged.values() if not verdict.applies)
    applied = [verdict for verdict in judged.values() if verdict.applies]
    free = [f"{n} {'does' if n == 1 else 'do'} not apply: {why}" for why, n in others.items()]
    if all(verdict.kept for verdict in judged.values()):
        kept = f"within {_counted(applied)}" if applied else "not judged"
        return "; ".join([kept, *free])
    over = [(name, v) for name, v in judged.items() if not v.kept and (v.ended or v.words == "over")]

    def broken(name: str, verdict: Verdict) -> str:
        if verdict.value is None:
            return f"{spaced(name)} {verdict.words}"
        if verdict.requirement:
            return f"{verdict.requirement.name} ({verdict.requirement.words(system)}), margin {verdict.value:.3g}"
        number, limit = (in_units(name, value, system) for value in (verdict.value, verdict.limit))
        return f"{spaced(name)} {number} (limit {limit})"

    said = ", ".join(broken(*each) for each in over)
    head = [] if all(verdict.ended for verdict in judged.values()) else ["not flown to the end"]
    return "; ".join(
        [*head, *([f"{len(over)} of {_counted(applied, every='')} violated: {said}"] if over else []), *free]
    )


def _counted(judged: Sequence[Verdict], every: str = "all ") -> str:
    """Return the numbers of limits and requirements in words; ``every`` stands before several of them."""
    required = sum(verdict.requirement is not None for verdict in judged)
    parts = []
    for noun, count in (("limit", len(judged) - required), ("requirement", required)):
        if count == 1 and every:
            parts.append(f"its {noun}")
        elif count:
            parts.append(f"{every}{count} {noun}{'s' if count > 1 or noun == 'limit' else ''}")
    return " and ".join(parts)
