import re
from functools import cache
from pathlib import Path

import matplotlib
import pytest
from marking import long

from hsv.base.units import to_paper
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures import FIGURES
from hsv_paper.figures.over_time import NOTCH
from hsv_paper.flights import flight_of
from hsv_paper.plots import RC, save

PAGES = Path(__file__).parents[2] / "docs/figures"


@pytest.fixture(scope="module")
def draw():
    """Return a function that draws each figure once."""

    @cache
    def drawn(number):
        with matplotlib.rc_context(RC):
            return FIGURES[number]()

    return drawn


@pytest.mark.parametrize("number", [4, *map(long, FIGURES.keys() - {4})])
def test_a_figure_is_written_as_pdf_and_png_of_bearable_size(number, draw, tmp_path):
    drawing = draw(number)
    pdf, png = save(drawing, tmp_path / "figure")
    assert pdf.read_bytes().startswith(b"%PDF")
    assert pdf.stat().st_size < 600_000
    assert png.read_bytes().startswith(b"\x89PNG")
    for axis in drawing.axes:
        assert axis.get_lines()


@pytest.mark.parametrize("number", FIGURES)
def test_the_page_in_the_docs_shows_the_figure_and_names_its_command_and_flights(number):
    text = (PAGES / f"figure_{number:02}.md").read_text(encoding="utf-8")
    assert f"(figure_{number:02}.png)" in text
    assert f"`hsv-paper figures --only {number} --out docs/figures`" in text
    for name in re.findall("`hsv run (.*?)`", text):
        assert load_scenario(name)


def test_the_docs_hold_a_page_and_a_picture_of_every_figure_and_no_other():
    for ending in ("md", "png"):
        assert {path.stem for path in PAGES.glob(f"figure_*.{ending}")} == {f"figure_{number:02}" for number in FIGURES}


def test_every_sample_of_a_flight_is_drawn(draw):
    flight = flight_of("case1_no_notch")
    whole, closer = draw(13).axes[2:]
    for axis, (start, end) in ((whole, (0.0, 200.0)), (closer, closer.get_xlim())):
        inside = (flight.time >= start) & (flight.time <= end)
        rate = [to_paper(value, "kg^0.5 m/s")[0] for value in flight.history.state[inside, 8]]
        assert axis.get_lines()[0].get_ydata() == pytest.approx(rate)


def test_the_conditions_of_case_1_are_those_flown():
    scenario, bounds = load_scenario(NOTCH[0]), load_vehicle().uncertainty
    assert {name: abs(change) for name, change in scenario.vehicle.perturbation.items()} == pytest.approx(
        {name: 0.5 * bound for name, bound in bounds.items()}
    )
    assert (scenario.vehicle.perturbation["mass"], scenario.vehicle.perturbation["moment_of_inertia"]) == (0.05, -0.05)
