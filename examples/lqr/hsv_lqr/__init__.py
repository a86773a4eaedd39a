"""An example of a custom controller: a linear-quadratic regulator about the reference, with integral action."""

import numpy as np
from scipy.linalg import solve_discrete_are

from hsv.base.parameters import Parameter, validate
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import zero_order_hold
from hsv.model.signals import PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle

RIGID = 5  # altitude, velocity, angle of attack, pitch angle, pitch rate
STATE_SCALE = np.array([100.0, 20.0, 0.01, 0.01, 0.05])  # m, m/s, rad, rad, rad/s: deviations that weigh equally
INPUT_SCALE = np.array([0.5, 0.1])  # fuel equivalence ratio, elevator deflection (rad)


class Lqr:
    """u = u_r - K [x - x_r; integral of the altitude and velocity errors], K for the trim that the flight starts in."""

    PARAMETERS = (
        Parameter("lqr.input_weight", 1.0, "times the inputs' weight in the cost: larger is slower", "", 1e-3, 1e3),
        Parameter("lqr.integral_time", 20.0, "time over which an error weighs as much as its integral", "s", 1.0, 1e4),
    )

    @classmethod
    def from_parameters(cls, values, design):
        """Return the regulator, with the gain computed for the nominal rigid vehicle; ``design`` is not used."""
        own = validate(cls.PARAMETERS, values)
        period = values.get("period", 0.02)
        vehicle = Vehicle.from_parameters(values).decoupled
        point = trim(vehicle, values["initial.altitude"], values["initial.velocity"])
        A, B = zero_order_hold(*jacobian(point.state, point.input, vehicle), period)
        A, B = A[:RIGID, :RIGID], B[:RIGID]
        # The integrals of both errors over time are two more states.
        full = np.block([[A, np.zeros((RIGID, 2))], [period * np.eye(2, RIGID), np.eye(2)]])
        inputs = np.vstack((B, np.zeros((2, 2))))
        scale = np.concatenate((STATE_SCALE, own["lqr.integral_time"] * STATE_SCALE[:2]))
        Q, R = np.diag(scale**-2.0), own["lqr.input_weight"] * np.diag(INPUT_SCALE**-2.0)
        P = solve_discrete_are(full, inputs, Q, R)
        lqr = cls()
        lqr.minimum, lqr.maximum = vehicle.input_minimum, vehicle.input_maximum
        lqr.period, lqr.gain = period, np.linalg.solve(R + inputs.T @ P @ inputs, inputs.T @ P @ full)
        lqr.reset()
        return lqr

    def reset(self):
        """Set the integrals to zero; called before every flight."""
        self.integral = np.zeros(2)

    def step(self, inputs):
        """Return the unsaturated input u (2); the bench limits it."""
        error = (inputs.estimate - inputs.reference)[:RIGID]
        error[PITCH_RATE] = inputs.filtered_pitch_rate - inputs.reference[PITCH_RATE]
        wanted = inputs.reference_input - self.gain @ np.concatenate((error, self.integral))
        # Anti-windup: the integrals are held while an input is limited.
        if np.all((wanted >= self.minimum) & (wanted <= self.maximum)):
            self.integral += self.period * error[:2]
        return wanted
