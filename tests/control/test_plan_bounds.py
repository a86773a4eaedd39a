import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign, find_design, read_design, read_parameters

VALUES = read_parameters(find_design("baseline"))


def test_both_bounds_hold_for_a_plan():
    bounds = read_design(find_design("baseline")).plan_bounds
    assert_allclose(bounds.lower, bounds.region_minimum[:2])
    assert_allclose(bounds.upper, bounds.region_maximum[:2])
    assert (bounds.lower > bounds.input_minimum).all() and (bounds.upper < bounds.input_maximum).all()
    low, high = bounds.pitch_acceleration
    assert low < 0.0 < high


@pytest.mark.parametrize("name", ["nominal.input_minimum", "nominal.region_maximum"])
def test_a_bound_that_is_missing_or_too_short_is_named(name):
    for value in ([], VALUES[name][:-1]):
        with pytest.raises(DesignError, match=rf"parameter {name}: {len(value)} values, expected"):
            ControlDesign.from_parameters({**VALUES, name: value})


def test_bounds_in_the_wrong_order_are_named():
    with pytest.raises(DesignError, match=r"parameter nominal.input_minimum: expected values below nominal.input_max"):
        ControlDesign.from_parameters({**VALUES, "nominal.input_minimum": VALUES["nominal.input_maximum"]})


def test_a_design_without_a_tube_carries_none():
    names = ("nominal.input_m", "nominal.region", "tube.")
    without = {n: v for n, v in VALUES.items() if not n.startswith(names)}
    assert ControlDesign.from_parameters(without).plan_bounds is None
