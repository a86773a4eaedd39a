"""Static figures: the panels, times and size that one chooses, and the same file for the same flights."""

import re

import pytest
from matplotlib.colors import to_hex

import hsv
from hsv.base.errors import HsvError
from hsv.pages.plots import Layout, save_figure


@pytest.fixture(scope="module")
def flights():
    """Return a flight with a fault and the same one without it."""
    short = {"duration": "6 s", "fault": [{"channel": "elevator_deflection", "type": "lock_in_place", "start": "3 s"}]}
    return {"faulty": hsv.fly(hsv.load("case1", short)), "healthy": hsv.fly(hsv.load("case1", short | {"fault": []}))}


def test_without_a_choice_they_are_the_panels_of_the_paper(flights):
    figure = hsv.plot(flights)
    assert [axis.get_title("left").partition(" [")[0] for axis in figure.axes] == [
        *("altitude", "velocity", "angle of attack", "pitch rate", "elastic rate 1", "elastic rate 2"),
        *("fuel equivalence ratio", "elevator deflection"),
    ]


def test_panels_by_the_beginning_of_their_name_in_the_order_given_within_the_window_and_the_size(flights):
    figure = hsv.plot(flights, panels=["elevator", "pitch_angle"], start="2 s", end="5 s", size="85x60mm")
    first, second = figure.axes
    assert first.get_title("left").startswith("elevator deflection [") and second.get_title("left").startswith(
        "pitch an"
    )
    assert figure.get_size_inches() * 25.4 == pytest.approx((85.0, 60.0))
    assert all(line.get_xdata().min() >= 2.0 and line.get_xdata().max() <= 5.0 for line in first.lines)


def test_curves_that_coincide_are_told_apart_by_their_dashes(flights):
    lines = hsv.plot(flights, panels=["altitude"]).axes[0].lines
    assert len({(to_hex(line.get_color()), str(line._dash_pattern)) for line in lines}) == len(lines) == 3


def test_a_pdf_has_text_and_equal_flights_give_equal_files(flights, tmp_path):
    for name in ("one.pdf", "two.pdf"):
        save_figure(hsv.plot(flights, panels=["altitude"], size="85x60mm"), tmp_path / name)
    written = (tmp_path / "one.pdf").read_bytes()
    assert written == (tmp_path / "two.pdf").read_bytes()
    assert re.search(rb"/Subtype /Type0\b", written) and b"/Subtype /Type3" not in written


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"panels": ["elev", "thrust"]}, r"panels: 'thrust', expected one of altitude, "),
        ({"panels": ["elastic"]}, r"panels: 'elastic', expected one of elastic_coordinate_1, elastic_rate_1, "),
        ({"panels": [""]}, r"panels: '', expected one of altitude, "),
        ({"start": "5 s", "end": "2 s"}, r"from = '5 s': expected less than to = '2 s'"),
        ({"size": "85mm"}, r"size = '85mm': expected width x height from 1 to 40 inches, such as 85x60mm"),
        ({"size": "85x0mm"}, r"size = '85x0mm': expected width x height"),
        ({"size": "1.2.3x60mm"}, r"size = "),
    ],
)
def test_a_wrong_choice_is_named(choice, message):
    with pytest.raises(HsvError, match=message):
        Layout.of(**choice)
