"""Controllers and nominal laws side by side: ``python -m hsv.simulation.comparison > docs/comparison.md``."""

from __future__ import annotations

import numpy as np

from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.closed_loop import Flight, fly
from hsv.simulation.metrics import flight_metrics
from hsv.simulation.scenario import load_scenario
from hsv.units import to_paper

ROBUST_AND_TUBE = ("case1_rmpc", "case1_tube_dm", "case1_rmpc_last_k", "case1_tube_dm_family")
NOMINAL_LAWS = ("case1_single_k", "case1", "case1_smooth", "case1_kothare_online", "case1_qp")
INTEGRAL = ("case1_integral_heavy", "case1_integral_light")

_PAGE = """# Controllers and nominal laws side by side
Made by `python -m hsv.simulation.comparison > docs/comparison.md`; every row is one scenario, flown in process as
`hsv simulate NAME --units paper` does. Errors are what altitude and velocity lack of, or have above, their command.

## Robust MPC and the tube
The traditional robust MPC of the paper's section 5.2 is u = K x + u_r, without a notch filter; decoupled vehicle,
elevator effectiveness 0.9 from 100 s. What it leaves of the altitude is the size of K: with the single K of the whole
step a thousand feet, with the last gain of the nested family some twenty, and that one runs into the limits of the
inputs at the step. The tube leaves the same few feet with either. (Under the tube the family has come to its last gain
long before the fault.)

{robust}
## Nominal laws
The tube about nominal plans of different laws; coupled vehicle with the paper-like coupling.

{laws}
## Integral action
An extension of the paper's law, for the offset that a wrong mass leaves.

{integral}"""


def comparison() -> str:
    """Return the page."""
    return _PAGE.format(robust=table(ROBUST_AND_TUBE), laws=table(NOMINAL_LAWS), integral=table(INTEGRAL))


def table(names: tuple[str, ...]) -> str:
    """Return a row for each scenario, flown."""
    head = (
        "| scenario | settled: h s | V s | error at the fault: h ft | V ft/s | largest error of h after it, ft "
        "| error at 200 s: h ft | V ft/s | saturated steps |"
    )
    return "\n".join([head, "| --- |" + " ---: |" * 8, *(_row(name) for name in names)]) + "\n"


def _row(name: str) -> str:
    flight = fly(assemble(flight_parameters(load_scenario(name))))
    metrics = flight_metrics(flight.data())
    at_fault, largest = _after_the_fault(flight)
    cells = [
        *(f"{metrics[key]:.1f}" if key in metrics else "no" for key in _SETTLED),
        _paper(at_fault[0], "m"),
        _paper(at_fault[1], "m/s"),
        _paper(largest, "m"),
        _paper(metrics["altitude_end_error"], "m"),
        _paper(metrics["velocity_end_error"], "m/s"),
        f"{metrics['saturated_steps']:g}",
    ]
    return f"| {name} | " + " | ".join(cells) + " |"


_SETTLED = ("altitude_settling_time", "velocity_settling_time")


def _after_the_fault(flight: Flight) -> tuple[np.ndarray, float]:
    """Return the errors (2) of altitude and velocity as the fault sets in, and the largest of altitude from then on."""
    error = (flight.history.state - flight.reference)[flight.time >= (flight.fault_start or 0.0) - 1e-9, :2]
    return error[0], float(np.abs(error[:, 0]).max())


def _paper(value: float, unit: str) -> str:
    # Adding zero makes a negative zero positive.
    return f"{round(to_paper(float(value), unit)[0], 2) + 0.0:.2f}"


if __name__ == "__main__":
    print(comparison(), end="")
