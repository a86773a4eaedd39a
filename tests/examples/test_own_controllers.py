"""The examples of controllers of one's own, installed as the packages that they are, and flown."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest
from node_processes import Processes
from printed_commands import printed
from pyarrow import parquet
from ros_domain import own_environment

from hsv.simulation.assembly import assemble_flight
from hsv.simulation.closed_loop import fly
from hsv.simulation.scenario import load_scenario

EXAMPLES = Path(__file__).parents[2] / "examples"
FLYABLE = ["compiled", "lqr"]


@pytest.fixture(scope="module")
def hsv(tmp_path_factory):
    """Run a command where the examples are installed."""
    folder = tmp_path_factory.mktemp("installed")
    sources = []
    for example in FLYABLE:
        # A copy: building leaves traces beside the sources.
        sources.append(folder / example)
        for path in (EXAMPLES / example).rglob("*"):
            if path.suffix in (".py", ".toml"):
                target = sources[-1] / path.relative_to(EXAMPLES / example)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(path.read_bytes())
    words = ["install", "--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--target", folder / "site"]
    subprocess.run([sys.executable, "-m", "pip", *words, *sources], check=True)
    path = os.pathsep.join((str(folder / "site"), os.environ.get("PYTHONPATH", "")))

    def run(*words):
        command = [sys.executable, "-m", "hsv.cli.main", *words]
        return subprocess.run(
            command, capture_output=True, text=True, cwd=folder, env={**os.environ, "PYTHONPATH": path}
        )

    run.path = path
    return run


@pytest.mark.parametrize(
    ("example", "altitude", "velocity"),
    # Integral action takes the error that the fault leaves away; feedback alone does not.
    [("lqr", 1.0, 0.1), ("compiled", 30.0, 5.0)],
)
def test_it_flies_without_a_design_and_holds_the_commands(hsv, example, altitude, velocity):
    ran = hsv("simulate", str(EXAMPLES / example / f"{example}.toml"), "--json")
    assert ran.returncode == 0, ran.stderr
    flown = json.loads(ran.stdout)
    assert flown["diverged_at_s"] is None
    metrics = flown["metrics"]
    assert abs(metrics["altitude_end_error_m"]) < altitude
    assert abs(metrics["velocity_end_error_m_per_s"]) < velocity
    assert metrics["altitude_settling_time_s"] < 80.0


@pytest.mark.long
@pytest.mark.parametrize("example", FLYABLE)
def test_a_campaign_flies_it(hsv, example):
    words = ["montecarlo", str(EXAMPLES / example / f"{example}.toml"), "--samples", "100", "--seed", "1", "--no-page"]
    ran = hsv(*words, "--out", f"{example}.parquet", "--json")
    assert ran.returncode == 0, ran.stderr
    kept = json.loads(ran.stdout)
    assert kept["flights"] == 100
    [ended] = [limit for limit in kept["limits"] if limit["name"] == "flown_to_the_end"]
    assert ended["within"] == 100


@pytest.mark.long
@pytest.mark.parametrize("example", [*FLYABLE, "c_gain_scheduled"])
def test_its_page_is_true_to_the_last_command(hsv, tmp_path, example):
    shutil.copytree(EXAMPLES / example, tmp_path / "examples" / example, ignore=shutil.ignore_patterns("*.so"))
    # A study takes ten minutes, beside all shipped controllers: tests/cli/test_study.py flies a short one.
    script = "\n".join(line for line in printed(f"examples/{example}/README.md") if " study " not in line)
    with own_environment() as environment:
        processes = Processes(environment | {"PYTHONPATH": hsv.path}, tmp_path)
        done = processes.run("bash", "-e", "-x", "-c", script)
        processes.stop()
    assert done.returncode == 0, done.stdout
    assert len(list(tmp_path.glob("*_and_tube.html"))) == 1


@pytest.mark.parametrize(
    "flown",
    [pytest.param(name, marks=pytest.mark.long) for name in ("lqr", str(EXAMPLES / "compiled" / "compiled.toml"))],
)
def test_it_flies_the_same_bytes_every_time(hsv, flown):
    ran = hsv("check", flown, "--json")
    assert ran.returncode == 0, ran.stderr
    assert all(check["same"] and check["flights"] >= 2 for check in json.loads(ran.stdout)["checks"])


def test_what_an_example_refuses_is_said_in_a_line(hsv, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "{EXAMPLES / "compiled" / "compiled.toml"}"\n[scheduled]\nlow_velocity = "8200 ft/s"\n')
    ran = hsv("simulate", str(path))
    assert ran.returncode == 2
    [line] = ran.stderr.splitlines()
    assert "cannot be built, ValueError: scheduled.high_velocity = 2484.12 m/s: expected more" in line


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """Return a folder with the example in C as in the checkout, built, flown and in a campaign as printed."""
    folder = tmp_path_factory.mktemp("checkout")
    example = Path("examples", "c_gain_scheduled")
    shutil.copytree(EXAMPLES.parent / example, folder / example, ignore=shutil.ignore_patterns("*.so"))
    commands = printed(str(example / "README.md"))[:3]
    assert [command.split()[:2] for command in commands[1:]] == [["hsv", "simulate"], ["hsv", "montecarlo"]]
    for command in commands:
        ran = subprocess.run(shlex.split(command), cwd=folder, capture_output=True, text=True)
        assert ran.returncode == 0, f"{command}: {ran.stderr}"
    return folder


def test_the_example_in_c_is_built_flown_and_compared_as_its_page_says(checkout, monkeypatch):
    matplotlib.use("agg")
    monkeypatch.chdir(checkout)
    text = Path("examples", "c_gain_scheduled", "README.md").read_text(encoding="utf-8")
    [block] = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    names = {}
    exec(compile(block, "README.md", "exec"), names)
    ours, theirs = names["flights"].values()
    assert abs(ours.metrics["altitude_end_error"]) < 30.0 and abs(ours.metrics["velocity_end_error"]) < 5.0
    assert ours.fingerprint != theirs.fingerprint
    assert Path("scheduled_and_tube.png").exists()
    # An example's campaigns, bags and pages are called by its scenario's file: no two examples' are alike.
    [result] = Path("campaigns").glob("c_gain_scheduled_*.parquet")
    assert len(parquet.read_table(result)) == 100


def test_the_example_in_c_flies_the_same_bits_as_the_one_that_numba_compiles(checkout, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES / "compiled")
    path = str(checkout / "examples" / "c_gain_scheduled" / "c_gain_scheduled.toml")
    compiled = assemble_flight(load_scenario(path, {"controller": "hsv_scheduled:Scheduled"}))
    # Computed on another machine, the gains may differ in last bits from those that the C source has.
    gains = compiled.controller.kernel.parameters[2:].tolist()
    changes = {"scheduled.low_gain": gains[:10], "scheduled.high_gain": gains[10:]}
    assert fly(assemble_flight(load_scenario(path, changes))).fingerprint == fly(compiled).fingerprint


@pytest.mark.long
def test_what_the_example_in_c_refuses_is_said_in_a_line(checkout, hsv, tmp_path):
    for text, message in {
        "[scheduled]\nlow_velocity = '7900 ft'": "scheduled.low_velocity = '7900 ft': wrong unit",
        "controller = 'elsewhere.so:scheduled'": "controller = '.*elsewhere.so:scheduled': cannot be read",
        "controller = '../scheduled.so:scheduled'": "expected a path inside the scenario's folder",
    }.items():
        path = tmp_path / "mine.toml"
        path.write_text(f'extends = "{checkout}/examples/c_gain_scheduled/c_gain_scheduled.toml"\n{text}\n')
        ran = hsv("simulate", str(path))
        assert ran.returncode == 2
        [line] = ran.stderr.splitlines()
        assert re.search(message, line), line
