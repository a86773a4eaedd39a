"""The example of a controller of one's own in Python: installed as its package, flown by the commands of its README."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "lqr"
SCENARIO = str(EXAMPLE / "scenario.toml")


@pytest.fixture(scope="module")
def hsv(tmp_path_factory):
    """Run a command where the example is installed."""
    folder = tmp_path_factory.mktemp("installed")
    source = folder / "source"
    source.mkdir()
    for name in ("pyproject.toml", "hsv_lqr/__init__.py"):
        (source / name).parent.mkdir(exist_ok=True)
        (source / name).write_bytes((EXAMPLE / name).read_bytes())
    words = [
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--no-build-isolation",
        "--target",
        folder / "site",
        source,
    ]
    subprocess.run([sys.executable, "-m", "pip", *words], check=True)
    path = os.pathsep.join((str(folder / "site"), os.environ.get("PYTHONPATH", "")))

    def run(*words):
        command = [sys.executable, "-m", "hsv.cli.main", *words]
        return subprocess.run(
            command, capture_output=True, text=True, cwd=folder, env={**os.environ, "PYTHONPATH": path}
        )

    return run


def test_it_flies_without_a_design_and_holds_the_commands(hsv):
    ran = hsv("simulate", SCENARIO, "--json")
    assert ran.returncode == 0, ran.stderr
    flown = json.loads(ran.stdout)
    assert flown["diverged_at_s"] is None
    metrics = flown["metrics"]
    assert abs(metrics["altitude_end_error_m"]) < 1.0 and abs(metrics["velocity_end_error_m_per_s"]) < 0.1
    assert metrics["velocity_settling_time_s"] < 80.0


def test_a_campaign_flies_it(hsv):
    ran = hsv("montecarlo", SCENARIO, "--samples", "16", "--seed", "1", "--no-page", "--out", "a.parquet", "--json")
    assert ran.returncode == 0, ran.stderr
    kept = json.loads(ran.stdout)
    assert kept["flights"] == 16
    assert (
        "% of "
        not in hsv("montecarlo", SCENARIO, "--samples", "16", "--seed", "1", "--no-page", "--out", "a.parquet").stdout
    )
