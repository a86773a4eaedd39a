"""The page as a browser shows it."""

import pytest
from browser import Browser
from node_processes import short_scenario

from hsv.campaign.executors import SerialExecutor
from hsv.resilience.campaign import plan
from hsv.resilience.page import write_results
from hsv.resilience.run import CaseStore, run_resilience
from hsv.resilience.summary import ResilienceResults

pytestmark = pytest.mark.viewer


@pytest.fixture
def page(tmp_path):
    campaign = plan((str(short_scenario(tmp_path, duration=6, fault=2)),), ("elevator_loss", "fuel_loss"))
    store = CaseStore(tmp_path / "out")
    run_resilience(campaign, store, SerialExecutor())
    return write_results(ResilienceResults.read(campaign, store), tmp_path / "out", "hsv resilience")[0]


@pytest.mark.parametrize("width", [1280, 400])
def test_the_page_is_as_wide_as_the_screen_and_prints_its_numbers(tmp_path, page, width):
    browser = Browser(tmp_path / "profile")
    try:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
        browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.driver.get(page.as_uri())
        assert browser.console() == []
        assert browser.run("return document.documentElement.scrollWidth") <= width
        height = "return document.querySelector('details').getBoundingClientRect().height"
        closed = browser.run(height)
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        assert browser.run(height) > 1.5 * closed
        links = browser.run("return [...document.querySelectorAll('a')].map((a) => a.getAttribute('href'))")
        assert all((page.parent / link).is_file() for link in links if not link.startswith("#"))
    finally:
        browser.driver.quit()
