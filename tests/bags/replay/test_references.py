"""The present code computes what the committed reference bags have recorded."""

from pathlib import Path

import pytest

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import controller_of, flown_parameters, refuse_vacuous
from hsv.bags.replay.engine import processes_of, replay, rerun
from hsv.flight.scenario import load_scenario

ROOT = Path(__file__).parents[3]
REFERENCES = ROOT / "bags" / "reference"
SCENARIOS = sorted(REFERENCES.glob("*.toml"))


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_reference_is_its_scenario_shortened(path):
    short, whole = load_scenario(str(path)).parameters(), load_scenario(path.stem).parameters()
    changed = {name for name in short.keys() | whole.keys() if short.get(name) != whole.get(name)}
    assert changed <= {"duration", "fault.starts"}


@pytest.mark.reference
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_reference_bag_repeats(path):
    folder = path.with_suffix("")
    assert folder.is_dir(), f"{folder.relative_to(ROOT)}: no such bag; make references flies it"
    bag = Bag(folder)
    refuse_vacuous(bag)
    values = flown_parameters(bag)
    controller = controller_of(values)
    results = [replay(bag, process, values, lambda *_: None) for process in processes_of(controller).values()]
    results += rerun(bag, controller, values, lambda *_: None)
    differences = [f"{r.process.node.name}: {t.first}" for r in results for t in r.topics if t.first]
    assert not differences, (
        f"not what {folder.relative_to(ROOT)} recorded at commit {bag.custom_data['commit']}:\n"
        + "\n".join(differences)
        + "\nIf this is meant to change, accept it with: make references"
    )


@pytest.mark.reference
def test_references_are_small_and_name_their_commit():
    files = [path for scenario in SCENARIOS for path in scenario.with_suffix("").glob("*")]
    assert sum(path.stat().st_size for path in files) < 10_000_000
    for scenario in SCENARIOS:
        commit = Bag(scenario.with_suffix("")).custom_data["commit"]
        assert len(commit) == 40 and set(commit) <= set("0123456789abcdef")
