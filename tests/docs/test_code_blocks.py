"""The Python code on pages of the documentation runs, block after block, as a reader would type it."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import matplotlib
import page_blocks
import pytest
from marking import long

from hsv.model.faults.table import FAULT_KINDS, read_fault

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ["python.md", long("vehicle.md"), "hardware.md"]
MODULES = {"python.md": ("mine", "class Mine")}
"""Pages that tell to put a block into a module: its name, and what the block has in it."""


def blocks(page, language):
    found = [block.text for block in page_blocks.blocks(f"docs/{page}", language)]
    assert found
    return found


def write_files(page, folder):
    """Write the blocks of a page that begin with the name of a file."""
    for block in blocks(page, "toml"):
        name = re.match(r"# (\w+\.toml)\n", block)
        assert name
        (folder / name[1]).write_text(block, encoding="utf-8")


@pytest.mark.parametrize("page", PAGES)
def test_code_of_the_page_runs(page, tmp_path, monkeypatch):
    matplotlib.use("agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    code = blocks(page, "python")
    if page in MODULES:
        module, mark = MODULES[page]
        [own] = [block for block in code if mark in block]
        Path(f"{module}.py").write_text(own, encoding="utf-8")
    else:
        write_files(page, tmp_path)
    names: dict[str, object] = {}
    for block in code:
        exec(compile(block, page, "exec"), names)
    if page in MODULES:
        sys.modules.pop(module, None)
    assert {path.name for path in tmp_path.glob("*.png")} == set(re.findall(r'savefig\("(.*?)"\)', "".join(code)))
    assert names["flight"].status.name == "FINISHED"


def test_the_controller_of_the_readme_flies(tmp_path):
    for block in page_blocks.blocks("README.md"):
        if block.file:
            (tmp_path / block.file).write_text(block.text, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([".", os.environ.get("PYTHONPATH", "")])}
    command = ["hsv", "simulate", "mine.toml", "--json"]
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout)["metrics"]["altitude_settling_time_s"] < 60.0


def test_code_of_the_page_on_the_core_runs_and_its_lines_of_c_are_those_of_the_core(capsys):
    for block in blocks("core.md", "python"):
        exec(compile(block, "core.md", "exec"), {})
    assert capsys.readouterr().out.splitlines()[-1].startswith("0.01")
    sources = DOCS.parent / "src" / "hsv" / "hsv" / "core"
    core = " ".join("".join(path.read_text(encoding="utf-8") for path in sources.glob("*.h")).split())
    for block in blocks("core.md", "c"):
        for line in block.splitlines():
            assert line.strip() == "..." or " ".join(line.split()) in core, line


def test_numbers_of_the_page_on_the_notch_filter_hold():
    for block in blocks("explanation/notch.md", "python"):
        exec(compile(block, "notch.md", "exec"), {})


@pytest.mark.long
def test_commands_of_the_page_take_a_vehicle_from_its_file_to_a_certified_flight(tmp_path):
    write_files("vehicle.md", tmp_path)
    (tmp_path / "offline_design").symlink_to(DOCS.parent / "offline_design")
    commands = re.findall(r"^    (hsv .*)$", (DOCS / "vehicle.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert {"hsv design mine_design.toml", "hsv verify mine_design.yaml", "hsv simulate flight.toml"} <= {*commands}
    for command in commands:
        ran = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, f"{command}: {ran.stderr}"


def test_the_page_on_hardware_has_every_type_of_fault_in_the_order_in_which_they_act():
    rows = re.findall(
        r"^\| (\w+) \| (\w+(?:, \w+)*) \|$", (DOCS / "hardware.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    listed = [(side, kind) for side, kinds in rows for kind in kinds.split(", ")]
    assert listed == [(kind.side, name) for name, kind in FAULT_KINDS.items()]


def test_faults_that_the_page_on_hardware_injects_are_faults():
    commands = re.findall(
        r"^    hsv fault inject (.*)$", (DOCS / "hardware.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    injected = [shlex.split(command.partition(" --duration")[0]) for command in commands]
    assert [str(read_fault(channel, kind, parameters)) for channel, kind, *parameters in injected] == [
        "oscillation amplitude 0.5 deg, frequency 2 Hz of elevator_deflection",
        "loss_of_effectiveness 0.8 of elevator_deflection",
    ]


@pytest.mark.long
def test_commands_of_the_page_on_hardware_run(tmp_path):
    write_files("hardware.md", tmp_path)
    # Those of hsv certify take minutes each, and end with 1 where they say "not certified".
    page = (DOCS / "hardware.md").read_text(encoding="utf-8")
    commands = re.findall(r"^    (hsv (?!fault |certify ).*)$", page, re.MULTILINE)
    assert [command.split()[1] for command in commands] == ["list", "list", *["montecarlo"] * 3]
    for command in commands:
        ran = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, f"{command}: {ran.stderr}"
