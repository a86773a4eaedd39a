"""The tutorial's pages, typed from top to bottom as a newcomer would: their output, files and pictures."""

import doctest
import re

import pytest
from node_processes import Processes
from page_blocks import ROOT, blocks
from ros_domain import own_environment

PAGES = {
    "first_flight": pytest.mark.long,
    "own_scenario": pytest.mark.long,
    "own_fault": pytest.mark.long,
    "own_controller": pytest.mark.long,
    "reading_a_bag": pytest.mark.long,
    "campaign": pytest.mark.long,
    "comparison": pytest.mark.long,
}
"""The pages with their marks. Those that fly over DDS or many flights take longer than all others together."""

READ = ("offline_design", "src")
"""Folders of the checkout that the pages read."""

OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
MARK = "=== block "


def test_every_page_of_the_tutorial_is_typed():
    assert {page.stem for page in (ROOT / "docs" / "tutorial").glob("*.md")} == {*PAGES}


@pytest.mark.parametrize("page", [pytest.param(page, marks=marks) for page, marks in PAGES.items()])
def test_the_page_does_what_it_says(page, tmp_path, pictures):
    for name in READ:
        (tmp_path / name).symlink_to(ROOT / name)
    steps = blocks(f"docs/tutorial/{page}.md")
    assert {step.language for step in steps} <= {"sh", "text", "toml", "python"}
    script = ["set -m"]  # as in a terminal: background processes receive interrupts
    for number, step in enumerate(steps):
        if step.language == "sh":
            # A page may be read first or in a new terminal; here the environment is already set.
            commands = step.text.replace("source env.sh\n", "")
            script.append(f"echo '{MARK}{number}'\n{commands}")
        elif step.language in ("toml", "python"):
            assert step.file, f"no name of a file in the first line: {step.text}"
            target = tmp_path / step.file
            target.parent.mkdir(exist_ok=True)
            target.write_text(step.text, encoding="utf-8")
    with own_environment() as environment:
        processes = Processes(environment | {"MPLBACKEND": "agg", "COLUMNS": "80"}, tmp_path)
        done = processes.run("bash", "-e", "-c", "\n".join(script))
        processes.stop()
    assert done.returncode == 0, done.stdout
    printed = dict(re.findall(rf"^{MARK}(\d+)\n(.*?)(?=^{MARK}|\Z)", done.stdout, re.DOTALL | re.MULTILINE))
    for number, step in enumerate(steps):
        if step.language == "text":
            assert steps[number - 1].language == "sh", step.text
            said = printed[str(number - 1)]
            assert doctest.OutputChecker().check_output(step.text, said, OPTIONS), f"{step.text}is not\n{said}"
    text = (ROOT / "docs" / "tutorial" / f"{page}.md").read_text(encoding="utf-8")
    for shown in re.findall(r"!\[.*?\]\(\.\./images/(.*?\.png)\)", text, re.DOTALL):
        assert (tmp_path / shown).stat().st_size > 10_000
        (pictures / shown).parent.mkdir(exist_ok=True)
        (pictures / shown).write_bytes((tmp_path / shown).read_bytes())
