"""Python blocks on pages of the documentation run one after another, as a reader would type them."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import page_blocks
import pytest
from marking import long

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ["python.md", long("vehicle.md"), "hardware.md", long("worst.md")]
MODULES = {"python.md": ("mine", "class Mine")}
"""Pages that ask the reader to save a block as a module: the module's name, and a text that the block contains."""


def blocks(page, language):
    found = [block.text for block in page_blocks.blocks(f"docs/{page}", language)]
    assert found
    return found


def write_files(page, folder):
    """Write the blocks of a page that begin with a file name to these files."""
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
    assert {path.name for path in tmp_path.glob("*.png")} == set(re.findall(r'savefig\("(.*?)"', "".join(code)))
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
