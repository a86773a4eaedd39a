"""The live page in a browser: a flight over DDS, a fault injected by the page's button, and the report."""

import time

import pytest
from live_clients import addresses
from node_processes import Processes, recorded_steps, short_scenario
from page_checks import PageChecks
from ros_domain import own_environment
from waiting import wait_until

from hsv.bags.reader import Bag

pytestmark = pytest.mark.viewer


@pytest.fixture
def processes(tmp_path):
    with own_environment() as environment:
        started = Processes(environment, tmp_path)
        yield started
        started.stop()


def fly(processes, *words):
    """Start a live flight; return its process, the address of its page and the port for Foxglove."""
    log = processes.folder / "live.txt"
    with log.open("w") as output:
        flight = processes.start("hsv", "run", *words, "--live", "--live-port", "0", output=output)
    wait_until(lambda: "live data" in log.read_text() or flight.poll() is not None, [flight.pid])
    return flight, *addresses(log.read_text())


def until(browser, flight, condition):
    """Wait until a condition of the page, in JavaScript, is true."""
    wait_until(lambda: browser.run(f"return Boolean({condition})"), [flight.pid])


def test_a_fault_is_injected_by_its_button_and_the_report_has_it(browser, processes, screen, tmp_path, pictures):
    bag = tmp_path / "bag"
    flight, page, _ = fly(processes, short_scenario(tmp_path, 120, fault=115), "--bag", bag)
    driver = browser.driver
    screen(1280)
    browser.console()
    browser.requests()
    driver.get(page)
    until(browser, flight, "window.live && live.now > 4")
    # The space key pauses the flight and resumes it.
    browser.press(" ")
    until(browser, flight, "live.status.settings.paused")
    until(browser, flight, "live.form.pause.textContent === 'Resume'")
    stood = browser.run("return live.now")
    steps = recorded_steps(bag)
    time.sleep(0.5)
    assert browser.run("return live.now") - stood < 0.1 and recorded_steps(bag) - steps <= 50
    browser.press(" ")
    until(browser, flight, "!live.status.settings.paused")
    driver.find_element("css selector", "[name=parameters]").send_keys("80 %")
    browser.click("[name=inject]")
    # The page may show the active fault before the answer has arrived.
    until(browser, flight, "live.status.faults.length === 1 && document.getElementById('answer').className")
    answer = browser.run("return document.getElementById('answer').textContent")
    assert answer.startswith("loss of effectiveness 0.8 of elevator deflection from step ")
    step = int(answer.partition("from step ")[2].split()[0])
    until(browser, flight, f"live.now > {step * 0.02 + 6.0}")
    browser.run("scrollTo({ top: 0, behavior: 'instant' })")
    browser.picture(pictures / "live.png")
    shade = browser.run("return document.getElementById('plot-altitude').layout.shapes[0]")
    assert shade["x0"] == pytest.approx(step * 0.02) and shade["x1"] > shade["x0"]
    limits = "document.getElementById('plot-elevator_deflection')"
    browser.run(f"{limits}.scrollIntoView()")
    until(browser, flight, f"{limits}.layout && {limits}.layout.shapes.filter((s) => s.type === 'line').length === 2")
    pace = driver.find_element("css selector", "[name=pace]")
    # Scroll it to the middle of the window; at the edge another element may cover it.
    browser.run("document.querySelector('[name=pace]').scrollIntoView({ block: 'center', behavior: 'instant' })")
    wait_until(pace.is_displayed, [flight.pid])
    pace.clear()
    pace.send_keys("0\n")
    until(browser, flight, "live.status.ending")
    state = browser.run("return document.getElementById('state').textContent")
    assert state == f"Flight finished at t = 120.00 s · verdict, metrics and report: {bag}/report.html"
    wait_until(lambda: flight.poll() is not None, [flight.pid])
    # The server has ended; the curves stay.
    until(browser, flight, "live.over")
    assert browser.run("return live.now") == pytest.approx(120.0)
    assert browser.run("return document.querySelector('fieldset.flight').disabled")
    assert browser.console() == []
    assert {address.split("/")[2] for address in browser.requests() if ":" in address} <= {page.split("/")[2]}
    active = [message.step for _, message in Bag(bag).decode("/hsv/actuator") if message.active]
    assert active[0] == step
    report = bag / "report.html"
    browser.open(report)
    driver.get(f"{report.as_uri()}#events")
    events = browser.run("return document.getElementById('events').textContent")
    assert "effectiveness 0.8" in events
    browser.picture(pictures / "live_report.png")


@pytest.fixture(scope="module")
def endless(tmp_path_factory):
    """Start a flight that outlasts the tests on it; return its process and the address of its page."""
    folder = tmp_path_factory.mktemp("endless")
    with own_environment() as environment:
        started = Processes(environment, folder)
        flight, page, _ = fly(started, short_scenario(folder, 3600, fault=2), "--bag", folder / "bag", "--no-report")
        yield flight, page
        started.stop()


def look(browser, flight, page):
    """Open the live page at an address; wait until a fault acts and everything is drawn."""
    # A browser does not reload a page of which only the token changes.
    browser.driver.get("about:blank")
    browser.driver.get(page)
    until(browser, flight, "window.live && live.now > 3 && live.status && live.status.faults.length")


@pytest.fixture
def show(browser, endless):
    return lambda: look(browser, *endless)


TestPage = PageChecks


def test_on_a_phone_controls_are_below_the_flight_and_inject_is_apart_from_pause(browser, endless, screen):
    screen(390)
    look(browser, *endless)
    edges = "return arguments[0].map((each) => document.querySelector(each).getBoundingClientRect())"
    flight, pause, inject = browser.run(edges, [".side-view", "[name=pause]", "[name=inject]"])
    assert flight["bottom"] < pause["top"] and pause["bottom"] + 2 * pause["height"] < inject["top"]


@pytest.mark.parametrize("button", ["pause", "set_pace", "set_tau", "inject", "clear"])
def test_with_another_token_every_button_is_answered_with_a_reason(browser, endless, button):
    flight, page = endless
    look(browser, flight, f"{page}x")
    browser.driver.find_element("css selector", "[name=parameters]").send_keys("80 %")
    browser.click(f"[name={button}]")
    assert_refused(browser, flight)


def assert_refused(browser, flight):
    """Assert that the page shows a refusal and that the flight goes on unchanged."""
    until(browser, flight, "document.getElementById('answer').className === 'bad'")
    assert browser.run("return document.getElementById('answer').textContent").startswith("token: wrong or missing")
    before = browser.run("return live.now")
    until(browser, flight, f"live.now > {before + 0.5}")
    status = browser.run("return live.status")
    assert not status["settings"]["paused"] and status["settings"]["real_time_factor"] == 1
    assert [fault["channel"] for fault in status["faults"]] == ["elevator_deflection"]
