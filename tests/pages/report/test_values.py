import numpy as np
import pytest

from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import load_scenario
from hsv.pages.report.run import DECLARED
from hsv.pages.report.values import Quantity, Section, Table, parameters, tree


@pytest.fixture(scope="module")
def design():
    return flight_parameters(load_scenario("case1"))


@pytest.mark.parametrize(
    ("name", "size", "columns"),
    [
        ("model.a", "20 matrices 9 × 9", 9),
        ("model.b", "20 matrices 9 × 2", 2),
        ("feedback.gain", "2 × 9", 9),
        ("tube.shape", "7 × 7", 7),
    ],
)
def test_matrices_of_a_design_keep_every_number_in_its_place(design, name, size, columns):
    table = parameters(design, DECLARED)[name]
    assert table.size == size
    np.testing.assert_array_equal(np.ravel(table.rows), design[name])
    assert {len(row) for row in table.rows} == {columns}


def test_weights_have_a_row_for_each_breakpoint(design):
    table = parameters(design, DECLARED)["scheduling.altitude.weights"]
    assert len(table.rows) == len(design["scheduling.altitude.breakpoints"])
    np.testing.assert_allclose(np.sum(table.rows, axis=1), 1.0)


def test_every_parameter_is_shown_and_those_with_a_unit_have_it(design):
    shown = parameters(design, DECLARED)
    assert shown.keys() == design.keys()
    assert shown["initial.altitude"] == Quantity(26060.4, "m")
    assert shown["notch.zero_frequency"] == Quantity(15.0, "rad/s")
    assert shown["notch.enabled"] == "yes"


def test_plain_data_becomes_a_tree():
    shown = tree(
        {"status": "optimal", "margin": None, "M": [[1, 2], [3, 4]], "runs": [{"level": 0.5}], "z": [1.0] * 12}
    )
    assert shown == Section(
        (
            ("status", "optimal"),
            ("margin", "none"),
            ("M", Table(((1.0, 2.0), (3.0, 4.0)), 2)),
            ("runs", Section((("1", Section((("level", Quantity(0.5, "")),))),))),
            ("z", Table(((1.0,) * 9, (1.0,) * 3))),
        )
    )
    assert dict(shown.entries)["M"].size == "2 × 2"
    assert dict(shown.entries)["z"].size == "12 numbers"
