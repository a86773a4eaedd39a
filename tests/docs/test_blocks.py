"""Command blocks of pages run as one script, and scenario blocks of pages are valid scenarios."""

import re

import pytest
from node_processes import Processes
from page_blocks import ROOT, blocks, indented
from ros_domain import own_environment

from hsv.flight.scenario import load_scenario, scenario_at_means, scenario_table, scenario_text

HERE = {
    "docs/assumptions.md": (),
    "docs/explanation/certificates.md": (),
    "docs/governor.md": (),
    "docs/hardware.md": (),
    "docs/montecarlo.md": (),
    "docs/python.md": (
        "cp -rL examples/lqr lqr",
        "pip install --quiet --no-deps --no-index --no-build-isolation --target site ./lqr",
        "export PYTHONPATH=$PWD/site:$PYTHONPATH",
    ),
    "docs/replay.md": (
        "hsv run case1 --bag BAG --no-report",
        "cp offline_design/baseline.yaml new.yaml",
        "cp offline_design/baseline.yaml my.yaml",
        "cp src/hsv/hsv/flight/scenarios/case1.toml my.toml",
    ),
    "docs/vehicle.md": (),
    "offline_design/README.md": (),
}
"""Pages whose commands run as one script, with the set-up that they need."""

FEWER = {"--samples 10000 ": "--samples 20 ", "--samples 4096 ": "--samples 16 "}
"""Reduced numbers of flights for campaigns that would take many minutes with the page's number."""

NEGATIVE = ("hsv run case1_derived_no_notch", "hsv certify")
"""Commands that end with exit code 1, as their page says: the flight diverges, or not all is certified."""

SCENARIOS = {
    ("docs/scenarios.md", 'extends = "case1"'),
    ("docs/scenarios.md", "[[command]]"),
    ("docs/scenarios.md", "[sensors]"),
    ("docs/montecarlo.md", 'extends = "case1"'),
}
"""Blocks that are scenarios, or parts that can be added to Case 1."""

PLAYER = "ros2 run hsv_bringup player BAG --rate 5 --topics /hsv/state /hsv/nominal"
"""A command that waits for nodes and is not run here; tests/graph/test_player.py runs the player."""


def all_blocks(page):
    """Return the code blocks of a page, except directives of the site generator."""
    return [block for block in blocks(page) + indented(page) if not block.language.startswith("{")]


def is_commands(block):
    """Return whether a block without a language consists of commands."""
    return (
        block.language in ("", "sh")
        and re.match(r"(cd|cp|hsv|make|mkdir|npm|pip|ros2|source|sudo|python3) ", block.text) is not None
    )


@pytest.mark.parametrize(("page", "first_line"), sorted(SCENARIOS))
def test_scenarios_on_pages_are_scenarios(page, first_line, tmp_path):
    [block] = [block for block in all_blocks(page) if block.first_line == first_line]
    path = tmp_path / "printed.toml"
    path.write_text(block.text if "extends" in block.text else f'extends = "case1"\n{block.text}', encoding="utf-8")
    scenario, drawn = scenario_at_means(scenario_table(scenario_text(str(path)), "printed"), "printed")
    assert scenario != load_scenario("case1")
    assert bool(drawn) == ("uniform" in block.text)


@pytest.mark.long
@pytest.mark.parametrize("page", sorted(HERE))
def test_commands_of_the_page_run(page, tmp_path):
    for name in ("offline_design", "src", "examples", "tools"):
        (tmp_path / name).symlink_to(ROOT / name)
    for block in all_blocks(page):
        if block.file:
            (tmp_path / block.file).write_text(block.text, encoding="utf-8")
    script = [*HERE[page]]
    script += [block.text for block in all_blocks(page) if is_commands(block) and block.first_line != PLAYER]
    text = "\n".join(script)
    if page == "docs/hardware.md":  # fault blocks need a flight, and a certificate takes minutes
        text = re.sub(r"^hsv (fault|certify) .*", "", text, flags=re.MULTILINE)
    for more, fewer in FEWER.items():
        text = text.replace(more, fewer)
    for command in NEGATIVE:
        text = re.sub(rf"^{command}\b.*", r"if \g<0>\nthen exit 9; else [ $? = 1 ]; fi", text, flags=re.MULTILINE)
    with own_environment() as environment:
        processes = Processes(environment, tmp_path)
        done = processes.run("bash", "-e", "-x", "-c", text)
        processes.stop()
    assert done.returncode == 0, done.stdout
