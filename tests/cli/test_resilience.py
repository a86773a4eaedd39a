"""The command that flies faults of increasing severity."""

import json
import re

import pytest
from node_processes import short_scenario

FAULTS = "elevator_loss,pitch_rate_drop_out"


@pytest.fixture
def resilience(hsv, tmp_path):
    """Return a function that flies two controllers with two faults in short flights with the command."""
    short_scenario(tmp_path, duration=6, fault=2)
    (tmp_path / "rigid.toml").write_text('extends = "short.toml"\n[notch]\nenabled = false\n')

    def fly(*words, controllers="short.toml,rigid.toml", faults=FAULTS):
        named = ("--controllers", controllers, "--faults", faults, "--workers", "1", "--out", "out")
        return hsv("resilience", *named, *words)

    return fly


def test_two_controllers_and_two_faults_make_a_page_with_every_cell(resilience, hsv, tmp_path):
    ran = resilience("--json")
    assert ran.code == 0
    values = ran.json
    assert values["flown_in_s"] > 0.0
    assert values["cases_flown_now"] == 2 * 2 * 2 and len(values["cells"]) == 2 * 2 * 2 * 3
    assert {cell["flights"] for cell in values["cells"]} == {5}
    page = (tmp_path / "out/index.html").read_text()
    links = re.findall(r'href="(flights/[^"]+)"', page)
    assert {cell["worst_flight"] for cell in values["cells"]} <= set(links)
    assert page.count('class="share"') == len(values["cells"])
    assert all((tmp_path / "out" / link).is_file() for link in links)
    result = (tmp_path / "out/result.md").read_text()
    assert f"hsv resilience --controllers short.toml,rigid.toml --faults {FAULTS}" in result
    assert "| elevator loss: effectiveness 0.9, 0.7, 0.5 (1 to 0) |" in result


@pytest.mark.long
def test_the_worst_flight_flies_by_itself_as_it_did(resilience, hsv):
    cells = resilience("--json", controllers="short.toml", faults="elevator_loss,elevator_drift").json["cells"]
    lost = [cell for cell in cells if cell["survived"] < cell["flights"]]
    whole = [cell for cell in cells if cell["survived"] == cell["flights"]]
    for cell in (lost[0], whole[0]):
        flown = hsv("simulate", f"out/{cell['worst_flight']}", "--json")
        start = {"during": 0.9, "after": 3.0}[cell["time"]]
        loss = cell["time_to_loss_s"]
        assert flown.json["diverged_at_s"] == (None if loss is None else pytest.approx(start + loss))
        assert flown.code == (0 if loss is None else 1)
    assert lost[0]["time_to_loss_s"] is not None and whole[0]["time_to_loss_s"] is None


def test_the_faults_are_listed(hsv):
    listed = json.loads(hsv("resilience", "--list", "--json").out)
    assert listed["elevator_loss"] == "effectiveness 0.9, 0.7, 0.5 (1 to 0)"
    assert listed["elevator_hard_over"] == "duration 0.1, 0.2, 0.3 s (0.02 to 1 s), rate -100 deg/s"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--faults", "nonsense"), "faults = 'nonsense': expected one of elevator_loss, "),
        (("--controllers", "missing.toml"), "scenario 'missing.toml': cannot be read"),
        (("--controllers", "short.toml,short.toml"), "controllers: 'short.toml' twice"),
        (("--controllers", "short.toml,sub/short.toml"), "controllers: two files called short"),
        (("--workers", "-1"), "workers = -1: expected 0 to 4096"),
        (("--out", "short.toml"), "out = 'short.toml': cannot be written"),
    ],
)
def test_bad_settings_end_with_one_line(hsv, tmp_path, words, expected):
    short_scenario(tmp_path, duration=6, fault=2)
    (tmp_path / "sub").mkdir()
    short_scenario(tmp_path / "sub", duration=6, fault=2)
    defaults = {"--controllers": "short.toml", "--faults": "elevator_loss"}
    given = [word for option in defaults if option not in words for word in (option, defaults[option])]
    refused = hsv("resilience", *given, *words)
    assert refused.code == 2 and expected in refused.error
    assert not list(tmp_path.glob("*/cases"))
