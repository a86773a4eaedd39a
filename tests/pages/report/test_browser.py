"""The report in a browser."""

import base64
import re

import numpy as np
import pytest
from page_checks import PageChecks
from recorded_flight import record_flight

from hsv.base.units import UnitSystem, in_system
from hsv.pages.panels import PANELS, Kind, error_panel
from hsv.pages.report import write_report

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


TestPage = PageChecks


def recorded(bag, curve):
    return curve.value(bag.columns(curve.topic).__getitem__)


def drawn(browser, panel):
    """Return the curves of a panel from the plotting library: name, and x and y at the samples."""
    script = """
        const [name, samples] = arguments;
        const pick = (values) => samples.map((i) => values[Math.min(i, values.length - 1)]);
        return document.getElementById(`plot-${name}`).data.map((d) => ({name: d.name, x: pick(d.x), y: pick(d.y)}));
    """
    return {curve["name"]: curve for curve in browser.run(script, panel.name, SAMPLES.tolist())}


def x_ranges(browser):
    ranges = browser.run("return report.panels.map((p) => p.element._fullLayout.xaxis.range)")
    return {tuple(round(end, 6) for end in each) for each in ranges}


def test_the_page_asks_nothing_of_any_network(browser, page):
    browser.requests()
    browser.open(page)
    assert {address.split(":")[0] for address in browser.requests()} <= {"file", "data", "blob"}


@pytest.mark.parametrize("units", list(UnitSystem))
def test_plots_hold_what_the_bags_hold(opened, flights, units):
    opened.click(f"[name=units][value={units}]")
    for panel in (*PANELS, *map(error_panel, range(7))):
        factor = in_system(1.0, panel.unit, units)[0]
        curves = drawn(opened, panel)
        for bag, label in zip(flights, ("case1 (quiet)", "case1 (loud)"), strict=True):
            # A constant bound is drawn by its two ends, so it has no samples to compare.
            for curve in (curve for curve in panel.curves if curve.kind is not Kind.bound):
                seen = curves.get(f"{label}, {curve.label}") or curves[curve.label]
                expected = recorded(bag, curve)[SAMPLES] * factor
                np.testing.assert_allclose(seen["y"], expected, rtol=2e-7, atol=1e-12 * factor)
                np.testing.assert_allclose(seen["x"], SAMPLES * 0.02, rtol=1e-6)


def test_zooming_one_plot_zooms_all(opened):
    assert x_ranges(opened) == {(0.0, 20.0)}
    opened.run("Plotly.relayout('plot-altitude', {'xaxis.range[0]': 7.5, 'xaxis.range[1]': 9})")
    opened.settle()
    assert x_ranges(opened) == {(7.5, 9.0)}
    assert opened.run(
        "return [document.querySelector('[name=from]').value, document.querySelector('[name=to]').value]"
    ) == ["7.5", "9"]
    opened.click("[name=all]")
    assert x_ranges(opened) == {(0.0, 20.0)}


def state(browser):
    """Return the state of the page: units, time window, curves of the altitude, and runs of the picture."""
    return browser.run(
        """
        const inSight = (path) => getComputedStyle(path).display !== "none";
        return {
          units: document.documentElement.dataset.units,
          time: report.time,
          curves: document.getElementById("plot-altitude").data.map((curve) => curve.name).sort(),
          picture: [...document.querySelectorAll(".picture [data-run]")].filter(inSight).length,
          place: scrollY,
        };
        """
    )


def test_the_address_says_what_is_shown_and_shows_it(opened, page):
    plain = state(opened)
    assert "#" not in opened.driver.current_url
    opened.click("[name=units][value=paper]")
    opened.click("[name=run][value='1']")
    opened.click("[name=kind][value=nominal]")
    opened.click("[name=limits]")
    opened.run("Plotly.relayout('plot-altitude', {'xaxis.range[0]': 7.5, 'xaxis.range[1]': 9})")
    opened.settle()
    opened.driver.find_element("css selector", "nav a[href='#inputs']").click()
    opened.settle()
    address, shown = opened.driver.current_url, state(opened)
    assert shown["time"] == [7.5, 9] and shown["units"] == "paper"
    assert 0 < shown["picture"] < plain["picture"] and len(shown["curves"]) < len(plain["curves"])
    assert address.partition("#")[2].startswith("inputs&")
    opened.driver.get("about:blank")
    opened.driver.get(address)
    opened.settle()
    found = state(opened)
    assert found.pop("place") > 500
    assert found == {key: value for key, value in shown.items() if key != "place"}
    assert opened.console() == []
    opened.click("[name=all]")
    assert "from=" not in opened.driver.current_url


def test_the_keyboard_reaches_everything(opened):
    reached = """
        const all = "a[href], button, input, select, summary, [tabindex]";
        const shown = [...document.querySelectorAll(all)].filter((each) => each.getClientRects().length);
        return shown.filter((each) => each.tabIndex < 0 || each.matches("a:not([href])")).map((each) => each.outerHTML);
    """
    assert opened.run(reached) == []
    scrolling = "return [...document.querySelectorAll('.scroll, pre')].every((each) => each.tabIndex === 0)"
    assert opened.run(scrolling)
    button = opened.driver.find_element("css selector", "[name=units]:checked")
    button.send_keys("\ue014")  # right-arrow key
    opened.settle()
    assert opened.run("return document.documentElement.dataset.units") == "si"


def test_the_first_picture_needs_no_script(browser, page):
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        browser.driver.get("about:blank")
        browser.driver.get(page.as_uri())
        document = browser.driver.execute_cdp_cmd("DOM.getDocument", {"depth": 0})["root"]["nodeId"]
        path = {"nodeId": document, "selector": ".picture .run0"}
        node = browser.driver.execute_cdp_cmd("DOM.querySelector", path)["nodeId"]
        assert browser.driver.execute_cdp_cmd("DOM.getBoxModel", {"nodeId": node})["model"]["width"] > 500
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


def test_the_printed_page_has_at_most_eight_sheets_and_leaves_out_the_certificate(browser, quiet, tmp_path):
    page = tmp_path / "report.html"
    write_report([quiet], page)
    browser.open(page)
    printed = browser.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"]
    assert 1 < len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed))) <= 8
    browser.media(media="print")
    assert browser.run("return getComputedStyle(document.getElementById('certificate')).display") == "none"
    browser.media(media="")


def test_faults_limits_and_excursions_are_shaded(opened):
    def shades(name):
        shapes = opened.run("return document.getElementById(`plot-${arguments[0]}`).layout.shapes", name)
        return {(shape["fillcolor"], shape["x0"]) for shape in shapes if shape["type"] == "rect"}

    fault = next(iter(shades("altitude")))
    assert fault[1] == 8.0
    assert fault in shades("fuel_equivalence_ratio") and len(shades("fuel_equivalence_ratio")) > 1
    assert shades("elevator_deflection") == {fault}
    assert len(shades("level")) > 1 and len(shades("error_1")) > 1


@pytest.mark.parametrize("scenarios", [["case1"], ["case1", "case1_no_notch", "case1_derived"]], ids=len)
def test_whole_flights_make_a_small_page(browser, bags, screen, tmp_path, pictures, capsys, scenarios):
    flown = [record_flight(bags / f"{len(scenarios)}_{name}", name, 200.0, 100.0) for name in scenarios]
    page = tmp_path / "whole.html"
    screen(1280)
    write_report(flown, page)
    seconds = browser.open(page)
    painted = browser.run("return performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000")
    size = page.stat().st_size / MEGABYTE
    with capsys.disabled():
        print(f"\n{len(flown)} flights: {size:.2f} MB, first picture {painted:.2f} s, all drawn {seconds:.2f} s")
    assert browser.console() == [] and size < 5.0
    if len(flown) == 3:
        browser.picture(pictures / "report.png")
