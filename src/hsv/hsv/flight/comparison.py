"""Comparison of controllers and nominal laws: ``python -m hsv.flight.comparison > docs/comparison.md``."""

from __future__ import annotations

import numpy as np

from hsv.base.units import to_paper
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.flight import Flight
from hsv.flight.metrics import SETTLING_BAND, FlightData, flight_metrics
from hsv.flight.scenario import load_scenario

ROBUST_AND_TUBE = ("case1_rmpc", "case1_tube_dm", "case1_rmpc_last_k", "case1_tube_dm_family")
NOMINAL_LAWS = ("case1_single_k", "case1", "case1_smooth", "case1_kothare_online", "case1_qp")
BESIDE_THE_OPTIMUM = (*NOMINAL_LAWS, "case1_governed")
INTEGRAL = ("case1_integral_heavy", "case1_integral_light")

LEAST_TIME = 10.01
"""Time (s) after which both commands can be settled with inputs within U: `hsv-paper sensitivity limits`."""

_PAGE = """# Comparison of controllers and nominal laws
Made by `python -m hsv.flight.comparison > docs/comparison.md`; every row is one scenario, flown in one process as
by `hsv simulate NAME --units paper`. Errors are the deviations of altitude and velocity from their commands.

## Robust MPC and the tube
The traditional robust MPC of the paper's section 5.2 is u = K x + u_r, without a notch filter; the vehicle is
decoupled, with an elevator effectiveness of 0.9 from 100 s. Its altitude error depends on K: with the single K for the
whole step it is a thousand feet, with the last gain of the nested family about twenty, but that gain saturates the
inputs at the step. With the tube the error is the same few feet for both. (With the tube, the nested family has reached
its last gain long before the fault.)

{robust}
## Nominal laws
The tube about the nominal trajectories of different laws, for the coupled vehicle with the paper-like coupling.

{laws}
## Beside the optimum
With inputs within U, altitude and velocity of the nominal vehicle can be settled to 2 % from {least} s on: the
[physical limit](study/limits.md), by optimal control (`hsv-paper sensitivity limits`). The later of both settling times
is so many times as long:

{optimum}
## Integral action
An extension of the paper's law that removes the steady-state error caused by a wrong mass.

{integral}"""


def comparison() -> str:
    """Return the page."""
    return _PAGE.format(
        robust=table(ROBUST_AND_TUBE),
        laws=table(NOMINAL_LAWS),
        least=LEAST_TIME,
        optimum=ratios(BESIDE_THE_OPTIMUM),
        integral=table(INTEGRAL),
    )


def ratios(names: tuple[str, ...]) -> str:
    """Return a table of the later settling time of each scenario, flown, and its ratio to :data:`LEAST_TIME`."""
    rows = ["| scenario | both settled, s | times the least |", "| --- | ---: | ---: |"]
    for name in names:
        later = float(settling_times(fly(assemble(flight_parameters(load_scenario(name)))).data()).max())
        rows.append(f"| {name} | {later:.1f} | {later / LEAST_TIME:.1f} |" if later < np.inf else f"| {name} | no | |")
    return "\n".join(rows) + "\n"


def settling_times(flight: FlightData) -> np.ndarray:
    """Return the times (2), s, from which altitude and velocity stay within 2 % of the whole change up to the fault.

    The change is from the first state to the last reference, whether that is a step or not; infinite: not settled.
    """
    before = flight.time < (np.inf if flight.fault_start is None else flight.fault_start - 1e-9)
    target = flight.reference[-1, :2]
    off = np.abs(flight.state[before, :2] - target) > SETTLING_BAND * np.abs(target - flight.state[0, :2])
    last = [int(np.flatnonzero(column)[-1]) + 1 if column.any() else 0 for column in off.T]
    return np.array([flight.time[index] if index < len(off) else np.inf for index in last])


def table(names: tuple[str, ...]) -> str:
    """Return a table with a row for each scenario, flown."""
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
