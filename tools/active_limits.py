"""Count the vehicles that survive a loss of elevator effectiveness: python3 tools/active_limits.py, after env.sh."""

from __future__ import annotations

from hsv.design.region import corners
from hsv.simulation.assembly import assemble_flight
from hsv.simulation.closed_loop import Components, fly
from hsv.simulation.scenario import load_scenario
from hsv.simulation.side_by_side import fly_perturbed
from hsv.vehicle.plant import FlightStatus
from hsv.vehicle.vehicle import load_vehicle

DEPTHS = (0.9, 0.6, 0.55, 0.525, 0.5, 0.47, 0.46, 0.45, 0.44)
RESOLUTION = 1e-3


def components(scenario: str, effectiveness: float) -> Components:
    """Return the loop of a scenario with another loss."""
    return assemble_flight(load_scenario(scenario, {"fault[0].effectiveness": effectiveness}))


def deepest(scenario: str) -> float:
    """Return the least effectiveness that the nominal vehicle survives, by bisection to 0.001."""
    lost, survived = 0.3, 1.0
    while survived - lost > RESOLUTION:
        middle = 0.5 * (lost + survived)
        finished = fly(components(scenario, middle)).status is FlightStatus.FINISHED
        lost, survived = (lost, middle) if finished else (middle, survived)
    return survived


def main() -> None:
    """Print the deepest loss of the nominal vehicle, and how many of all corners survive, passive and active."""
    over = corners(load_vehicle().uncertainty)
    for scenario in ("case1", "case1_active"):
        print(f"{scenario}: nominal vehicle down to {deepest(scenario):.3f}", flush=True)
        for depth in DEPTHS:
            ended = fly_perturbed(components(scenario, depth), over, lambda _, flight: flight.status)
            print(f"  {depth}: {ended.count(FlightStatus.FINISHED)} of {len(over)}", flush=True)


if __name__ == "__main__":
    main()
