from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from hsv.control.design import find_design, read_design
from hsv.design.inputs import find_inputs, read_inputs
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import design
from hsv_paper.linear_loop import COUPLING_SCALES, TARGET, stability_limit
from hsv_paper.sensitivity import STUDIES, hardware
from hsv_paper.sensitivity.factor import FINE, growth, is_certified
from hsv_paper.sensitivity.flown import coupling_limits
from hsv_paper.sensitivity.notch import SETS, stable_range
from hsv_paper.sensitivity.sweep import (
    ALL,
    RMPC,
    RMPC_DECOUPLED,
    RMPC_WITH_NOTCH,
    WIDER_NOTCH,
    WITH_NOTCH,
    WITHOUT_NOTCH,
    columns_of,
    lost_where,
)
from hsv_paper.sensitivity.weights import BOUNDS, ELEVATOR, WEIGHTS, varied
from hsv_paper.study import Scope, in_words, markdown, rounded

FINEST = Scope(1.0, Path("unused"))


def test_corners_meet_in_all_combinations_of_three_and_scale_with_the_bounds():
    nominal, *corners = FINEST.corners(2.0)
    assert nominal == {}
    signs = np.array([[np.sign(corner[name]) for name in load_vehicle().uncertainty] for corner in corners])
    assert len({tuple(row) for row in signs}) == len(corners) == 32
    for i in range(10):
        for j in range(i):
            for k in range(j):
                assert len({tuple(row) for row in signs[:, [i, j, k]]}) == 8
    assert {abs(corner["mass"]) for corner in corners} == {2.0 * load_vehicle().uncertainty["mass"]}


def test_a_coarse_study_says_how_many_corners_are_left():
    coarse = Scope(16.0, Path("unused"))
    assert in_words(FINEST.over) == "nominal vehicle and 32 of the 1024 corners"
    assert in_words(coarse.over) == "nominal vehicle and 2 of the 1024 corners"
    assert coarse.over[0] == {}


def test_a_grid_keeps_its_ends_however_coarse():
    assert FINEST.grid(0.0, 1.25, 0.05) == pytest.approx(np.arange(26) * 0.05)
    assert Scope(50.0, Path("unused")).grid(0.0, 1.25, 0.05) == pytest.approx([0.0, 1.25])


def test_where_flights_are_lost_is_put_between_points():
    values = np.array([1.0, 2.0, 3.0])
    columns = {"without_limits": [1.0, 0.5, 0.5], "finished": [1.0, 1.0, 0.9], "nominal_finished": [1.0, 1.0, 1.0]}
    columns = {name: np.array(column) for name, column in columns.items()}
    assert lost_where(values, columns) == {
        "saturation begins": "1.00 to 2.00",
        "losses begin": "2.00 to 3.00",
        "nominal vehicle lost": "–",
    }
    assert lost_where(values, columns, 1, rising=False)["saturation begins"] == "at 3.0"
    again = columns | {"finished": np.array([0.9, 1.0, 0.8])}
    assert lost_where(values, again)["losses begin"] == "at 1.00, 2.00 to 3.00"


def test_cells_of_a_table_are_rounded_and_none_is_a_dash():
    rows = [{"case": "a", "x": rounded(0.45678, 3)}, {"case": "b", "x": rounded(np.nan, 3)}]
    assert markdown(rows) == "| case | x |\n| --- | ---: |\n| a | 0.457 |\n| b | – |"


def test_a_sweep_leaves_out_what_a_lost_flight_shows():
    table = {
        "diverged": np.array([0.0, 1.0]),
        "saturated_steps": np.array([0.0, 400.0]),
        "altitude_end_error": np.array([-2.0, 9.0]),
    }
    columns = columns_of([table])
    assert columns["finished"] == columns["without_limits"] == 0.5
    assert columns["altitude_end_error_nominal"] == 2.0
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
        assert bool(controller.loop.notch) is filtered
    assert [c.parameters()["vehicle.model"] for c in (*ALL, RMPC_DECOUPLED)] == ["CM"] * 5 + ["DM"]
    assert load_vehicle().coupling_scale("paper_like") == pytest.approx(0.25)


@pytest.mark.parametrize(("controller", "near"), [(WITHOUT_NOTCH, 0.25), (RMPC, 0.68), (WITH_NOTCH, 1.10)])
def test_coupling_limits_bracket_the_change_of_sign(controller, near):
    over = Scope(8.0, Path("unused")).over
    loop = controller.loop
    nominal, worst = loop.critical_coupling(), loop.critical_coupling(over)
    assert nominal == pytest.approx(near, abs=0.01)
    assert worst < nominal
    for limit, vehicles in ((nominal, over[:1]), (worst, over)):
        below, above = (loop.growth(load_vehicle().coupled(limit + step), vehicles) for step in (-1e-3, 1e-3))
        assert below < 0.0 < above
    assert list(coupling_limits(loop, over).values()) == [f"{nominal:.2f}", f"{worst:.2f}"]


def test_robust_mpc_is_lost_without_a_notch_and_would_not_be_with_one():
    derived = load_vehicle().coupled("derived")
    assert RMPC.loop.growth(derived) > 0.1
    assert RMPC_WITH_NOTCH.loop.growth(derived) < 0.0
    limits = coupling_limits(RMPC_WITH_NOTCH.loop, Scope(16.0, Path("unused")).over)
    assert set(limits.values()) == {f"≥ {COUPLING_SCALES[-1]}"}


def test_limits_of_the_notch_of_the_nominal_vehicle():
    """As docs/study/notch.md prints them."""
    centres, depths = np.array([8.0, 15.0, 26.0]), np.geomspace(0.005, 0.5, 17)
    paper_like, derived = (list(stable_range(coupled, [{}], centres, depths).values()) for coupled in SETS)
    assert paper_like == ["≤ 8", "≥ 26", "≥ 0.5"]
    assert derived == ["11.91", "15.82", "0.062"]


def test_each_group_of_weights_varies_its_own():
    nominal = read_inputs(find_inputs("baseline")).nominal
    for group in (*WEIGHTS, BOUNDS):
        changed = group.times(nominal, 2.0)
        size = np.concatenate(
            [table.array() for table in (changed.state_scale, changed.input_scale, changed.input_bound)]
        )
        own = np.concatenate(
            [table.array() for table in (nominal.state_scale, nominal.input_scale, nominal.input_bound)]
        )
        assert set(size / own) == {1.0, 2.0}
        assert np.count_nonzero(size != own) == len(group.names)
    softer, own, stiffer = (varied("F", ELEVATOR, factor).feedback_gain[1, 4] for factor in (0.5, 1.0, 2.0))
    assert own == design("baseline").feedback_gain[1, 4]
    assert softer < own < stiffer


@pytest.mark.long
def test_a_coarse_study_has_a_page_with_its_findings(tmp_path):
    study = STUDIES["coupling"]
    outcome = study.run(Scope(25.0, tmp_path))
    assert outcome.figure.axes
    text = study.page(outcome)
    assert "coupling.png" in text
    assert "nominal vehicle and 1 of the 1024 corners" in text
    [rows] = outcome.tables
    assert [row["controller"] for row in rows] == [controller.label for controller in ALL]
    assert rows[2]["stable up to κ, nominal"] == "0.25"
    assert markdown(rows) in text


def test_hardware_limits_of_the_baseline_and_of_the_loop_without_notch():
    """Where stability changes the loop is on the edge; without the notch elevators of a middle range destabilise it."""
    with_notch, without = hardware.CASES[:2]
    for case in (with_notch, without):
        borne = hardware.tolerated_delay(case, hardware.ELEVATORS["50 rad/s"])
        assert hardware.growth(case, hardware.elevator(50.0, borne - 1e-3)) < 0.0
        assert hardware.growth(case, hardware.elevator(50.0, borne + 1e-3)) > 0.0
    assert hardware.stability(without, [{}])["stable with, rad/s, nominal"] == "7.25 to 83.5, from 628 on"


@pytest.mark.long
def test_gusts_that_stay_and_those_that_decay():
    """Half a degree of angle of attack is 71 ft/s of wind from below; a gust that decays at once hardly matters."""
    case, (decaying, staying) = hardware.CASES[0], hardware.GUSTS
    stays = hardware.gust_limits(case, staying)
    assert 0.5 < stays["attitude"] / (hardware.HALF_DEGREE * TARGET[1]) < 1.0
    assert stays["elevator"] > stays["attitude"] and stays["lost"] is None
    assert set(hardware.gust_limits(case, decaying).values()) == {None}
    at = hardware.worse(case, staying, stays["elevator"])
    assert at.elevator == pytest.approx(hardware.SURFACE.stop, rel=1e-3)


@pytest.mark.long
def test_a_limit_below_the_first_velocity_is_found():
    case, gust = hardware.CASES[3], hardware.GUSTS[1]
    found = hardware.gust_limits(case, gust)["attitude"]
    assert found < hardware.VELOCITIES[0]
    assert hardware.worse(case, gust, found).attitude == pytest.approx(hardware.HALF_DEGREE, rel=1e-3)


def test_a_gust_moves_the_elevator_more_the_faster_it_is():
    slow, fast = (hardware.worse(hardware.CASES[0], hardware.GUSTS[1], velocity) for velocity in (10.0, 20.0))
    assert slow.attitude < fast.attitude and slow.elevator < fast.elevator and not fast.lost
    assert fast.attitude == pytest.approx(2.0 * slow.attitude, rel=0.05)


def test_an_unstable_loop_has_no_response_to_noise():
    unstable = replace(WITHOUT_NOTCH, changes=(("vehicle.coupling", "derived"),))
    assert np.isnan(hardware.rms(unstable, hardware.elevator(50.0), "fine"))


@pytest.mark.parametrize("coupling", ["paper_like", "derived"])
def test_the_loop_is_lost_between_factors_of_a_half_and_four_tenths(coupling):
    # Control study, section 7.
    at = partial(growth, design("adjustable"), coupling, [{}])
    assert all(at(tau) < 0.0 for tau in (1.0, 0.75, 0.5)) and all(at(tau) > 0.0 for tau in (0.4, 0.3))
    limit = stability_limit(at, FINE[::-1].tolist())
    assert 0.4 < limit < 0.5
    assert at(limit + 1e-3) < 0.0 < at(limit - 1e-3)


@pytest.mark.long
def test_the_certified_range_of_the_factor_ends_before_the_loop_is_lost():
    inputs = read_inputs(find_inputs("adjustable"))
    assert [is_certified(design("adjustable"), inputs, tau) for tau in (0.8, 0.5, 0.4)] == [True, True, False]
