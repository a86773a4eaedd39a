"""The summary of a flight: metrics, and the verdict against the limits of its scenario."""

from __future__ import annotations

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
    diverged_at: float | None,
    wall_time: float,
    simulated_time: float,
    units: Units,
    json: bool,
    extra: dict[str, Any] | None = None,
) -> None:
    """Print the summary of a flight.

    Raises:
        RunError: The flight diverged; the message says when.
    """
    quantities = {name: (value, METRICS[name].unit) for name, value in metrics.items()}
    judged = verdicts(scenario, metrics, ended=diverged_at is None)
    factor = simulated_time / wall_time if wall_time > 0.0 else 0.0
    same = as_published(fingerprint, scenario, design_hash)
    if json:
        print_json(
            {
                "scenario": scenario.name,
                "diverged_at_s": diverged_at,
                "within_limits": diverged_at is None and all(verdict.within for verdict in judged.values()),
                "metrics": to_json(quantities, units),
                "fingerprint": fingerprint,
                "as_published": same,
                "wall_time_s": wall_time,
                "real_time_factor": factor,
                **(extra or {}),
            }
        )
    else:
        print_table(scenario.title, quantities, units, limit_verdicts(judged, units))
        console.print(f"fingerprint {in_words(fingerprint, same)}", soft_wrap=True)
        console.print(f"flown {simulated_time:.6g} s in {wall_time:.3g} s: {factor:.3g} x real time")
        for name, value in (extra or {}).items():
            console.print(f"{name:5} {value}", soft_wrap=True)
    if diverged_at is not None:
        raise RunError(f"flight diverged at t = {diverged_at:.2f} s: the state left the range of the model")


def limit_verdicts(judged: dict[str, Verdict], units: Units) -> dict[str, str]:
    """Return, for each metric with a limit, whether its magnitude stays within it, in words."""
    words = {}
    for name, verdict in judged.items():
        value, unit = shown((verdict.limit, METRICS[name].unit), units)
        text = f"{value:.4g}{'' if unit == '1' else ' ' + unit}"
        words[name] = f"{verdict.words} {text if verdict.words in ('within', 'over') else f'(limit {text})'}"
    return words
