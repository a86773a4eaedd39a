"""The page as a browser shows it."""

import base64

import numpy as np
import pytest
from recorded_flight import record_flight

from hsv.recording.report.page import write_report
from hsv.recording.report.panels import PANELS, error_panel
from hsv.units import to_paper

pytestmark = pytest.mark.viewer

MEGABYTE = 1e6
SAMPLES = np.linspace(0, 1000, 41).astype(int)


@pytest.fixture(scope="module")
def flights(quiet, loud):
    return [quiet, loud]


@pytest.fixture(scope="module")
def page(flights, tmp_path_factory):
    page = tmp_path_factory.mktemp("page") / "report.html"
    write_report(flights, page)
    return page


@pytest.fixture
def opened(browser, page):
    browser.open(page)
    return browser


def recorded(bag, curve):
    columns = bag.columns(curve.topic)
    parts = [columns[name] if curve.column is None else columns[name][:, curve.column] for name in curve.fields]
    return np.sum(parts, axis=0)


def drawn(browser, panel):
    """Return the curves of a panel as the plotting library holds them: name, x and y at the samples."""
    script = """
        const [name, samples] = arguments;
        const pick = (values) => samples.map((i) => values[Math.min(i, values.length - 1)]);
        return document.getElementById(`plot-${name}`).data.map((d) => ({name: d.name, x: pick(d.x), y: pick(d.y)}));
    """
    return {curve["name"]: curve for curve in browser.run(script, panel.name, SAMPLES.tolist())}


def x_ranges(browser):
    ranges = browser.run("return report.panels.map((p) => p.element._fullLayout.xaxis.range)")
    return {tuple(round(end, 6) for end in each) for each in ranges}


def test_the_page_opens_quietly_and_asks_nothing_of_any_network(browser, page):
    browser.requests()
    browser.open(page)
    assert browser.console() == []
    assert {address.split(":")[0] for address in browser.requests()} <= {"file", "data", "blob"}
    assert browser.run("return document.getElementById('trouble').hidden")


@pytest.mark.parametrize("units", ["si", "paper"])
def test_plots_hold_what_the_bags_hold(opened, flights, units):
    opened.click(f"[name=units][value={units}]")
    for panel in (*PANELS, *map(error_panel, range(7))):
        factor = to_paper(1.0, panel.unit)[0] if units == "paper" else 1.0
        curves = drawn(opened, panel)
        for bag, label in zip(flights, ("case1 (quiet)", "case1 (loud)"), strict=True):
            for curve in panel.curves:
                seen = curves.get(f"{label}, {curve.label}") or curves[curve.label]
                expected = recorded(bag, curve)[SAMPLES] * factor
                np.testing.assert_allclose(seen["y"], expected, rtol=2e-7, atol=1e-12 * factor)
                np.testing.assert_allclose(seen["x"], SAMPLES * 0.02, rtol=1e-6)


def test_the_tube_is_drawn_around_the_error(opened, flights):
    status = flights[1].columns("/hsv/tube_status")
    curves = drawn(opened, error_panel(2))
    for sign, label in ((1.0, "c + z"), (-1.0, "c − z")):
        edge = status["tube_centre"][0, 2] + sign * status["tube_half_width"][0, 2]
        np.testing.assert_allclose(curves[f"case1 (loud), {label}"]["y"], edge, rtol=1e-6)


def test_units_change_titles_and_tables_too(opened):
    def visible(css_class):
        return opened.run(
            "return [...document.querySelectorAll(arguments[0])].filter((e) => e.getClientRects().length).length",
            f"figcaption .{css_class}, #metrics .{css_class}",
        )

    assert visible("si") and not visible("paper")
    opened.click("[name=units][value=paper]")
    assert visible("paper") and not visible("si")


def test_runs_and_kinds_of_curves_are_switched(opened):
    altitude = PANELS[0]
    every = set(drawn(opened, altitude))
    opened.click("[name=run][value='1']")
    one = set(drawn(opened, altitude))
    assert one == {name for name in every if "loud" not in name} and one < every
    opened.click("[name=kind][value=nominal]")
    assert set(drawn(opened, altitude)) == {name for name in one if "nominal" not in name}


def test_zooming_one_plot_zooms_all(opened):
    assert x_ranges(opened) == {(0.0, 20.0)}
    opened.run("Plotly.relayout('plot-altitude', {'xaxis.range[0]': 7.5, 'xaxis.range[1]': 9})")
    opened.settle()
    assert x_ranges(opened) == {(7.5, 9.0)}
    assert opened.run(
        "return [document.querySelector('[name=from]').value, document.querySelector('[name=to]').value]"
    ) == [
        "7.5",
        "9",
    ]
    opened.click("[name=all]")
    assert x_ranges(opened) == {(0.0, 20.0)}


def test_the_time_window_can_be_typed(opened):
    opened.driver.find_element("css selector", "[name=from]").send_keys("8\t")
    opened.settle()
    assert x_ranges(opened) == {(8.0, 20.0)}


def test_faults_limits_and_excursions_are_shaded(opened):
    def shades(name):
        shapes = opened.run("return document.getElementById(`plot-${arguments[0]}`).layout.shapes", name)
        return {(shape["fillcolor"], shape["x0"]) for shape in shapes if shape["type"] == "rect"}

    fault = next(iter(shades("altitude")))
    assert fault[1] == 8.0
    assert fault in shades("fuel_equivalence_ratio") and len(shades("fuel_equivalence_ratio")) > 1
    assert shades("elevator_deflection") == {fault}
    assert len(shades("level")) > 1 and len(shades("error_1")) > 1


def luminance(colour):
    channels = [float(part) / 255 for part in colour.removeprefix("rgb(").removesuffix(")").split(",")]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return float(np.dot(linear, (0.2126, 0.7152, 0.0722)))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_in_both_themes(opened, scheme):
    opened.media(features=[{"name": "prefers-color-scheme", "value": scheme}])
    paper = luminance(opened.run("return getComputedStyle(document.body).backgroundColor"))
    assert (paper > 0.5) == (scheme == "light")
    for selector, prop in (
        ("h1", "color"),
        ("small", "color"),
        (".bad", "color"),
        ("a", "color"),
        (".xtick text", "fill"),
    ):
        script = "return getComputedStyle(document.querySelector(arguments[0]))[arguments[1]]"
        ink = luminance(opened.run(script, selector, prop))
        contrast = (max(ink, paper) + 0.05) / (min(ink, paper) + 0.05)
        assert contrast >= 4.5, f"{selector}: {contrast:.2f}"
    opened.media(features=[])


def test_on_paper_it_is_light_without_controls_and_plots_fit(opened):
    opened.media(media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    assert luminance(opened.run("return getComputedStyle(document.body).backgroundColor")) > 0.9
    assert opened.run("return getComputedStyle(document.getElementById('toolbar')).display") == "none"
    widths = opened.run(
        "return report.panels.map((p) => [p.element.clientWidth, p.element.querySelector('svg').clientWidth])"
    )
    assert all(0 < plot <= place for place, plot in widths)
    opened.media(media="", features=[])
    printed = opened.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    assert base64.b64decode(printed["data"]).startswith(b"%PDF")


@pytest.mark.parametrize("scenarios", [["case1"], ["case1", "case1_no_notch", "case1_derived"]], ids=len)
def test_whole_flights_make_a_small_page_and_its_time_is_told(
    browser, bags, tmp_path, record_property, capsys, scenarios
):
    flown = [record_flight(bags / f"{len(scenarios)}_{name}", name, 200.0, 100.0) for name in scenarios]
    page = tmp_path / "whole.html"
    write_report(flown, page)
    size = page.stat().st_size / MEGABYTE
    # The best of three: what else the machine does is not the page's doing.
    seconds = min(browser.open(page) for _ in range(3))
    record_property("page_megabytes", size)
    record_property("page_open_seconds", seconds)
    with capsys.disabled():
        print(f"\nreport of {len(flown)} flights: {size:.2f} MB, all plots drawn after {seconds:.2f} s")
    assert browser.console() == []
    assert size < 8.0
