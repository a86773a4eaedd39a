"""What a user or a node wrote is printed as it stands, whatever it looks like to the library that prints it."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from flown_bags import flown_bag
from rich.console import Console

from hsv.bags.metadata import FILE_NAME
from hsv.base.units import UnitSystem
from hsv.cli import output
from hsv.cli.summary import print_section

NAME = "run[old] [/x] :bug:"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown_bag(tmp_path_factory.mktemp("bags") / "flown", duration=11.0, fault=1.0)


@pytest.mark.long
def test_paths_are_printed_as_they_are(hsv: Callable[..., Any], bag: Path, tmp_path: Path) -> None:
    path = shutil.copytree(bag, tmp_path / NAME.replace("/", "_"))
    (path / FILE_NAME).unlink()
    for command in ("recover", "info"):
        ran = hsv(command, str(path))
        assert ran.code == 0 and str(path) in ran.out
    assert str(path) in hsv("plot", str(path), "--out", str(path / "x.png")).out
    data = path / "flown_0.mcap"
    data.write_bytes(data.read_bytes()[: data.stat().st_size // 2])
    assert str(data) in hsv("info", str(data)).err, "the warning"
    assert str(data) in hsv("diff", str(data), str(data), "--tolerance", "0").err
    assert f"'{NAME}'" in hsv("replay", str(bag), "--node", NAME).error


def test_lines_of_nodes_and_titles_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    output.report_line("plant", f"[WARN] {NAME}")
    output.report_error(NAME)
    output.warn(NAME)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"plant: [WARN] {NAME}", f"hsv: error: {NAME}", f"hsv: warning: {NAME}"]
    output.print_table(NAME, {"altitude": (1.0, "m")}, UnitSystem.si)
    assert capsys.readouterr().out.splitlines()[0].strip() == NAME
    print_section(NAME, {NAME: NAME})
    title, line = capsys.readouterr().out.splitlines()
    assert title == NAME and line.split("  ")[1:] == [NAME, NAME]


def test_a_bar_shows_the_name_of_a_scenario_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.StringIO()
    monkeypatch.setattr(output, "errors", Console(file=written, force_terminal=True, width=200))
    with output.flight_line(NAME, 100, UnitSystem.si) as (show_step, _):
        show_step(50)
    with output.stages() as progress:
        progress(NAME, 1, 2)
    assert written.getvalue().count("run[old] [/x]") >= 2


def test_control_characters_are_shown_and_not_sent_to_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    title = "\x1b[31mred\x1b]0;title\x07 \x9b2J \x08\r\x7f\u202e\u200b\u2028\u2066\tend"
    terminal = type(output.console)(file=io.StringIO(), force_terminal=True, highlight=False, width=200)
    terminal.print(title, soft_wrap=True)
    output.report_error(title)
    for shown in (terminal.file.getvalue(), capsys.readouterr().err):  # type: ignore[attr-defined]
        assert not set("\x1b\x07\x08\x9b\x7f\r\u202e\u200b\u2028\u2066") & set(shown)
        assert r"\x1b[31mred\x1b]0;title" in shown and r"\x9b2J" in shown
