"""The side view of the report in a browser: the recorded state, with the vehicle's shape and signs."""

import math

import numpy as np
import pytest

from hsv.pages.airframe.geometry import airframe
from hsv.pages.report import write_report
from hsv.pages.side_view import geometry

pytestmark = pytest.mark.viewer

FAULT = 8.0
ELASTIC = ("elastic_coordinate_1", "elastic_coordinate_2")


@pytest.fixture(scope="module")
def page(quiet, tmp_path_factory):
    page = tmp_path_factory.mktemp("page") / "report.html"
    write_report([quiet], page)
    return page


@pytest.fixture
def opened(browser, page):
    browser.open(page)
    browser.run("document.getElementById('vehicle').scrollIntoView()")
    browser.wait("return Boolean(own.vehicle?.views[0])")
    return browser


def shown(browser, at, exaggeration=40):
    """Show a time; return the drawn figures, with paths as numbers (pixels)."""
    script = """
        const [time, exaggeration] = arguments, slider = document.querySelector("[name=exaggeration]");
        slider.value = exaggeration;
        slider.dispatchEvent(new Event("input"));
        own.show(time);
        const numbers = (path) => ((path.getAttribute("d") || "").match(/-?[\\d.]+/g) || []).map(Number);
        return [...document.querySelectorAll("#vehicle figure")].map((figure) => ({
          paths: [...figure.querySelectorAll(".vehicle path, .flame")].map(numbers),
          ghost: [...figure.querySelectorAll(".ghost path")].map(numbers),
          readout: [...figure.querySelectorAll(".readout dd")].map((entry) => entry.textContent),
          text: figure.querySelector("svg").textContent,
        }));
    """
    return browser.run(script, at, exaggeration)


def body_of(figure, drawn="paths"):
    """Return the outline of the body, its longest path, in metres from the centre of gravity: x forward, z up."""
    points = np.array(max(figure[drawn], key=len)).reshape(-1, 2)
    scale = 0.72 * 640 / airframe().length
    return (points - [301, 165]) * [1.0, -1.0] / scale


def expected_body(eta, pitch, exaggeration):
    x, z, mode, shape, slope = np.array(geometry()["body"]).T
    bend = exaggeration * np.where(mode == 0, eta[0], eta[1])
    bent = np.stack([x - z * slope * bend, z + shape * bend], axis=1)
    cos, sin = math.cos(pitch), math.sin(pitch)
    return bent @ np.array([[cos, sin], [-sin, cos]])


@pytest.mark.parametrize("at", [0.0, 8.44, 20.0])
@pytest.mark.parametrize("exaggeration", [1, 40, 150])
def test_the_outline_is_the_bent_body_of_the_recorded_state(opened, quiet, at, exaggeration):
    [vehicle] = shown(opened, at, exaggeration)
    row = round(at / 0.02)
    state, plan = quiet.columns("hsv/state"), quiet.columns("hsv/nominal")
    eta = np.array([state[name][row] for name in ELASTIC])
    expected = expected_body(eta, state["pitch_angle"][row], exaggeration)
    np.testing.assert_allclose(body_of(vehicle), expected, atol=2e-3)
    eta = np.array([plan[f"reference.{name}"][row] + plan[f"deviation.{name}"][row] for name in ELASTIC])
    pitch = plan["reference.pitch_angle"][row] + plan["deviation.pitch_angle"][row]
    # The dashed outline is the nominal vehicle.
    np.testing.assert_allclose(body_of(vehicle, "ghost"), expected_body(eta, pitch, exaggeration), atol=2e-3)
    assert f"bending drawn × {exaggeration}" in vehicle["text"]


def test_positive_elevator_is_drawn_trailing_edge_down(opened):
    script = """
        const place = document.querySelector(".side-view").cloneNode(true);
        document.body.append(place);
        const view = new SideView(place, report.airframe);
        const sample = {time: 0, altitude: 26000, velocity: 2400, angle_of_attack: 0, pitch_angle: 0, elastic: [0, 0],
          fuel_equivalence_ratio: arguments[1], elevator_deflection: arguments[0], faults: []};
        view.draw(sample);
        const paths = [...place.querySelectorAll(".vehicle path, .flame")].map((path) => path.getAttribute("d") || "");
        place.remove();
        return paths.map((d) => (d.match(/-?[\\d.]+/g) || []).map(Number));
    """

    def elevator(deflection, fuel=0.5):
        # The elevator's path has four points: leading edge, top, trailing edge, bottom.
        [points] = [
            np.array(path).reshape(-1, 2)
            for path in opened.run(script, deflection, fuel)
            if len(path) == 8 and path[0] < 300
        ]
        return points

    level, down = elevator(0.0), elevator(0.3)
    assert level[0, 0] > level[2, 0], "it flies to the right"
    assert down[2, 1] > level[2, 1] and down[0, 1] < level[0, 1], "on a screen y points down"
    flames = [
        max((max(p[0::2]) - min(p[0::2]) for p in opened.run(script, 0.0, fuel) if len(p) == 10), default=0)
        for fuel in (0.0, 0.5, 1.0)
    ]
    assert flames[0] == pytest.approx(0.0, abs=0.1) and flames[2] == pytest.approx(2.0 * flames[1], rel=1e-3)


def test_faults_are_marked_on_the_time_line_and_told_while_they_act(opened):
    assert opened.run("return document.querySelector('.marks > span').style.left") == "40%"
    assert "loss of effectiveness" not in shown(opened, FAULT - 0.02)[0]["text"]
    assert "elevator deflection: loss of effectiveness" in shown(opened, FAULT)[0]["text"]
    shown(opened, 0.0)
    opened.run("document.querySelector('.jumps button').click()")
    assert opened.run("return own.time") == FAULT


def test_it_plays_at_the_speed_chosen_and_stops_at_the_end(opened):
    shown(opened, 0.0)
    opened.run("document.querySelector('[name=speed]').value = '1'; document.querySelector('[name=play]').click()")
    opened.wait("return own.time > 1")
    opened.run("document.querySelector('[name=play]').click()")
    paused = opened.run("return own.time")
    assert opened.run("return [own.playing, own.time]") == [False, paused]
    opened.run("document.querySelector('[name=speed]').value = '20'; document.querySelector('[name=play]').click()")
    opened.wait("return !own.playing")
    assert opened.run("return own.time") == 20.0
    assert opened.console() == []


def test_keys_move_the_time_and_play(opened):
    shown(opened, 4.0)
    slider = opened.driver.find_element("css selector", "#player [name=time]")
    slider.send_keys("\ue014")  # right-arrow key
    assert opened.run("return own.time") == pytest.approx(4.02)
    slider.send_keys(" ")
    opened.wait("return own.playing && own.time > 4.1")
    slider.send_keys(" ")
    assert not opened.run("return own.playing")


def test_the_side_view_of_a_single_run_uses_the_full_width(opened, screen):
    screen(1440)
    width = "return document.querySelector(arguments[0]).getBoundingClientRect().width"
    assert opened.run(width, "#vehicle .side-view svg") > 0.75 * opened.run(width, "#vehicle")


def test_on_paper_the_picture_stays_and_the_controls_go(opened):
    shown(opened, 9.0)
    opened.media(media="print")
    assert opened.run("return getComputedStyle(document.getElementById('player')).display") == "none"
    assert opened.run("return document.querySelector('.side-view svg').getBoundingClientRect().width") > 100
    assert opened.run("return document.querySelector('#vehicle .at').textContent") == "9.00 s"
    opened.media(media="")
