"""Quantities in the systems of units of a page."""

import pytest

from hsv.pages.report.text import breakable, decimals, percent, quantity, unit, units_of


def test_degrees_are_for_people_and_radians_strict():
    assert quantity(0.5, "rad", 4) == (
        '<span class="metric paper">28.65&nbsp;deg</span><span class="si">0.5&nbsp;rad</span>'
    )
    assert unit("rad/s") == '<span class="metric paper">deg/s</span><span class="si">rad/s</span>'


def test_what_is_the_same_everywhere_is_there_once():
    assert quantity(3.0, "s") == "3&nbsp;s" and unit("1") == ""


def test_shares_are_in_percent_for_people():
    shown = quantity(0.0345, "1", 3, signed=True, share=True)
    assert shown == '<span class="metric">+3.45&nbsp;%</span><span class="si paper">+0.0345</span>'


def test_scripts_get_factor_and_unit_of_every_system():
    found = units_of("m")
    assert found["metric"] == found["si"] == {"unit": "m", "factor": 1.0}
    assert found["paper"]["factor"] == pytest.approx(1.0 / 0.3048)


def test_decimals_follow_the_unit():
    places = {"metric": 1, "si": 3, "paper": 1}
    assert decimals(None, "rad", places) == "–"
    assert decimals(-0.5, "rad", places) == ('<span class="metric paper">−28.6</span><span class="si">−0.500</span>')


@pytest.mark.parametrize(("share", "text"), [(3.611, "360 %"), (0.5937, "59 %"), (2.9e-10, "2.9e−08 %")])
def test_percent_have_two_digits(share, text):
    assert percent(share) == text


def test_names_break_at_underscores_and_are_escaped():
    assert breakable("a_<b>") == "a_<wbr>&lt;b&gt;"
