"""An example of a compiled controller, as fast as those of the bench: two gains, interpolated over the velocity."""

import numpy as np
from numba import cfunc
from scipy.linalg import solve_discrete_are

from hsv.base.parameters import Parameter, validate
from hsv.control.controller import StepKernel
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import zero_order_hold
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle

RIGID = 5  # altitude, velocity, angle of attack, pitch angle, pitch rate
STATE_SCALE = np.array([100.0, 20.0, 0.01, 0.01, 0.05])  # m, m/s, rad, rad, rad/s: deviations that weigh equally
INPUT_SCALE = np.array([0.5, 0.1])  # fuel equivalence ratio, elevator deflection (rad)

# Indices into the inputs of the step function: x (9), q_f, x_r (9), u_r (2), x_n (9), u_n (2), filter state s.
FILTERED_RATE, REFERENCE, REFERENCE_INPUT = 9, 10, 19
# Indices into its parameters: two velocities, then the gains (2 x 5) at these velocities, row by row.
LOW, HIGH, GAINS = 0, 1, 2


@cfunc("int32(int64, CPointer(float64), CPointer(float64), CPointer(float64), CPointer(float64))", cache=True)
def step(k, given, wanted, state, parameters):
    """Write the unsaturated input u_r - K(V) (x - x_r) to ``wanted``; the pitch rate in x is the filtered one."""
    share = (given[1] - parameters[LOW]) / (parameters[HIGH] - parameters[LOW])
    share = min(max(share, 0.0), 1.0)
    for i in range(2):
        total = 0.0
        for j in range(RIGID):
            value = given[FILTERED_RATE] if j == RIGID - 1 else given[j]
            low, high = parameters[GAINS + RIGID * i + j], parameters[GAINS + RIGID * (2 + i) + j]
            total += (low + share * (high - low)) * (value - given[REFERENCE + j])
        wanted[i] = given[REFERENCE_INPUT + i] - total
    return 0


class Scheduled:
    """u = u_r - K(V) (x - x_r), K by linear-quadratic regulators at two velocities."""

    PARAMETERS = (
        Parameter("scheduled.input_weight", 1.0, "times the inputs' weight: larger is slower", "", 1e-3, 1e3),
        Parameter("scheduled.low_velocity", 2407.92, "velocity of the first gain", "m/s", 2346.96, 2529.84),
        Parameter("scheduled.high_velocity", 2484.12, "velocity of the second gain", "m/s", 2346.96, 2529.84),
    )

    @classmethod
    def from_parameters(cls, values, design):
        """Return the controller, with gains computed for the nominal rigid vehicle; ``design`` is not used."""
        own = validate(cls.PARAMETERS, values)
        speeds = [own[f"scheduled.{end}_velocity"] for end in ("low", "high")]
        if not speeds[0] < speeds[1]:
            raise ValueError(f"scheduled.high_velocity = {speeds[1]:g} m/s: expected more than low_velocity")
        vehicle, period = Vehicle.from_parameters(values).decoupled, values.get("period", 0.02)
        gains = [
            regulator(vehicle, values["initial.altitude"], speed, own["scheduled.input_weight"], period)
            for speed in speeds
        ]
        controller = cls()
        controller.kernel = StepKernel(step.address, np.zeros(0), np.concatenate((speeds, *map(np.ravel, gains))))
        return controller


def regulator(vehicle, altitude, velocity, input_weight, period):
    """Return the gain (2, 5) of a linear-quadratic regulator for the rigid vehicle in its trim (m, m/s), SI."""
    point = trim(vehicle, altitude, velocity)
    A, B = zero_order_hold(*jacobian(point.state, point.input, vehicle), period)
    A, B = A[:RIGID, :RIGID], B[:RIGID]
    Q, R = np.diag(STATE_SCALE**-2.0), input_weight * np.diag(INPUT_SCALE**-2.0)
    P = solve_discrete_are(A, B, Q, R)
    return np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
