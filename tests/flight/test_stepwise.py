"""The loop step by step through the components, and what flies only there."""

import numpy as np
import pytest

from hsv.control.design import ControlDesign
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.model.plant import FlightStatus

FOOT = 0.3048


def components(scenario, **changes):
    return assemble({**flight_parameters(load_scenario(scenario)), **changes})


@pytest.mark.parametrize(
    ("scenario", "index", "least", "most"),
    # Control study, section 7: 1174 ft with the single gain, 26 to 148 ft with the last of a family.
    [("case1_single_k", 0, 100.0, 2000.0), ("case1", 6, 15.0, 150.0)],
)
def test_robust_mpc_loses_altitude_after_the_fault_and_the_tube_does_not(scenario, index, least, most):
    changes = {"vehicle.model": "DM", "robust_mpc.gain_index": index}
    robust = fly(components(scenario, controller="robust_mpc", **changes))
    tube = fly(components(scenario, **changes))
    errors = [abs(flight.history.state[-1, 0] - flight.reference[-1, 0]) / FOOT for flight in (robust, tube)]
    assert robust.status is FlightStatus.FINISHED
    assert least < errors[0] < most
    assert errors[1] < 10.0


def test_robust_mpc_is_the_tube_law_about_a_nominal_trajectory_under_its_own_gain():
    values = {**flight_parameters(load_scenario("case1_rmpc_fourth_k")), "duration": 4.0, "fault.starts": [1.0]}
    design = ControlDesign.from_parameters(values)
    gain = design.nominal_gains[values["robust_mpc.gain_index"]].ravel().tolist()
    # The nominal state drops out of K (x - x_r - x_n) + K x_n + u_r; the invariant set is another loop's.
    as_tube_law = {name: value for name, value in values.items() if not name.startswith("tube.")} | {
        "controller": "tube_mpc",
        "feedback.gain": gain,
        "nominal.gains": gain,
        "nominal.ellipsoids": design.nominal_ellipsoids[0].ravel().tolist(),
    }
    robust, tube = fly(assemble(values)).history, fly(assemble(as_tube_law)).history
    np.testing.assert_allclose(tube.state, robust.state, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(tube.command, robust.command, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("mass", [-0.1, 0.1])
def test_integral_action_removes_the_offset_of_a_wrong_mass(mass):
    changes = {"vehicle.perturbation.mass": mass}
    with_integral = fly(components("case1", **changes, **{"integral.rate": 0.1}))
    without = fly(components("case1", **changes))
    error, offset = (abs(f.history.state[-1, 0] - f.reference[-1, 0]) / FOOT for f in (with_integral, without))
    assert error < 0.5 < 1.5 < offset
    assert abs(with_integral.history.state[-1, 1] - with_integral.reference[-1, 1]) / FOOT < 0.1
