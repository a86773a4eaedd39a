"""The page of a campaign as a browser shows it."""

import pytest

from hsv.campaign.page import write_page

pytestmark = pytest.mark.viewer


@pytest.fixture(scope="module")
def page(results, tmp_path_factory):
    page = tmp_path_factory.mktemp("page") / "campaign.html"
    write_page(results, page)
    return page


@pytest.fixture
def opened(browser, page):
    browser.driver.get("about:blank")
    browser.open(page)
    return browser


def ends(browser, name, axis):
    return browser.run("return document.getElementById(arguments[0])._fullLayout[arguments[1]].range", name, axis)


def test_it_opens_quietly_with_every_plot(opened):
    assert opened.console() == []
    drawn = "return [...document.querySelectorAll('.plot')].every((plot) => plot.querySelector('.main-svg'))"
    assert opened.run(drawn)


def test_units_are_switched_in_text_and_plots(opened, results):
    seconds = ends(opened, "scatter-fault[0].start", "xaxis")
    for name in ("plot-envelope_altitude_error", "histogram-altitude_end_error"):
        axis = "yaxis" if name.startswith("plot") else "xaxis"
        metres = ends(opened, name, axis)
        opened.click("[name=units][value=paper]")
        assert ends(opened, name, axis) == pytest.approx([end / 0.3048 for end in metres], rel=1e-6)
        opened.click("[name=units][value=metric]")
    assert ends(opened, "scatter-fault[0].start", "xaxis") == seconds
    mass = "return document.getElementById('scatter-mass').data[0].x[0]"
    percent = opened.run(mass)
    opened.click("[name=units][value=si]")
    assert percent == pytest.approx(100.0 * results.column("sample_mass")[0], rel=1e-5)
    assert opened.run(mass) == pytest.approx(percent / 100.0)


def test_the_address_says_what_is_shown_and_shows_it(opened):
    what = """
        const envelope = document.getElementById("plot-envelope_altitude_error");
        const hidden = document.querySelectorAll(".picture [data-run][hidden]");
        return [document.documentElement.dataset.units, envelope.data.length, envelope._fullLayout.xaxis.range,
          document.getElementById("scatter-mass")._fullLayout.yaxis.title.text, hidden.length];
    """
    plain = opened.run(what)
    opened.click("[name=units][value=paper]")
    opened.click("[name=kind][value=mean]")
    opened.click("[name=run][value='1']")
    opened.run(
        "const metric = document.querySelector('[name=metric]'); metric.value = 'velocity_end_error';"
        "metric.dispatchEvent(new Event('change', {bubbles: true}));"
        "Plotly.relayout('plot-envelope_altitude_error', {'xaxis.range[0]': 1, 'xaxis.range[1]': 2})"
    )
    opened.settle()
    shown, address = opened.run(what), opened.driver.current_url
    assert shown[0] == "paper" and shown[1] == plain[1] - 2 and shown[2] == [1, 2]
    assert shown[3] == "velocity error at the end [ft/s]" and shown[4] > 0
    opened.driver.get("about:blank")
    opened.driver.get(address)
    opened.settle()
    assert opened.run(what) == shown and opened.console() == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_there_are_no_barriers(opened, screen, scheme):
    screen(1280, scheme)
    assert opened.barriers() == []


@pytest.mark.parametrize("width", [1280, 400])
def test_nothing_is_wider_than_the_screen(browser, page, screen, width):
    screen(width)
    browser.open(page)
    assert browser.run("return document.documentElement.scrollWidth") <= width
    beyond = "return [...document.querySelectorAll('.scroll')].some((each) => each.scrollWidth > each.clientWidth)"
    assert width < 1280 or not browser.run(beyond)


def test_in_print_plots_fit_and_controls_go(opened):
    opened.media(media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    assert opened.run("return getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert opened.run("return getComputedStyle(document.getElementById('toolbar')).display") == "none"
    fits = """
        const plots = [...document.querySelectorAll(".plot")];
        return plots.every((plot) => plot.clientWidth > 0 && plot.querySelector("svg").clientWidth <= plot.clientWidth);
    """
    assert opened.run(fits)
    opened.media(media="", features=[])
