"""Every block of code on every page is run by a test as it stands, or named here with the reason why not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from node_processes import Processes
from page_blocks import PAGES, ROOT, Block, blocks, indented
from ros_domain import own_environment

from hsv.flight.scenario import load_scenario, scenario_at_means, scenario_table, scenario_text

WHOLE = {
    **{page: "tests/docs/test_tutorial.py" for page in PAGES if page.startswith("docs/tutorial/")},
    **{page: "tests/examples/test_own_controllers.py" for page in PAGES if page.startswith("examples/")},
    "docs/c_controllers.md": "tests/examples/test_own_controllers.py",
    "docs/export.md": "tests/control/test_export.py",
    "docs/core.md": "tests/docs/test_code_blocks.py",
    "docs/explanation/notch.md": "tests/docs/test_code_blocks.py",
    "docs/hardware.md": "tests/docs/test_code_blocks.py",
    "docs/hosts.md": "tests/graph/test_hosts.py",
    "docs/vehicle.md": "tests/docs/test_code_blocks.py",
    "examples/cpp_node/README.md": "tests/graph/test_full_installation.py",
    "examples/node/README.md": "tests/graph/test_own_controllers.py",
}
"""Pages of which another file runs every block."""

HERE = {
    "docs/assumptions.md": (),
    "docs/explanation/certificates.md": (),
    "docs/governor.md": (),
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
    "offline_design/README.md": (),
}
"""Pages whose commands this file runs as one script, with what it needs before."""

FEWER = {"--samples 10000 ": "--samples 20 ", "--samples 4096 ": "--samples 16 "}
"""Campaigns that are flown with fewer flights than on the page, which would take many minutes."""

NEGATIVE = ("hsv run case1_derived_no_notch", "hsv certify")
"""Commands that end with exit code 1, as their page says: the flight diverges, the design is not certified with all."""

SCENARIOS = {
    ("docs/scenarios.md", 'extends = "case1"'),
    ("docs/scenarios.md", "[[command]]"),
    ("docs/scenarios.md", "[sensors]"),
    ("docs/montecarlo.md", 'extends = "case1"'),
}
"""Blocks that are scenarios, or what of one may be added to Case 1."""

ELSEWHERE = {
    ("README.md", "v1:0669d52ede9cf309349ec3729d9c4c7160e4c8f9d681081827ea43f18398a596"): "tests/docs/test_tutorial.py",
    ("README.md", "# mine.py"): "tests/docs/test_code_blocks.py",
    ("README.md", "# mine.toml"): "tests/docs/test_code_blocks.py",
    ("CONTRIBUTING.md", "python3 tools/release.py 1.2.0"): "tests/tools/test_release.py",
    ("docs/airframe.md", "vehicle_carried                  moves with the centre of gravity, stays level"): (
        "tests/graph/test_airframe.py"
    ),
    ("docs/airframe.md", "ros2 run hsv_bringup airframe --ros-args -p exaggeration:=20.0 -p rate:=50.0"): (
        "tests/graph/test_airframe.py"
    ),
    ("docs/benchmarks.md", "hsv bench --json > before.json"): "tests/cli/test_bench.py",
    ("docs/figures/index.md", "hsv-paper figures --out docs/figures"): "tests/hsv_paper/test_figures.py",
    ("docs/installation.md", "$ python3 -m venv venv"): "tests/packaging/test_wheel.py",
    ("docs/installation.md", "from launch import LaunchDescription"): "tests/graph/test_full_installation.py",
    ("docs/live.md", "hsv run case1 --live"): "tests/graph/test_live.py",
    ("docs/live.md", "live: live page: http://127.0.0.1:8766/#token=..."): "tests/graph/test_live.py",
    ("docs/live.md", "ros2 run hsv_bringup live"): "tests/graph/test_live.py",
    ("docs/replay.md", "ros2 run hsv_bringup player BAG --rate 5 --topics /hsv/state /hsv/nominal"): (
        "tests/graph/test_player.py"
    ),
    ("docs/resilience.md", "hsv resilience"): "tests/cli/test_resilience.py",
}
"""Blocks that another file runs, in some form."""

NPM = "npm install --prefix tests/viewers/npm --save-exact plotly.js-basic-dist-min@VERSION"

NOT_RUN = {
    ("CONTRIBUTING.md", "make setup"): "sets up what the tests run in",
    ("CONTRIBUTING.md", "python3 -m pytest tests/core -q"): "make test runs that folder",
    ("README.md", "flowchart LR"): "a diagram",
    ("docs/installation.md", "$ docker build --tag hsv-bench ."): "needs Docker",
    ("src/hsv/hsv/pages/plotly/README.md", NPM): "how a file of the repository was fetched",
    (
        "docs/montecarlo.md",
        ".venv/bin/dask ssh --nthreads 1 --nworkers 8 scheduler-host worker-1 worker-2",
    ): "needs other machines",
    ("docs/montecarlo.md", ".venv/bin/dask scheduler"): "needs other machines",
}
"""Blocks that no test can run here, and why."""

COMMANDS = ("README.md", "docs/graph.md", "docs/installation.md", "docs/reference/commands.md")
"""Pages of which tests/docs/test_printed_commands.py accounts for every command."""


def all_blocks(page: str) -> list[Block]:
    """Return the blocks of a page but those that are directives of the site."""
    return [block for block in blocks(page) + indented(page) if not block.language.startswith("{")]


def is_commands(block: Block) -> bool:
    """Tell whether a block without a language is one of commands."""
    return (
        block.language in ("", "sh")
        and re.match(r"(cd|cp|hsv|make|mkdir|npm|pip|ros2|source|sudo|python3) ", block.text) is not None
    )


def accounts(page: str, block: Block) -> list[str]:
    """Return where a block is accounted for."""
    key = (page, block.first_line)
    found = [f"WHOLE: {WHOLE[page]}"] if page in WHOLE else []
    found += [
        name
        for name, table in (("SCENARIOS", SCENARIOS), ("ELSEWHERE", ELSEWHERE), ("NOT_RUN", NOT_RUN))
        if key in table
    ]
    if page in COMMANDS and is_commands(block):
        found.append("COMMANDS")
    if page == "docs/python.md" and block.language == "python":
        found.append("tests/docs/test_code_blocks.py")
    if page in HERE and is_commands(block) and not found:
        found.append("HERE")
    return found


@pytest.mark.parametrize("page", [page for page in PAGES if all_blocks(page)])
def test_every_block_is_run_or_named(page: str) -> None:
    for block in all_blocks(page):
        assert len(accounts(page, block)) == 1, f"{page}: {block.first_line!r}: {accounts(page, block)}"


def test_what_is_named_is_there() -> None:
    there = {(page, block.first_line) for page in PAGES for block in all_blocks(page)}
    assert there >= {*SCENARIOS, *ELSEWHERE, *NOT_RUN}
    assert {page for page, _ in there} >= {*WHOLE, *HERE}
    assert all((ROOT / file).is_file() for file in (*WHOLE.values(), *ELSEWHERE.values()))
    text = "".join(block.text for page in HERE for block in all_blocks(page))
    assert all(words in text for words in (*FEWER, *NEGATIVE))


@pytest.mark.parametrize(("page", "first_line"), sorted(SCENARIOS))
def test_scenarios_on_pages_are_scenarios(page: str, first_line: str, tmp_path: Path) -> None:
    [block] = [block for block in all_blocks(page) if block.first_line == first_line]
    path = tmp_path / "printed.toml"
    path.write_text(block.text if "extends" in block.text else f'extends = "case1"\n{block.text}', encoding="utf-8")
    scenario, drawn = scenario_at_means(scenario_table(scenario_text(str(path)), "printed"), "printed")
    assert scenario != load_scenario("case1")
    assert bool(drawn) == ("uniform" in block.text)


@pytest.mark.long
@pytest.mark.parametrize("page", sorted(HERE))
def test_commands_of_the_page_run(page: str, tmp_path: Path) -> None:
    for name in ("offline_design", "src", "examples", "tools"):
        (tmp_path / name).symlink_to(ROOT / name)
    script = [*HERE[page]]
    script += [block.text for block in all_blocks(page) if accounts(page, block) == ["HERE"]]
    text = "\n".join(script)
    for more, fewer in FEWER.items():
        text = text.replace(more, fewer)
    for command in NEGATIVE:
        text = re.sub(rf"^{command}\b.*", r"if \g<0>\nthen exit 9; else [ $? = 1 ]; fi", text, flags=re.MULTILINE)
    with own_environment() as environment:
        processes = Processes(environment, tmp_path)
        done = processes.run("bash", "-e", "-x", "-c", text)
        processes.stop()
    assert done.returncode == 0, done.stdout
