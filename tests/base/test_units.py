import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsv.base.errors import QuantityError
from hsv.base.units import (
    _KNOWN,
    PAPER_UNITS,
    _squared,
    factor,
    in_unit_of,
    parse_quantity,
    percent,
    square_by_pint,
    to_paper,
)
from hsv.cli.output import unit_key
from hsv.flight.metrics import METRICS
from hsv.model.signals import INPUT_UNITS, STATE_UNITS


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("85500 ft", "m", 26060.4),
        ("85.5 kft", "m", 26060.4),
        ("7900 ft/s", "m/s", 2407.92),
        ("0.3 deg", "rad", math.radians(0.3)),
        ("+10 %", "1", 0.1),
        (0.9, "1", 0.9),
        ("1 rpm", "rad/s", math.pi / 30),
        ("1 slug^0.5 ft", "kg^0.5 m", math.sqrt(14.593902937) * 0.3048),
    ],
)
def test_quantities_become_si(text, unit, value):
    assert parse_quantity(text, unit, "field") == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "unit", "problem"),
    [
        (85500, "m", "the unit is missing"),
        ("7900 ft", "m/s", "wrong unit"),
        ("1 furlogn", "m", "unknown unit"),
        ("1 [ft", "m", "cannot be read"),
        ("__import__('os')", "m", "no number"),
        ("nan ft", "m", "no number"),
        ("1e999 ft", "m", "expected a finite quantity"),
        # Angles need a unit, and ratios are not lengths.
        ("12", "rad", "the unit is missing"),
        ("10 %", "m", "wrong unit"),
        ("15 1/s", "rad/s", "wrong unit"),
        ("15 Hz", "rad", "wrong unit"),
        (True, "1", "expected a finite quantity"),
        (None, "m", "expected a finite quantity"),
    ],
)
def test_what_is_not_such_a_quantity_is_refused_by_name(text, unit, problem):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, unit, "some.field")
    message = str(caught.value)
    assert message.startswith(f"some.field = {text!r}: {problem}")
    assert "expected a finite quantity such as" in message
    assert "\n" not in message


def test_cycles_a_second_are_an_angular_frequency_where_one_is_expected():
    assert parse_quantity("15 Hz", "rad/s", "field") == pytest.approx(30.0 * math.pi, rel=1e-15)
    assert parse_quantity("0.5 kHz", "rad/s", "field") == pytest.approx(1000.0 * math.pi, rel=1e-15)
    assert parse_quantity("1 Hz", "s^-1", "field") == 1.0
    assert in_unit_of([math.pi], "rad/s", "15 Hz") == ([0.5], " Hz")


@settings(max_examples=100)
@given(st.integers(0, 10**9))
def test_a_decimal_in_feet_becomes_the_decimal_in_metres(thousandths):
    # 0.3048 is exact, so the value in metres is a short decimal; the result must be the number nearest to it.
    digits = f"{thousandths * 3048:08d}"
    expected = float(f"{digits[:-7]}.{digits[-7:]}")
    assert parse_quantity(f"{thousandths / 1000} ft", "m", "h") == expected


@pytest.mark.parametrize("unit", PAPER_UNITS)
def test_paper_units_come_back(unit):
    value, paper = to_paper(2.5, unit)
    assert value * factor(paper, unit) == pytest.approx(2.5, rel=1e-14)


def test_every_unit_that_is_printed_has_a_spelling_in_json_keys():
    shown = {*STATE_UNITS, *INPUT_UNITS, *(metric.unit for metric in METRICS.values()), *PAPER_UNITS}
    shown |= {PAPER_UNITS.get(unit, unit) for unit in shown}
    keys = {unit_key(unit) for unit in shown}
    assert len(keys) == len(shown) and all(re.fullmatch(r"\w*", key) for key in keys)
    assert {"", "ft_per_s", "sqrt_slug_ft_per_s", "N_m", "psf"} <= keys


@given(st.floats(-0.9, 10.0))
def test_a_share_in_percent_loses_no_digit(share):
    assert parse_quantity(percent(share), "1", "x") == share


@pytest.mark.parametrize(("share", "text"), [(0.05, "5 %"), (-0.1, "-10 %"), (1e-9, "0.0000001 %"), (0.0, "0 %")])
def test_percent_as_people_write_it(share, text):
    assert percent(share) == text


@pytest.mark.parametrize(
    "unit",
    [*_KNOWN, "1/s", "percent/min", "km/h", "deg/s^2", "arcsec s", "kg m^2", "slug^0.5 ft/s^2", "N/kg^0.5", "ft^2"],
)
def test_known_units_are_those_of_the_units_library(unit):
    assert _squared(unit) == square_by_pint(unit)


@pytest.mark.parametrize(
    ("text", "unit"), [("3 ft / s", "m/s"), ("3 ft  /s", "m/s"), ("3 ft/s", "m/s"), ("3 foot/second", "m/s")]
)
def test_spaces_and_long_names_make_no_difference(text, unit):
    assert parse_quantity(text, unit, "field") == 0.9144


def test_a_unit_that_begins_with_a_division_is_that_of_an_error_message():
    assert in_unit_of([0.0, 1.0], "1/s", "2 / s") == ([0.0, 1.0], " / s")
    assert in_unit_of([60.0], "1/s", "2 /min")[0] == [3600.0]
