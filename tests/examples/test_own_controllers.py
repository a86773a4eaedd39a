"""The examples of controllers of one's own, installed as the packages that they are, and flown."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

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

    return run


@pytest.mark.parametrize(
    ("example", "altitude", "velocity"),
    # Integral action takes the error that the fault leaves away; feedback alone does not.
    [("lqr", 1.0, 0.1), ("compiled", 30.0, 5.0)],
)
def test_it_flies_without_a_design_and_holds_the_commands(hsv, example, altitude, velocity):
    ran = hsv("simulate", str(EXAMPLES / example / "scenario.toml"), "--json")
    assert ran.returncode == 0, ran.stderr
    flown = json.loads(ran.stdout)
    assert flown["diverged_at_s"] is None
    metrics = flown["metrics"]
    assert abs(metrics["altitude_end_error_m"]) < altitude
    assert abs(metrics["velocity_end_error_m_per_s"]) < velocity
    assert metrics["altitude_settling_time_s"] < 80.0


@pytest.mark.parametrize("example", FLYABLE)
def test_a_campaign_flies_it(hsv, example):
    words = ["montecarlo", str(EXAMPLES / example / "scenario.toml"), "--samples", "100", "--seed", "1", "--no-page"]
    ran = hsv(*words, "--out", f"{example}.parquet", "--json")
    assert ran.returncode == 0, ran.stderr
    kept = json.loads(ran.stdout)
    assert kept["flights"] == 100
    [ended] = [limit for limit in kept["limits"] if limit["name"] == "flown_to_the_end"]
    assert ended["within"] == 100


def test_what_an_example_refuses_is_said_in_a_line(hsv, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "{EXAMPLES / "compiled" / "scenario.toml"}"\n[scheduled]\nlow_velocity = "8200 ft/s"\n')
    ran = hsv("simulate", str(path))
    assert ran.returncode == 2
    [line] = ran.stderr.splitlines()
    assert "cannot be built, ValueError: scheduled.high_velocity = 2484.12 m/s: expected more" in line
