from pathlib import Path

import numpy as np
from numpy.testing import assert_allclose

from hsv.control.checks import same
from hsv.control.tolerances import PARAMETERS, TOLERANCES

PAGE = Path(__file__).parents[2] / "docs" / "tolerances.md"


def test_the_page_has_the_numbers_of_the_table():
    rows = [line.split("|") for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")][2:]
    written = {row[1].partition(":")[0].strip(): (float(row[2]), float(row[3])) for row in rows}
    assert written == {name: tuple(tolerance) for name, tolerance in TOLERANCES.items()}
    kinds = [row[1].strip().partition(": ") for row in rows]
    named = {name.strip("`"): kind for kind, _, names in kinds for name in names.split(", ") if name}
    assert named == PARAMETERS


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
