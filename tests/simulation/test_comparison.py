import re
from pathlib import Path

import pytest

from hsv.simulation.comparison import INTEGRAL, NOMINAL_LAWS, ROBUST_AND_TUBE, table

PAGE = (Path(__file__).parents[2] / "docs" / "comparison.md").read_text(encoding="utf-8")


def numbers(row):
    return [float(cell) for cell in re.findall(r"-?\d+\.?\d*", row.split("|", 2)[2])]


def rows(text):
    return {line.split("|")[1].strip(): numbers(line) for line in text.splitlines() if line.startswith("| case1")}


def test_page_shows_every_flight_of_the_comparison():
    assert list(rows(PAGE)) == [*ROBUST_AND_TUBE, *NOMINAL_LAWS, *INTEGRAL]


def test_robust_mpc_and_tube_fly_as_the_page_says():
    for name, values in rows(table(ROBUST_AND_TUBE)).items():
        # Processors differ in the last digits, and a limited input enlarges that a little.
        assert rows(PAGE)[name] == pytest.approx(values, rel=2e-3, abs=0.02), name


def test_the_quadratic_programme_settles_sooner_than_the_family():
    family, qp = rows(PAGE)["case1"], rows(PAGE)["case1_qp"]
    assert qp[0] <= family[0] and qp[1] < family[1]
