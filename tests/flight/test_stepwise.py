"""The loop step by step through the components, and what flies only there."""

import numpy as np

from hsv.control.design import ControlDesign
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario


def components(scenario, **changes):
    return assemble({**flight_parameters(load_scenario(scenario)), **changes})


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
