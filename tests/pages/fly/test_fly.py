"""The page that flies in the browser: its module in wasmtime, node and Chromium, against the library."""

import json
import math
import shutil
import subprocess
from pathlib import Path

import pytest
from browser import HINT
from flights_in_wasm import Machine

from hsv.core import dtype, ffi
from hsv.core.web import compile_module, layouts
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.fingerprint import published_fingerprint
from hsv.flight.scenario import load_scenario, scenario_names
from hsv.pages.fly import SCENARIOS, described, fly_page, fragment

PUBLISHED = [name for name in scenario_names() if published_fingerprint(name)]


def test_layouts_are_those_of_the_compiler_where_there_are_no_pointers():
    found = layouts("hsv_flight")
    for kind in ("hsv_vehicle", "hsv_sensors", "hsv_fault", "hsv_fault_memory", "hsv_actuators"):
        assert found[kind]["size"] == ffi.sizeof(kind)
        offsets = {name: field["offset"] for name, field in found[kind]["fields"].items()}
        assert offsets == {name: dtype(kind).fields[name][1] for name in dtype(kind).names}


@pytest.mark.parametrize(
    ("name", "changes", "expected"),
    [
        ("case2", {}, "case2"),
        ("case1", {"fault[0].effectiveness": 0.7, "vehicle.perturbation.mass": "5 %"}, "case1&size=0.7&mass=5.0"),
        ("case1", {"fault": [], "command[0].altitude_change": "-300 ft"}, "case1&fault=none&dh=-300.0"),
        ("case2", {"tube.tau": 0.9, "wind.forward": "-5 m/s", "seed": 3}, "case2&seed=3&tau=0.9&wind=-5.0"),
        ("case1", {"duration": "150 s"}, None),
        ("case1", {"fault[0].effectiveness": 0.12345678}, None),
        ("case1", {"vehicle.perturbation.mass": "50 %"}, None),
        ("case1_rmpc", {}, None),
    ],
)
def test_a_scenario_that_the_page_can_fly_has_an_address(name, changes, expected):
    assert fragment(load_scenario(name, changes)) == expected


@pytest.fixture(scope="module")
def module(tmp_path_factory):
    pytest.importorskip("ziglang", reason="make test-long and make test-viewers install it")
    compile_module(out := tmp_path_factory.mktemp("core") / "core.wasm")
    assert out.stat().st_size <= 60_000
    return out


@pytest.mark.long
def test_wasmtime_flies_every_published_scenario_as_published(module):
    machine = Machine(module, described(PUBLISHED))
    assert {name: machine.fingerprint(name) for name in PUBLISHED} == {n: published_fingerprint(n) for n in PUBLISHED}


def flown_by_node(module, tmp_path, names, *arguments):
    if not shutil.which("node"):
        pytest.skip(f"no node; {HINT}")
    (tmp_path / "described.json").write_text(json.dumps(described(names)))
    shutil.copy(module, tmp_path / "core.wasm")
    command = ["node", str(Path(__file__).with_name("fly.mjs")), str(tmp_path), *arguments]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


@pytest.mark.viewer
def test_node_flies_every_published_scenario_as_published(module, tmp_path):
    found = flown_by_node(module, tmp_path, PUBLISHED)
    assert {name: flown["fingerprint"] for name, flown in found.items()} == {
        name: published_fingerprint(name) for name in PUBLISHED
    }


@pytest.mark.viewer
def test_the_library_flies_the_printed_files_of_random_settings_the_same(module, tmp_path):
    found = flown_by_node(module, tmp_path, SCENARIOS, "200", "20261128")
    assert len(found) == 200
    for key, page in found.items():
        scenario = load_scenario(str(tmp_path / f"{key}.toml"))
        flight = fly(assemble_flight(scenario))
        assert (page["fingerprint"], page["steps"]) == (flight.fingerprint, len(flight.time)), page
        for name, value in page["metrics"].items():
            assert math.isclose(value, flight.metrics[name], rel_tol=1e-9, abs_tol=1e-12), (name, page)
        address = fragment(scenario).split("&")
        settings = dict(setting.split("=") for setting in address[1:])
        same = {name: value for name, value in page["given"].items() if name in settings and name != "fault"}
        assert {name: float(settings[name]) for name in same} == same


DONE = "return document.body.dataset.done || /^(Cannot|Not)/.test(document.getElementById('verdict').textContent)"
VERDICT = "return [document.querySelector('.result').className, document.getElementById('verdict').textContent]"

MOVED = """
    const slider = document.getElementById(`set-${arguments[0]}`);
    slider.value = arguments[1];
    slider.dispatchEvent(new Event("input", { bubbles: true }));
"""


@pytest.fixture(scope="module")
def page(module, tmp_path_factory):
    path = tmp_path_factory.mktemp("site") / "fly.html"
    path.write_text(fly_page(), encoding="utf-8")
    assert path.stat().st_size <= 1_000_000
    return path


def show(browser, page, settings=""):
    browser.driver.get("about:blank")
    browser.driver.get(f"{page.as_uri()}{settings}")
    browser.wait(DONE)
    return browser.run(VERDICT)


@pytest.mark.viewer
def test_the_page_flies_as_published_and_follows_settings_and_address(browser, page):
    browser.console(), browser.requests()
    for name in SCENARIOS:
        assert show(browser, page, f"#{name}") == ["result as-published", "Fingerprint as published"]
        assert browser.run("return document.body.dataset.done") == published_fingerprint(name)
    assert all(address.startswith(("file:", "about:", "data:")) for address in browser.requests())
    browser.run(MOVED, "mass", 5)
    browser.wait("return document.getElementById('verdict').textContent.startsWith('Changed')")
    assert browser.run("return location.hash") == "#winged_cone&mass=5"
    kind, verdict = show(browser, page, "#case1&size=0.3&at=60&mass=999&<img src=x onerror=alert(1)>=1&wind=")
    assert kind == "result " and verdict.startswith("Lost at ")
    said = browser.run("return document.getElementById('trouble').textContent")
    assert (
        "mass = 999, expected -20 to 20" in said and "<img" in said and not browser.run("return document.images.length")
    )
    published = ["result as-published", "Fingerprint as published"]
    assert show(browser, page, "#case1&size=0.9") == show(browser, page, "#case1&mass=%zz") == published
    browser.run("document.querySelector('.skip').click()")
    assert browser.run("return document.activeElement.id + location.hash") == "set-scenario#case1&mass=%zz"
    assert browser.console() == []


@pytest.mark.viewer
def test_the_page_fits_and_has_no_barriers(browser, page):
    for width in (1440, 390):
        for scheme in ("light", "dark"):
            browser.screen(width, scheme)
            show(browser, page, "#case2&size=0.6")
            assert browser.run("return document.documentElement.scrollWidth <= innerWidth")
            assert browser.barriers() == []


@pytest.mark.viewer
def test_a_core_with_another_floating_point_option_turns_the_page_red(browser, page, tmp_path):
    (tmp_path / "fly.html").write_text(fly_page("-freciprocal-math"), encoding="utf-8")
    kind, verdict = show(browser, tmp_path / "fly.html")
    assert kind == "result wrong" and verdict.startswith("Not the published flight")
