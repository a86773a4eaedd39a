import matplotlib
import numpy as np
import pytest

from hsv.errors import ScenarioError
from hsv.simulation.metrics import FlightData
from hsv.simulation.scenario import scenario_names
from hsv.study.figures.bode import notch_response, peak
from hsv.study.figures.catalogue import FIGURES
from hsv.study.figures.figure import Material
from hsv.study.figures.page import page
from hsv.study.figures.style import RC, save
from hsv.study.flights import Flights
from hsv.study.sources import drop_older, flight_digest


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    return Flights(tmp_path_factory.mktemp("flights"), graph=False)


def test_the_catalogue_is_in_the_paper_s_order_and_flies_shipped_scenarios():
    assert list(FIGURES) == sorted(FIGURES)
    for number, figure in FIGURES.items():
        assert figure.number == number
        assert set(figure.scenarios) <= set(scenario_names())


@pytest.mark.parametrize("number", [4, 13])
def test_a_figure_is_written_as_pdf_and_png_with_its_page(number, flights, tmp_path):
    figure = FIGURES[number]
    with matplotlib.rc_context(RC):
        drawing = figure.draw(Material(flights))
        pdf, png = save(drawing.figure, tmp_path / figure.stem)
    assert pdf.read_bytes().startswith(b"%PDF")
    assert png.read_bytes().startswith(b"\x89PNG")
    for axis in drawing.figure.axes:
        assert axis.get_lines()
    text = page(figure, drawing)
    assert f"({figure.stem}.png)" in text
    assert figure.caption in text
    assert all(f"hsv run {name}`" in text for name in figure.scenarios)
    assert "nan" not in text


def test_a_kept_flight_is_read_back_in_every_bit(flights, tmp_path):
    first = flights["case1_second_mode_notch"]
    folder = flights._folder
    [kept] = folder.glob("case1_second_mode_notch_*.npz")
    assert flight_digest("case1_second_mode_notch").startswith(kept.stem.rsplit("_", 1)[1])
    again = Flights(folder, graph=False)["case1_second_mode_notch"]
    for name, value in vars(first).items():
        assert np.array_equal(getattr(again, name), value), name
    assert isinstance(again, FlightData)


def test_a_digest_is_of_the_scenario_flown():
    assert flight_digest("case1") != flight_digest("case1_no_notch")
    with pytest.raises(ScenarioError):
        flight_digest("case9")


def test_only_the_newest_of_a_name_is_kept(tmp_path):
    new, old = "0123456789ab", "ba9876543210"
    for name in (f"case1_{new}", f"case1_{old}", f"case1_no_notch_{old}"):
        (tmp_path / name).mkdir()
        (tmp_path / f"{name}.npz").touch()
    drop_older(tmp_path / f"case1_{new}")
    drop_older(tmp_path / f"case1_{new}.npz")
    kept = {path.name.removesuffix(".npz") for path in tmp_path.iterdir()}
    assert kept == {f"case1_{new}", f"case1_no_notch_{old}"}


def test_the_notch_takes_out_its_centre_and_passes_the_rest(flights):
    [section] = Material(flights).design("baseline").flown.notch
    centre, low, high = np.abs(notch_response([section], np.array([section.zero_frequency, 1e-3, 1e4])))
    assert centre == pytest.approx(section.zero_damping / section.pole_damping)
    assert (low, high) == pytest.approx((1.0, 1.0), abs=1e-3)
    frequencies = np.linspace(1.0, 30.0, 500)
    found = frequencies[peak(frequencies, 1.0 / notch_response([section], frequencies), 2.0, 29.0)]
    assert found == pytest.approx(section.zero_frequency, abs=0.1)
