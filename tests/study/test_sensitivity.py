import numpy as np
import pytest

from hsv.study.sensitivity.catalogue import STUDIES, page
from hsv.study.sensitivity.controllers import WITH_NOTCH, WITHOUT_NOTCH, corners_of, growth
from hsv.study.sensitivity.flights_strip import finding, strip
from hsv.study.sensitivity.study import grid, lost_from
from hsv.vehicle.parameters import uncertainty_bounds, vehicle_parameters


def test_corners_meet_in_all_combinations_of_three_and_scale_with_the_bounds():
    nominal, *corners = corners_of(2.0)
    assert nominal == {}
    signs = np.array([[np.sign(corner[name]) for name in uncertainty_bounds()] for corner in corners])
    assert len({tuple(row) for row in signs}) == len(corners) == 32
    for i in range(10):
        for j in range(i):
            for k in range(j):
                assert len({tuple(row) for row in signs[:, [i, j, k]]}) == 8
    assert {abs(corner["mass"]) for corner in corners} == {2.0 * uncertainty_bounds()["mass"]}


def test_a_grid_keeps_its_ends_however_coarse():
    assert grid(0.0, 1.25, 0.05, 1.0) == pytest.approx(np.arange(26) * 0.05)
    assert grid(0.0, 1.25, 0.05, 50.0) == pytest.approx([0.0, 1.25])


def test_the_first_lost_point_is_named():
    values = np.array([1.0, 2.0, 3.0])
    assert lost_from(values, np.array([True, False, True])) == 2.0
    assert lost_from(values, np.array([True, True, True])) is None
    columns = {"without_limits": [1.0, 0.5, 0.5], "finished": [1.0, 1.0, 0.9], "nominal_finished": [1.0, 1.0, 1.0]}
    text = finding(WITH_NOTCH, values, columns, lambda v: f"x = {v:g}")
    assert "at its limits first at x = 2, a first flight lost at x = 3, the nominal vehicle nowhere" in text
    assert "first at x = 3" in finding(WITH_NOTCH, values, columns, lambda v: f"x = {v:g}", rising=False)


def test_a_strip_leaves_out_what_a_lost_flight_shows():
    table = {
        "diverged": np.array([0.0, 1.0]),
        "saturated_steps": np.array([0.0, 400.0]),
        "altitude_end_error": np.array([-2.0, 9.0]),
    }
    columns = strip([table])
    assert columns["finished"] == columns["without_limits"] == [0.5]
    assert columns["altitude_end_error_nominal"] == [2.0]
    assert np.isnan(columns["altitude_end_error_worst"]).all()
    assert np.isnan(columns["elastic_decay_time_nominal"]).all()


def test_the_notch_holds_where_the_loop_without_it_is_lost():
    derived = vehicle_parameters("derived")
    assert growth(WITH_NOTCH, derived) < -0.1
    assert growth(WITHOUT_NOTCH, derived) > 1.0
    assert growth(WITHOUT_NOTCH, derived.with_coupling_scale(0.1)) < 0.0


def test_a_coarse_study_has_a_page_with_its_findings(tmp_path):
    study = STUDIES["coupling"]
    outcome = study.run(25.0, tmp_path, lambda what, done, total: None)
    assert outcome.figure.axes
    assert outcome.strips["kappa"] == [0.0, 1.25]
    text = page(study, outcome)
    assert "coupling.png" in text
    assert all(f"{finding[1:]}." in text for finding in outcome.findings)
    assert "nowhere (nominal)" in text
