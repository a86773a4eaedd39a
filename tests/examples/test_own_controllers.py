"""The examples of custom controllers, installed as packages and flown; the exported one on an emulated Cortex-M7."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import matplotlib
import numpy
import pytest
from marking import long
from node_processes import Processes
from page_blocks import blocks
from printed_commands import printed
from pyarrow import parquet
from ros_domain import own_environment

EXAMPLES = Path(__file__).parents[2] / "examples"


class Installed:
    """An example, installed as a package into its own folder, and the commands that use it."""

    def __init__(self, folder, example):
        self.folder = folder
        source = folder / example
        # Install from a copy, because building leaves files next to the sources.
        for path in (EXAMPLES / example).rglob("*"):
            if path.suffix in (".py", ".toml"):
                target = source / path.relative_to(EXAMPLES / example)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(path.read_bytes())
        self.pip("install", "--no-deps", "--no-index", "--no-build-isolation", source)
        self.path = os.pathsep.join((str(folder / "site"), os.environ.get("PYTHONPATH", "")))

    def pip(self, command, *words):
        words = (command, "--quiet", "--target", self.folder / "site", *words)
        subprocess.run([sys.executable, "-m", "pip", *words], check=True)

    def python(self, *words):
        environment = {**os.environ, "PYTHONPATH": self.path}
        return subprocess.run(
            [sys.executable, *words], capture_output=True, text=True, cwd=self.folder, env=environment
        )

    def hsv(self, *words):
        return self.python("-m", "hsv.cli.entry", *words)


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Return a function that installs an example, with numba for the compiled one."""

    @cache
    def install(example):
        made = Installed(tmp_path_factory.mktemp("installed"), example)
        if example == "compiled":
            asked = made.python("-m", "pip", "index", "versions", "numba")
            if asked.returncode:
                pytest.skip(f"no package index: {asked.stderr.strip().splitlines()[-1]}")
            made.pip("install", "numba", f"numpy=={numpy.__version__}")
        return made

    return install


@pytest.mark.parametrize(
    ("example", "scenario", "altitude", "velocity"),
    # Fast integral action removes the error that the fault leaves; proportional feedback does not.
    [long("lqr", "lqr", 1.0, 0.1), long("lqr", "lqr_winged_cone", 10.0, 0.5), long("compiled", "compiled", 30.0, 5.0)],
)
def test_it_flies_without_a_design_and_holds_the_commands(installed, example, scenario, altitude, velocity):
    ran = installed(example).hsv("simulate", str(EXAMPLES / example / f"{scenario}.toml"), "--json")
    assert ran.returncode == 0, ran.stderr
    flown = json.loads(ran.stdout)
    assert flown["diverged_at_s"] is None
    metrics = flown["metrics"]
    assert abs(metrics["altitude_end_error_m"]) < altitude
    assert abs(metrics["velocity_end_error_m_per_s"]) < velocity
    assert metrics["altitude_settling_time_s"] < 80.0


@pytest.mark.long
@pytest.mark.parametrize("example", ["compiled", "lqr", "c_gain_scheduled"])
def test_its_page_is_true_to_the_last_command(installed, tmp_path, example):
    shutil.copytree(EXAMPLES / example, tmp_path / "examples" / example, ignore=shutil.ignore_patterns("*.so"))
    script = "\n".join(printed(f"examples/{example}/README.md"))
    with own_environment() as environment:
        path = {} if example == "c_gain_scheduled" else {"PYTHONPATH": installed(example).path}
        processes = Processes(environment | path, tmp_path)
        done = processes.run("bash", "-e", "-x", "-c", script)
        processes.stop()
    assert done.returncode == 0, done.stdout
    pages = printed(f"examples/{example}/README.md")
    assert len(list(tmp_path.glob("*_and_tube.html"))) == sum("hsv report" in line for line in pages) > 0


@pytest.mark.parametrize("example", ["vehicle", "scenario", long("fmu")])
def test_a_vehicle_a_scenario_and_an_fmu_fly_as_their_pages_say(tmp_path, example):
    shutil.copytree(EXAMPLES / example, tmp_path / "examples" / example, ignore=shutil.ignore_patterns("*.fmu"))
    for command in printed(f"examples/{example}/README.md"):
        if not command.startswith("hsv montecarlo"):  # other tests fly campaigns
            words = [sys.executable, "-m", "hsv.cli.entry", *shlex.split(command)[1:]]
            ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
            assert ran.returncode == 0, f"{command}: {ran.stderr}"
    assert "verdict within all" in ran.stdout


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """Return a folder with the C example, built, flown and used in a campaign as its page prints."""
    folder = tmp_path_factory.mktemp("checkout")
    example = Path("examples", "c_gain_scheduled")
    shutil.copytree(EXAMPLES.parent / example, folder / example, ignore=shutil.ignore_patterns("*.so"))
    commands = printed(str(example / "README.md"))[:3]
    assert [command.split()[:2] for command in commands[1:]] == [["hsv", "simulate"], ["hsv", "montecarlo"]]
    for command in commands:
        ran = subprocess.run(shlex.split(command), cwd=folder, capture_output=True, text=True)
        assert ran.returncode == 0, f"{command}: {ran.stderr}"
    return folder


@pytest.mark.long
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
    # An example's campaigns, bags and pages are named after its scenario file, so no two examples' names agree.
    [result] = Path("campaigns").glob("c_gain_scheduled_*.parquet")
    assert len(parquet.read_table(result)) == 100


EXAMPLE = Path("examples", "cortex_m")
PAGE = str(EXAMPLE / "README.md")
TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
MISSING = [tool for tool in TOOLS if shutil.which(tool) is None]


@pytest.fixture
def board(tmp_path):
    """Return a folder with the example as in the checkout, not built."""
    shutil.copytree(Path(__file__).parents[2] / EXAMPLE, tmp_path / EXAMPLE, ignore=shutil.ignore_patterns("build"))
    return tmp_path


@pytest.mark.long
@pytest.mark.skipif(bool(MISSING), reason=f"no {' and no '.join(MISSING)}")
def test_the_page_of_the_board_is_true_to_the_last_command(board):
    install, *script = printed(PAGE)
    assert install.startswith("sudo apt-get install")
    environment = {"PYTHONPATH": f"{board / EXAMPLE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    with own_environment() as own:
        processes = Processes(own | environment, board)
        done = processes.run("bash", "-e", "-c", "\n".join(script))
        processes.stop()
    assert done.returncode == 0, done.stdout
    assert len(re.findall(r"fingerprint\W+as published", done.stdout)) == 2
    [shown] = blocks(PAGE, "text")
    fingerprint = shown.text.splitlines()[0]
    assert fingerprint in done.stdout
    # Another compiler gives other counts; they must be of the same order as those of the page.
    for found, printed_number in zip(counts(done.stdout), counts(shown.text), strict=True):
        assert 0.5 < found / printed_number < 2.0


def counts(text):
    """Return instructions, stack and code size in the report of a flight."""
    lines = re.findall(r"^(?:instructions per step|stack|code and constants): .*", text, re.MULTILINE)
    return [int(number) for line in lines for number in re.findall(r"[1-9]\d*", line)]


def test_without_cross_compiler_or_emulator_there_is_one_line(board):
    ran = subprocess.run(
        ["make", "-s", "-C", EXAMPLE, "CC_ARM=no-such-gcc"], cwd=board, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 2
    assert ran.stderr.splitlines()[0] == (
        "there is no no-such-gcc: sudo apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi"
    )
    path = os.pathsep.join((str(board / EXAMPLE), os.environ.get("PYTHONPATH", "")))
    command = [sys.executable, "-m", "hsv.cli.entry", "simulate", EXAMPLE / "cortex_m.toml"]
    flown = subprocess.run(
        command, cwd=board, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False
    )
    assert flown.returncode == 2
    [line] = flown.stderr.splitlines()
    assert "not there, expected as examples/cortex_m/README.md says" in line
