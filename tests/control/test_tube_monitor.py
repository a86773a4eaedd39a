import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import SignalError
from hsv.control.controller import ControllerInput
from hsv.control.design import TubeSet
from hsv.control.design_file import find_design, read_design
from hsv.control.nominal_law import ellipsoid_level
from hsv.control.notch_filter import NotchFilter
from hsv.control.tube_law import TubeLaw, TubeStatusCode


@pytest.fixture(scope="module")
def design():
    half_width = np.array([10.0, 3.0, 0.03, 0.03, 0.05, 0.002, 0.0003])
    tube = TubeSet(0.1 * half_width, np.diag(half_width**-2.0), half_width)
    return dataclasses.replace(read_design(find_design("baseline")), tube=tube)


def step(law, design, error, state=None):
    x = np.zeros(9)
    x[:5] = error
    filter_state = np.zeros(2) if state is None else state
    u_r = np.array([0.27, 0.21])
    return law.step(ControllerInput(0, x, x[4], np.zeros(9), u_r, np.zeros(9), np.zeros(2), filter_state))


def test_error_at_the_centre_has_level_zero_and_on_the_boundary_one(design):
    law = TubeLaw(design)
    assert step(law, design, design.tube.centre[:5]).level < 0.03  # the filter's error is zero, but not its centre
    boundary = design.tube.centre + design.tube.half_width * np.eye(7)[0]
    assert ellipsoid_level(design.tube.shape, boundary - design.tube.centre) == pytest.approx(1.0)


def test_an_absurd_altitude_error_is_outside_and_named(design):
    result = step(TubeLaw(design), design, [1111.1, 0.0, 0.0, 0.0, 0.0])
    assert (result.status, result.inside, result.component) == (TubeStatusCode.OUTSIDE, False, "altitude")
    assert_allclose(result.error, [1111.1, 0, 0, 0, 0, 0, 0])
    assert_allclose(result.tube_half_width, design.tube.half_width)
    farthest = step(TubeLaw(design), design, [20.0, 0.0, 0.0, 0.0, 0.2])
    assert (farthest.inside, farthest.component) == (False, "pitch_rate")


def test_filter_error_is_the_filter_fed_with_the_rate_error(design):
    law, real, fed = TubeLaw(design), NotchFilter(design.notch, design.period), NotchFilter(design.notch, design.period)
    rates = np.concatenate(([0.0], 0.01 * np.sin(np.arange(40))))
    planned = np.concatenate(([0.0], 0.02 * np.cos(np.arange(40))))
    for k, (e_q, q_n) in enumerate(zip(rates, planned, strict=True)):
        filtered = real.step(e_q + q_n)
        x, x_n = np.zeros(9), np.zeros(9)
        x[4], x_n[4] = e_q + q_n, q_n
        q_f, s = filtered.filtered_pitch_rate, filtered.filter_state
        result = law.step(ControllerInput(k, x, q_f, np.zeros(9), np.zeros(2), x_n, np.zeros(2), s))
        assert_allclose(result.error[5:], fed.step(e_q).filter_state, atol=1e-15)


def test_without_a_set_or_without_the_filter_there_is_no_level(design):
    bare = TubeLaw(dataclasses.replace(design, tube=None))
    for result in (step(bare, design, np.zeros(5)), step(TubeLaw(design), design, np.zeros(5), np.empty(0))):
        assert (result.status, result.inside) == (TubeStatusCode.NO_SET, False)
        assert math.isnan(result.level)
        assert len(result.tube_centre) == 0


def test_the_set_is_not_that_of_another_notch_filter(design):
    [section] = design.notch
    other = (dataclasses.replace(section, zero_frequency=19.5),)
    assert step(TubeLaw(design, notch=design.notch), design, np.zeros(5)).status is TubeStatusCode.OK
    assert step(TubeLaw(design, notch=other), design, np.zeros(5)).status is TubeStatusCode.NO_SET
    assert step(TubeLaw(design, notch=other * 2), design, np.zeros(5), np.zeros(4)).status is TubeStatusCode.NO_SET


def test_states_of_another_filter_than_that_flown_are_refused(design):
    [section] = design.notch
    for law, sections in ((TubeLaw(design), 1), (TubeLaw(design, notch=(section, section)), 2)):
        due = 2 * sections
        for size in (0, due):  # size 0: no filter in the loop
            assert step(law, design, [0.0] * 5, np.zeros(size)).error.shape == (5 + size,)
        for size in {1, 2, 3, 4, 6} - {due}:
            words = f"filter_state: {size} numbers, expected {due} of the notch filter flown, or none"
            with pytest.raises(SignalError, match=words):
                step(law, design, [0.0] * 5, np.zeros(size))
