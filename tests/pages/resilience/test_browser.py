"""The page of a resilience campaign in a browser."""

import pytest
from node_processes import short_scenario
from page_checks import PageChecks

from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.resilience.campaign import plan
from hsv.flight.resilience.summary import CaseStore, ResilienceResults
from hsv.pages.resilience import write_results

pytestmark = pytest.mark.viewer


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("resilience")
    campaign = plan((str(short_scenario(folder, duration=6, fault=2)),), ("elevator_loss", "fuel_loss"))
    store = CaseStore(folder / "out", campaign)
    run_campaign(campaign, store, Executor())
    return write_results(ResilienceResults.read(campaign, store), folder / "out", "hsv resilience")[0]


TestPage = PageChecks


@pytest.mark.usefixtures("screen")
def test_it_prints_its_numbers(browser, page):
    browser.open(page)
    height = "return document.querySelector('details').getBoundingClientRect().height"
    closed = browser.run(height)
    browser.media(media="print")
    assert browser.run(height) > 1.5 * closed
    links = browser.run("return [...document.querySelectorAll('a')].map((a) => a.getAttribute('href'))")
    assert all((page.parent / link).is_file() for link in links if not link.startswith("#"))


def test_units_are_switched_and_kept_in_the_address(browser, page):
    head = """
        document.querySelector("details").open = true;
        return document.querySelector("details tbody tr td:nth-child(6)").innerText.split(/\\s/)[1];
    """
    browser.driver.get("about:blank")
    browser.open(page)
    assert browser.run(head) == "m"
    browser.click("[name=units][value=paper]")
    assert browser.run(head) == "ft"
    browser.driver.find_element("css selector", "nav a[href='#cells']").click()
    address = browser.driver.current_url
    assert address.endswith("#cells&units=paper")
    browser.driver.get("about:blank")
    browser.driver.get(address)
    assert browser.run(head) == "ft" and browser.console() == []


def test_a_long_title_wraps_on_a_phone(browser, page, screen):
    screen(390)
    browser.open(page)
    title = "const cell = document.querySelector('.title'); cell.textContent = 'a long title '.repeat(20);"
    assert browser.run(f"{title} return cell.getBoundingClientRect().width") < 390
