"""Measure what active fault tolerance survives: python3 tools/active_limits.py, after env.sh.

Counts the vehicles that survive a loss of elevator effectiveness; with --conditions, shows instead where the estimator
must be off.
"""

from __future__ import annotations

import argparse
from typing import Any

from hsv.control.effectiveness import EffectivenessMode, effectiveness_along
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import Components, fly
from hsv.flight.corners import corners
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.plant import FlightStatus
from hsv.model.vehicle import load_vehicle
from hsv_paper.limits.study import least_survived

DEPTHS = (0.9, 0.6, 0.55, 0.525, 0.5, 0.47, 0.46, 0.45, 0.44)

FAULT_START = 100.0
"""Time of the fault in all scenarios (s)."""

CONDITIONS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("case1", {}),
    ("case1", {"sensors.set": "fine"}),
    ("case1", {"sensors.set": "fine", "effectiveness.noise": "0.001 rad/s"}),
    ("case1", {"sensors.set": "ghv"}),
    ("case1_hard_sensors", {}),
    ("case1_realistic", {}),
    ("case1_derived", {}),
)
"""Scenarios, and what is changed in them, in which the estimator is switched on."""


def components(scenario: str, effectiveness: float, **changes: Any) -> Components:
    """Return the loop of a scenario with another loss."""
    return assemble_flight(load_scenario(scenario, {"fault[0].effectiveness": effectiveness, **changes}))


def first_alarm(scenario: str, effectiveness: float, **changes: Any) -> float | None:
    """Return when (s) the nominal vehicle's elevator is first taken for faulty, if it ever is."""
    parts = components(scenario, effectiveness, **changes)
    flight = fly(parts)
    known = effectiveness_along(parts.controller.kernel.effectiveness, flight.history.estimate, flight.history.command)
    alarms = (k for k, state in enumerate(known) if state.mode is not EffectivenessMode.HEALTHY)
    step = next(alarms, None)
    return None if step is None else step * flight.period


def lasted(scenario: str, effectiveness: float, **changes: Any) -> float | None:
    """Return for how long (s) the nominal vehicle flies after the fault, if it is lost."""
    parts = components(scenario, effectiveness, **changes)
    flight = fly(parts)
    return None if flight.status is FlightStatus.FINISHED else flight.time[-1] - FAULT_START


def survivors() -> None:
    """Print the deepest loss of the nominal vehicle, and how many of all corners survive, passive and active."""
    over = corners(load_vehicle().uncertainty)
    for scenario in ("case1", "case1_active"):
        print(f"{scenario}: nominal vehicle down to {least_survived(scenario):.3f}", flush=True)
        for depth in DEPTHS:
            ended = fly_perturbed(components(scenario, depth), over, lambda _, flight: flight.status)
            print(f"  {depth}: {ended.count(FlightStatus.FINISHED)} of {len(over)}", flush=True)


def conditions() -> None:
    """Print, for other flights than Case 1's, false alarms without a fault, and what becomes of losses."""

    def said(seconds: float | None, none: str) -> str:
        return none if seconds is None else f"{seconds:.2f} s"

    print("| scenario | changed | false alarm at | 0.9 found at | 0.5 lost after | passive law |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    for scenario, changes in CONDITIONS:
        passive = {name: value for name, value in changes.items() if not name.startswith("effectiveness.")}
        active = {"effectiveness.enabled": True, **changes}
        cells = (
            said(first_alarm(scenario, 1.0, **active), "never"),
            said(first_alarm(scenario, 0.9, **active), "never"),
            said(lasted(scenario, 0.5, **active), "survived"),
            said(lasted(scenario, 0.5, **passive), "survived"),
        )
        changed = ", ".join(f"`{name} = {value}`" for name, value in changes.items())
        print(f"| `{scenario}` | {changed} | {' | '.join(cells)} |", flush=True)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--conditions", action="store_true", help="show where the estimator must be off")
    (conditions if parser.parse_args().conditions else survivors)()


if __name__ == "__main__":
    main()
