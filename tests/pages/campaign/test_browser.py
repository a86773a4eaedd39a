"""The page of a campaign in a browser."""

import pytest
from page_checks import PageChecks

from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results, within_all
from hsv.pages.campaign import write_campaign_page

pytestmark = pytest.mark.viewer


@pytest.fixture(scope="module")
def page(results, tmp_path_factory):
    page = tmp_path_factory.mktemp("page") / "campaign.html"
    write_campaign_page(results, page)
    return page


TestPage = PageChecks


def ends(browser, name, axis):
    return browser.run("return document.getElementById(arguments[0])._fullLayout[arguments[1]].range", name, axis)


def test_units_are_switched_in_text_and_plots(opened, results):
    seconds = ends(opened, "plot-scatter_fault[0].start", "xaxis")
    for name in ("plot-envelope_altitude_error", "plot-histogram_altitude_end_error"):
        axis = "yaxis" if "envelope" in name else "xaxis"
        metres = ends(opened, name, axis)
        opened.click("[name=units][value=paper]")
        assert ends(opened, name, axis) == pytest.approx([end / 0.3048 for end in metres], rel=1e-6)
        opened.click("[name=units][value=metric]")
    assert ends(opened, "plot-scatter_fault[0].start", "xaxis") == seconds
    mass = "return document.getElementById('plot-scatter_mass').data[0].x[0]"
    percent = opened.run(mass)
    opened.click("[name=units][value=si]")
    assert percent == pytest.approx(100.0 * results.column("sample_mass")[0], rel=1e-5)
    assert opened.run(mass) == pytest.approx(percent / 100.0)


def test_the_address_says_what_is_shown_and_shows_it(opened):
    what = """
        const envelope = document.getElementById("plot-envelope_altitude_error");
        const hidden = document.querySelectorAll(".picture [data-run][hidden]");
        return [document.documentElement.dataset.units, envelope.data.length, envelope._fullLayout.xaxis.range,
          document.getElementById("plot-scatter_mass")._fullLayout.yaxis.title.text, hidden.length];
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
    assert shown[3] == "velocity end error [ft/s]" and shown[4] > 0
    opened.driver.get("about:blank")
    opened.driver.get(address)
    opened.settle()
    assert opened.run(what) == shown and opened.console() == []


def test_what_a_campaign_of_whole_flights_opens_with(browser, screen, tmp_path, pictures):
    campaign = plan("case1", samples=100, seed=1)
    out = tmp_path / "case1.parquet"
    run_campaign(campaign, ResultStore(out, campaign), Executor())
    results, page = Results(out), tmp_path / "case1.html"
    write_campaign_page(results, page)
    screen(1280)
    browser.open(page)
    assert browser.run("return document.querySelector('.lead').innerText").startswith(f"{within_all(results)} of 100 ")
    first = "return document.querySelector('.opening:has(.bound) figcaption').innerText"
    assert browser.run(first).startswith("The limit that most flights break: altitude end error")
    browser.picture(pictures / "montecarlo.png")
