import numpy as np

from hsv.control.design import certificate_path, find_design, read_certificate
from hsv_paper.disturbances import largest_disturbances


def test_disturbances_of_a_flight_lie_in_the_set_that_was_certified():
    bounds = read_certificate(certificate_path(find_design("baseline")))["tube"]["disturbance"]["channels"]
    found = largest_disturbances("case1", [{}, {"mass": 0.1, "moment_of_inertia": -0.1}])
    assert found.keys() == bounds.keys()
    for name, values in found.items():
        assert np.all(values <= max(-bounds[name]["lower"], bounds[name]["upper"]))


def test_without_the_notch_there_is_no_filtered_rate_and_more_pitch_acceleration():
    with_notch, without = (largest_disturbances(name, [{}]) for name in ("case1", "case1_no_notch"))
    assert with_notch["filtered_nominal_rate"][0] > 0.0
    assert without["filtered_nominal_rate"][0] == 0.0
    assert with_notch["pitch_acceleration"][0] < 0.9 * without["pitch_acceleration"][0]
