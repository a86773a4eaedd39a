"""The summary of a flight: metrics, and the verdict against the limits of its scenario."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hsv.cli.output import Units, console, print_json, print_table, shown, to_json
from hsv.errors import RunError
from hsv.simulation.fingerprint import as_published, in_words
from hsv.simulation.limits import Verdict, verdicts
from hsv.simulation.metrics import METRICS
from hsv.simulation.scenario import Scenario


def report_flight(
    scenario: Scenario,
    metrics: dict[str, float],
    *,
    fingerprint: str | None,
    design_hash: str,
    ending: str,
    wall_time: float | None,
    simulated_time: float,
    units: Units,
    json: bool,
    not_covered: Sequence[str] | None,
    extra: dict[str, Any] | None = None,
) -> None:
    """Print the summary of a flight.

    Args:
        scenario: What was flown.
        metrics: By name, in SI units.
        fingerprint: Of the flight; ``None`` where steps are missing.
        design_hash: Digest of the design's parameters.
        ending: ``finished``, ``diverged`` or ``broken off``.
        wall_time: Wall time (s) that the flight took, where it is known.
        simulated_time: Simulated time (s) of the last step.
        units: Units of what is printed.
        json: Whether to print JSON.
        not_covered: What of the flight the certificate of its design does not cover; ``None``: not known.
        extra: More to print, by name.

    Raises:
        RunError: The flight diverged or was broken off; the message says when.
    """
    quantities = {name: (value, METRICS[name].unit) for name, value in metrics.items()}
    finished = ending == "finished"
    judged = verdicts(scenario, metrics, ended=finished)
    factor = simulated_time / wall_time if wall_time else None
    same = as_published(fingerprint, scenario, design_hash)
    if json:
        print_json(
            {
                "scenario": scenario.name,
                "diverged_at_s": simulated_time if ending == "diverged" else None,
                "within_limits": finished and all(verdict.within for verdict in judged.values()),
                "metrics": to_json(quantities, units),
                "fingerprint": fingerprint,
                "as_published": same,
                "wall_time_s": wall_time,
                "real_time_factor": factor,
                "not_covered": not_covered,
                **(extra or {}),
            }
        )
    else:
        print_table(scenario.title, quantities, units, limit_verdicts(judged, units))
        console.print(f"fingerprint {in_words(fingerprint, same)}", soft_wrap=True)
        pace = f" in {wall_time:.3g} s: {factor:.3g} x real time" if wall_time and factor else ""
        console.print(f"flown {simulated_time:.6g} s{pace}")
        for thing in not_covered or ():
            console.print(f"not covered by the certificate: {thing}", soft_wrap=True)
        for name, value in (extra or {}).items():
            console.print(f"{name:5} {value}", soft_wrap=True)
    if ending == "diverged":
        raise RunError(f"flight diverged at t = {simulated_time:.2f} s: the state left the range of the model")
    if not finished:
        raise RunError(f"flight broken off at t = {simulated_time:.2f} s of {scenario.duration:.2f} s")


def limit_verdicts(judged: dict[str, Verdict], units: Units) -> dict[str, str]:
    """Return, for each metric with a limit, whether its magnitude stays within it, in words."""
    words = {}
    for name, verdict in judged.items():
        value, unit = shown((verdict.limit, METRICS[name].unit), units)
        text = f"{value:.4g}{'' if unit == '1' else ' ' + unit}"
        words[name] = f"{verdict.words} {text if verdict.words in ('within', 'over') else f'(limit {text})'}"
    return words
