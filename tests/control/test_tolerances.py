from pathlib import Path

import numpy as np
from numpy.testing import assert_allclose

from hsv.control.checks import same
from hsv.control.tolerances import TOLERANCES, page

PAGE = Path(__file__).parents[2] / "docs" / "tolerances.md"


def test_the_page_is_that_of_the_table():
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m hsv.control.tolerances > docs/tolerances.md"


def test_a_difference_is_held_to_the_larger_of_two_bounds():
    t = TOLERANCES["model.a"]
    expected, size = np.array([2.0, 0.0, 1e-20]), np.array([1.0, 3.0, 3.0])
    allowed = t.allowed(expected, size)
    assert_allclose(allowed, [2.0 * t.relative, 3.0 * t.absolute, 3.0 * t.absolute])
    assert same("x", expected + 0.99 * allowed, expected, "model.a", size).ok
    for entry in range(3):
        outside = expected.copy()
        outside[entry] += 1.01 * allowed[entry]
        check = same("x", outside, expected, "model.a", size)
        assert not check.ok and check.name == f"x[{entry}]"


def test_what_is_no_number_or_of_another_shape_fails():
    assert not same("x", [1.0, float("nan")], [1.0, 1.0], "copied").ok
    assert not same("x", 1.0, float("nan"), "copied").ok
    assert not same("x", [1.0], [1.0, 1.0], "copied").ok
    assert same("x", [], [], "copied").ok
