"""The exported controller on an emulated Cortex-M7."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from node_processes import Processes
from page_blocks import blocks
from printed_commands import printed
from ros_domain import own_environment

EXAMPLE = Path("examples", "cortex_m")
PAGE = str(EXAMPLE / "README.md")
TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
MISSING = [tool for tool in TOOLS if shutil.which(tool) is None]


@pytest.fixture
def checkout(tmp_path):
    """A folder with the example as in the checkout, not built."""
    shutil.copytree(Path(__file__).parents[2] / EXAMPLE, tmp_path / EXAMPLE, ignore=shutil.ignore_patterns("build"))
    return tmp_path


@pytest.mark.long
@pytest.mark.skipif(bool(MISSING), reason=f"no {' and no '.join(MISSING)}")
def test_its_page_is_true_to_the_last_command(checkout):
    install, *script = printed(PAGE)
    assert install.startswith("sudo apt-get install")
    environment = {"PYTHONPATH": f"{checkout / EXAMPLE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    with own_environment() as own:
        processes = Processes(own | environment, checkout)
        done = processes.run("bash", "-e", "-c", "\n".join(script))
        processes.stop()
    assert done.returncode == 0, done.stdout
    assert len(re.findall(r"fingerprint\W+as published", done.stdout)) == 2
    [shown] = blocks(PAGE, "text")
    fingerprint = shown.text.splitlines()[0]
    assert fingerprint in done.stdout
    # Another compiler gives other counts; those of the page are of the same size.
    for found, printed_number in zip(counts(done.stdout), counts(shown.text), strict=True):
        assert 0.5 < found / printed_number < 2.0


def counts(text):
    """Return instructions, stack and code in the report of a flight."""
    lines = re.findall(r"^(?:instructions per step|stack|code and constants): .*", text, re.MULTILINE)
    return [int(number) for line in lines for number in re.findall(r"[1-9]\d*", line)]


def test_without_cross_compiler_or_emulator_there_is_one_line(checkout):
    ran = subprocess.run(
        ["make", "-s", "-C", EXAMPLE, "CC_ARM=no-such-gcc"], cwd=checkout, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 2
    assert ran.stderr.splitlines()[0] == (
        "there is no no-such-gcc: sudo apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi"
    )
    path = os.pathsep.join((str(checkout / EXAMPLE), os.environ.get("PYTHONPATH", "")))
    command = [sys.executable, "-m", "hsv.cli.entry", "simulate", EXAMPLE / "cortex_m.toml"]
    flown = subprocess.run(
        command, cwd=checkout, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False
    )
    assert flown.returncode == 2
    [line] = flown.stderr.splitlines()
    assert "not there, expected as examples/cortex_m/README.md says" in line
