"""Quantities in the systems of units of a page."""

import pytest

from hsv.pages.text import in_brackets, quantity, units_of


def test_degrees_are_for_people_and_radians_strict():
    assert quantity(0.5, "rad", 4) == (
        '<span class="metric paper">28.65&nbsp;deg</span><span class="si">0.5&nbsp;rad</span>'
    )
    assert in_brackets("rad/s") == '<span class="metric paper"> [deg/s]</span><span class="si"> [rad/s]</span>'


def test_what_is_the_same_everywhere_is_there_once():
    assert quantity(3.0, "s") == "3&nbsp;s" and in_brackets("1") == "" and quantity(None, "s") == "–"


def test_shares_are_in_percent_for_people():
    shown = quantity(0.0345, "1", 3, signed=True, share=True)
    assert shown == '<span class="metric">+3.45&nbsp;%</span><span class="si paper">+0.0345</span>'


def test_scripts_get_factor_and_unit_of_every_system():
    found = units_of("m")
    assert found["metric"] == found["si"] == {"unit": "m", "factor": 1.0}
    assert found["paper"]["factor"] == pytest.approx(1.0 / 0.3048)
