from functools import partial

import pytest

from hsv.control.design import find_design, read_design
from hsv.design.inputs import find_inputs, read_inputs
from hsv_paper.adjustable_factor import FINE, growth, is_certified
from hsv_paper.linear_loop import stability_limit


@pytest.fixture(scope="module")
def design():
    return read_design(find_design("adjustable"))


@pytest.mark.parametrize("coupling", ["paper_like", "derived"])
def test_the_loop_is_lost_between_a_half_and_four_tenths(design, coupling):
    # Control study, section 7.
    at = partial(growth, design, coupling, [{}])
    assert all(at(tau) < 0.0 for tau in (1.0, 0.75, 0.5)) and all(at(tau) > 0.0 for tau in (0.4, 0.3))
    limit = stability_limit(at, FINE[::-1].tolist())
    assert 0.4 < limit < 0.5
    assert at(limit + 1e-3) < 0.0 < at(limit - 1e-3)


def test_what_is_certified_ends_before_the_loop_is_lost(design):
    inputs = read_inputs(find_inputs("adjustable"))
    assert [is_certified(design, inputs, tau) for tau in (0.8, 0.5, 0.4)] == [True, True, False]
