import re

import numpy as np
import pytest

from hsv.control.design import find_design, read_design
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import COUPLING_SCALES, TARGET
from hsv_paper.sensitivity import gusts, hardware
from hsv_paper.sensitivity.catalogue import STUDIES, page
from hsv_paper.sensitivity.controllers import (
    ALL,
    RMPC,
    RMPC_DECOUPLED,
    RMPC_WITH_NOTCH,
    WIDER_NOTCH,
    WITH_NOTCH,
    WITHOUT_NOTCH,
    corners_of,
    coupling_limits,
    feedback,
    growth,
    said_corners,
)
from hsv_paper.sensitivity.notch import Limits
from hsv_paper.sensitivity.study import grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_figures import finding
from hsv_paper.sensitivity.sweep_result import sweep_result
from hsv_paper.sensitivity.variations import BOUNDS, ELEVATOR, WEIGHTS, baseline_variations


def quiet(what, done, total):
    pass


def test_corners_meet_in_all_combinations_of_three_and_scale_with_the_bounds():
    nominal, *corners = corners_of(2.0)
    assert nominal == {}
    signs = np.array([[np.sign(corner[name]) for name in load_vehicle().uncertainty] for corner in corners])
    assert len({tuple(row) for row in signs}) == len(corners) == 32
    for i in range(10):
        for j in range(i):
            for k in range(j):
                assert len({tuple(row) for row in signs[:, [i, j, k]]}) == 8
    assert {abs(corner["mass"]) for corner in corners} == {2.0 * load_vehicle().uncertainty["mass"]}


def test_a_coarse_study_says_how_many_corners_are_left():
    assert said_corners(corners_of(1.0)) == "32 of the 1024 corners"
    assert said_corners(corners_of(1.0, 16.0)) == "2 of the 1024 corners"
    assert corners_of(1.0, 16.0)[0] == {}


def test_a_grid_keeps_its_ends_however_coarse():
    assert grid(0.0, 1.25, 0.05, 1.0) == pytest.approx(np.arange(26) * 0.05)
    assert grid(0.0, 1.25, 0.05, 50.0) == pytest.approx([0.0, 1.25])


def test_where_flights_are_lost_is_put_between_points():
    values = np.array([1.0, 2.0, 3.0])
    columns = {"without_limits": [1.0, 0.5, 0.5], "finished": [1.0, 1.0, 0.9], "nominal_finished": [1.0, 1.0, 1.0]}
    text = finding(WITH_NOTCH, values, columns, "x = {}")
    assert "saturation begins between x = 1.00 and 2.00, losses begin between x = 2.00 and 3.00, and" in text
    assert text.endswith("the nominal vehicle is not lost")
    assert "saturation begins already at x = 3.0" in finding(
        WITH_NOTCH, values, columns, "x = {}", digits=1, rising=False
    )
    again = columns | {"finished": [0.9, 1.0, 0.8]}
    assert "losses begin already at x = 1.00 and again between x = 2.00 and 3.00" in finding(
        WITH_NOTCH, values, again, "x = {}"
    )


def test_a_sweep_leaves_out_what_a_lost_flight_shows():
    table = {
        "diverged": np.array([0.0, 1.0]),
        "saturated_steps": np.array([0.0, 400.0]),
        "altitude_end_error": np.array([-2.0, 9.0]),
    }
    columns = sweep_result([table])
    assert columns["finished"] == columns["without_limits"] == [0.5]
    assert columns["altitude_end_error_nominal"] == [2.0]
    assert np.isnan(columns["altitude_end_error_worst"]).all()
    assert np.isnan(columns["elastic_decay_time_nominal"]).all()


def test_labels_say_what_flies():
    (at_15,), (at_14,) = (read_design(find_design(c.design)).notch for c in (WITH_NOTCH, WIDER_NOTCH))
    assert f"{at_15.zero_frequency:g} rad/s" in WITH_NOTCH.label
    assert f"{at_14.zero_frequency:g} rad/s" in WIDER_NOTCH.label
    assert at_14.pole_damping > at_15.pole_damping
    for controller, filtered in (
        (RMPC, False),
        (RMPC_WITH_NOTCH, True),
        (RMPC_DECOUPLED, False),
        (WITHOUT_NOTCH, False),
    ):
        assert bool(feedback(controller)[1]) is filtered
    assert [c.parameters()["vehicle.model"] for c in (*ALL, RMPC_DECOUPLED)] == ["CM"] * 5 + ["DM"]
    assert load_vehicle().coupling_scale("paper_like") == pytest.approx(0.25)


@pytest.mark.parametrize(("controller", "near"), [(WITHOUT_NOTCH, 0.25), (RMPC, 0.68), (WITH_NOTCH, 1.10)])
def test_coupling_limits_bracket_the_change_of_sign(controller, near):
    over = corners_of(1.0, 8.0)
    limits = coupling_limits(*feedback(controller), over)
    assert limits.nominal == pytest.approx(near, abs=0.01)
    assert limits.worst < limits.nominal
    for limit, vehicles in ((limits.nominal, over[:1]), (limits.worst, over)):

        def worst(kappa, vehicles=vehicles):
            return max(growth(controller, load_vehicle().coupled(kappa).perturbed(corner)) for corner in vehicles)

        assert worst(limit - 1e-3) < 0.0 < worst(limit + 1e-3)
    assert f"κ = {limits.nominal:.2f} (nominal vehicle) and κ = {limits.worst:.2f} (worst of" in limits.said()


def test_robust_mpc_is_lost_without_a_notch_and_would_not_be_with_one():
    derived = load_vehicle().coupled("derived")
    assert growth(RMPC, derived) > 0.1
    assert growth(RMPC_WITH_NOTCH, derived) < 0.0
    limits = coupling_limits(*feedback(RMPC_WITH_NOTCH), corners_of(1.0, 16.0))
    assert limits.nominal is limits.worst is None
    assert f"is stable up to at least κ = {COUPLING_SCALES[-1]} (nominal vehicle)" in limits.said()


def test_a_sweep_is_flown_once_and_found_again(tmp_path):
    told = []
    values = [WITH_NOTCH.parameters() | {"vehicle.coupling": kappa} for kappa in ("0.0", "0.25")]
    points = {WITH_NOTCH: [Point(value, corners_of(1.0, 32.0)) for value in values]}
    flown = sweep("test", points, tmp_path, quiet)
    found = sweep("test", points, tmp_path, lambda *what: told.append(what))
    assert found == flown
    assert told == [("test, flights", 2, 2)]
    assert flown[WITH_NOTCH]["finished"] == [1.0, 1.0]
    other = {WITH_NOTCH: [Point(values[1], corners_of(0.5, 32.0))]}
    assert sweep("test", other, tmp_path, quiet) != flown
    assert len(list(tmp_path.iterdir())) == 1


def test_limits_of_the_notch_in_words():
    centres = np.array([8.0, 26.0])
    said = Limits(None, None, None).said(centres)
    assert said.startswith(
        "stable with every centre from 8 to 26 rad/s; with the centre at 15 rad/s, it is stable at every"
    )
    said = Limits(12.041, None, 0.063).said(centres)
    assert said.startswith("stable with the centre from 12.04 to 26 rad/s; ")
    assert said.endswith("with the centre at 15 rad/s, it is stable up to a zero damping of 0.063")
    assert "at 15 rad/s, it is unstable at a zero damping of 0.02" in Limits(12.0, 14.9, np.nan).said(centres)
    assert "stable with no centre at a zero damping of 0.02" in Limits(np.nan, np.nan, np.nan).said(centres)


def test_each_group_of_weights_varies_its_own():
    varied = baseline_variations()
    nominal = varied.inputs.nominal
    for group in (*WEIGHTS, BOUNDS):
        changed = group.times(nominal, 2.0)
        size = np.concatenate(
            [table.array() for table in (changed.state_scale, changed.input_scale, changed.input_bound)]
        )
        own = np.concatenate(
            [table.array() for table in (nominal.state_scale, nominal.input_scale, nominal.input_bound)]
        )
        assert set(size / own) == {1.0, 2.0}
        assert np.count_nonzero(size != own) == len(group.states + group.inputs + group.bounds)
    assert varied.feedback(ELEVATOR, 1.0) is varied.flown
    softer, stiffer = (varied.feedback(ELEVATOR, factor).feedback_gain[1, 4] for factor in (0.5, 2.0))
    assert softer < varied.flown.feedback_gain[1, 4] < stiffer


def test_a_coarse_study_has_a_page_with_its_findings(tmp_path):
    study = STUDIES["coupling"]
    outcome = study.run(25.0, tmp_path, quiet)
    assert outcome.figure.axes
    assert outcome.numbers["kappa"] == [0.0, 1.25]
    text = page(study, outcome)
    assert "coupling.png" in text
    assert all(f"{finding[1:]}." in text for finding in outcome.findings)
    assert "the worst of 1 of the 1024 corners" in outcome.shows
    for controller, found in zip(ALL, outcome.findings, strict=False):
        limit = outcome.numbers["unstable_from"][controller.label]["nominal"]
        assert found.startswith(controller.label)
        said = re.search(r"stable up to (?:at least )?κ = (\S+) \(nominal", found)
        assert float(said[1]) == pytest.approx(COUPLING_SCALES[-1] if limit is None else limit, abs=0.005)


def test_hardware_limits_of_the_baseline_and_of_the_loop_without_notch():
    """Where stability changes the loop is on the edge; without the notch elevators of a middle range destabilise it."""
    with_notch, without = hardware.CASES[:2]
    for case in (with_notch, without):
        limits = hardware.Limits.of(case, [{}])
        for bandwidth in limits.bandwidths[0]:
            assert abs(hardware.growth(case, hardware.elevator(bandwidth))) < 1e-3
        borne = limits.delays["one of 50 rad/s"][0]
        assert hardware.growth(case, hardware.elevator(50.0, borne - 1e-3)) < 0.0
        assert hardware.growth(case, hardware.elevator(50.0, borne + 1e-3)) > 0.0
    assert len(limits.bandwidths[0]) == 3
    assert limits.bandwidths[0][1] < 150.0 < limits.bandwidths[0][2]
    assert "stable from 7.25 to 83.5 rad/s and from 628 rad/s on (nominal vehicle)" in limits.said("no corner")


@pytest.mark.long
def test_gusts_that_stay_and_those_that_fall():
    """Half a degree of angle of attack is 71 ft/s of wind from below; what falls at once the vehicle hardly answers."""
    falls, stays = (gusts.gust_limits(WITH_NOTCH, "paper_like", shape) for shape in gusts.SHAPES)
    assert 0.5 < stays.attitude / (gusts.HALF_DEGREE * TARGET[1]) < 1.0
    assert stays.elevator > stays.attitude and stays.lost is None
    assert (falls.attitude, falls.elevator, falls.lost) == (None, None, None)
    at = gusts.worse(WITH_NOTCH, "paper_like", gusts.SHAPES[1], stays.elevator)
    assert at.elevator == pytest.approx(gusts.STOP, rel=1e-3)


def test_a_limit_below_the_first_velocity_is_found():
    found = gusts.gust_limits(hardware.RMPC, "paper_like", gusts.SHAPES[1]).attitude
    assert found < gusts.VELOCITIES[0]
    at = gusts.worse(hardware.RMPC, "paper_like", gusts.SHAPES[1], found)
    assert at.attitude == pytest.approx(gusts.HALF_DEGREE, rel=1e-3)


def test_a_gust_moves_the_elevator_more_the_faster_it_is():
    shape = gusts.SHAPES[1]
    slow, fast = (gusts.worse(WITH_NOTCH, "paper_like", shape, velocity) for velocity in (10.0, 20.0))
    assert slow.attitude < fast.attitude and slow.elevator < fast.elevator and not fast.lost
    assert fast.attitude == pytest.approx(2.0 * slow.attitude, rel=0.05)


def test_a_loop_that_is_unstable_has_no_noise_to_speak_of():
    unstable = hardware.Case(WITHOUT_NOTCH, "derived", "black")
    assert np.isnan(hardware.elevator_noise(unstable, hardware.elevator(50.0), "fine"))
