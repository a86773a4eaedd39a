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
from hsv_paper.flights import Flights
from hsv_paper.plots import RC, save

PAGES = Path(__file__).parents[2] / "docs/figures"

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    return Flights(tmp_path_factory.mktemp("flights"))


@pytest.fixture(scope="module")
def draw(flights):
    """Each figure is drawn once; the flights in process are those of the graph, bit for bit."""

    @cache
    def drawn(number):
        with matplotlib.rc_context(RC):
            return FIGURES[number].draw(flights)

    return drawn


@pytest.mark.parametrize("number", [4, *map(long, FIGURES.keys() - {4})])
def test_a_figure_is_written_as_pdf_and_png_of_bearable_size_with_its_page(number, draw, tmp_path):
    figure, drawing = FIGURES[number], draw(number)
    pdf, png = save(drawing.figure, tmp_path / figure.stem)
    assert pdf.read_bytes().startswith(b"%PDF")
    assert pdf.stat().st_size < 600_000
    assert png.read_bytes().startswith(b"\x89PNG")
    for axis in drawing.figure.axes:
        assert axis.get_lines()
    text = figure.page(drawing)
    assert f"({figure.stem}.png)" in text
    assert figure.caption in text
    assert all(f"hsv run {name}`" in text for name in figure.scenarios)
    assert "nan" not in text
    assert "^" not in text.replace("(omega_p/omega_z)^2", "")


@pytest.mark.parametrize("number", FIGURES)
def test_the_page_in_the_docs_says_what_the_drawing_says(number, draw):
    figure = FIGURES[number]
    ours = figure.page(draw(number))
    theirs = (PAGES / f"{figure.stem}.md").read_text(encoding="utf-8")
    assert NUMBER.sub("#", theirs) == NUMBER.sub("#", ours)
    numbers = [[float(number) for number in NUMBER.findall(text)] for text in (theirs, ours)]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.02)  # the last digit of two


def test_the_docs_hold_a_page_and_a_picture_of_every_figure_and_no_other():
    for ending in ("md", "png"):
        assert {path.stem for path in PAGES.glob(f"figure_*.{ending}")} == {figure.stem for figure in FIGURES.values()}


def test_every_sample_of_a_flight_is_drawn(flights, draw):
    flight = flights["case1_no_notch"]
    whole, closer = draw(13).figure.axes[2:]
    for axis, (start, end) in ((whole, (0.0, 200.0)), (closer, closer.get_xlim())):
        inside = (flight.time >= start) & (flight.time <= end)
        rate = [to_paper(value, "kg^0.5 m/s")[0] for value in flight.state[inside, 8]]
        assert axis.get_lines()[0].get_ydata() == pytest.approx(rate)


def test_the_conditions_of_case_1_are_those_flown():
    scenario, bounds = load_scenario(NOTCH[0]), load_vehicle().uncertainty
    assert {name: abs(change) for name, change in scenario.vehicle.perturbation.items()} == pytest.approx(
        {name: 0.5 * bound for name, bound in bounds.items()}
    )
    assert (scenario.vehicle.perturbation["mass"], scenario.vehicle.perturbation["moment_of_inertia"]) == (0.05, -0.05)
