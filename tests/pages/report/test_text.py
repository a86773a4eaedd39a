"""Quantities in a page's systems of units."""

from hsv.pages.text import in_brackets, quantity


def test_degrees_are_for_people_and_radians_strict():
    assert quantity(0.5, "rad", 4) == (
        '<span class="metric paper">28.65&nbsp;deg</span><span class="si">0.5&nbsp;rad</span>'
    )
    assert in_brackets("rad/s") == '<span class="metric paper"> [deg/s]</span><span class="si"> [rad/s]</span>'


def test_shares_are_in_percent_for_people():
    shown = quantity(0.0345, "1", 3, signed=True, share=True)
    assert shown == '<span class="metric paper">+3.45&nbsp;%</span><span class="si">+0.0345</span>'
