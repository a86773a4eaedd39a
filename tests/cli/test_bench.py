import json

import pytest

from hsv.base.errors import RunError
from hsv.bench.figure import Figure


def test_bench_measures_the_groups_it_is_asked_for(hsv):
    ran = hsv("bench", "--only", "in_process", "--scale", "0.05", "--json")
    assert ran.code == 0
    figures = {figure["name"]: figure for figure in ran.json["figures"]}
    assert figures["in_process"]["limit"] == 1.3
    assert figures["in_process"]["ratio"] > 0.5
    assert len(figures["in_process"]["ours"]) == len(figures["in_process"]["theirs"]) == 2


def test_bench_names_an_unknown_group(hsv):
    ran = hsv("bench", "--only", "everything")
    assert ran.code == 2
    assert "only = 'everything'" in ran.error


def test_a_part_does_not_replace_the_table_of_a_whole_run(hsv, tmp_path):
    ran = hsv("bench", "--only", "mcap", "--out", tmp_path / "page.md")
    assert ran.code == 2
    assert "expected no --only" in ran.error


def test_a_run_is_held_against_one_that_was_kept(hsv, tmp_path):
    words = ("bench", "--only", "in_process", "--scale", "0.05")
    kept = hsv(*words, "--json").json
    # Of a machine on which the loop was twice as fast beside C.
    for figure in kept["figures"]:
        figure["ratio"], figure["spread"] = figure["ratio"] / 2.0, [value / 2.0 for value in figure["spread"]]
    path = tmp_path / "before.json"
    path.write_text(json.dumps(kept))
    ran = hsv(*words, "--compare", path)
    assert ran.code == 1
    assert "SLOWER by" in ran.out and "as before: 0 of 1" in ran.out
    assert hsv(*words, "--compare", tmp_path / "none.json").code == 2


@pytest.fixture
def small_groups(monkeypatch):
    """Let the bench have three groups: one that is measured, one that fails, one that is not installed."""

    def fails():
        raise RunError("domain 7: in use")

    quick = Figure("quick", "ours", "", "s", (1.0,))
    groups = {"quick": lambda: [quick], "graph": fails, "jsbsim": list}
    monkeypatch.setattr("hsv.bench.suite.groups", lambda scale: groups)


@pytest.mark.parametrize(
    ("group", "reason"), [("graph", "domain 7: in use"), ("jsbsim", "not installed")], ids=["fails", "lacks"]
)
@pytest.mark.parametrize("json_output", [(), ("--json",)])
def test_a_group_that_was_asked_for_and_cannot_be_measured_is_an_error(hsv, small_groups, group, reason, json_output):
    ran = hsv("bench", "--only", group, "--only", "quick", *json_output)
    assert ran.code == 1
    assert ran.err.splitlines()[-1] == f"hsv: error: only = {group!r}: not measured: {reason}"
    assert "1 s" in ran.out or ran.json["skipped"] == {group: reason}


def test_a_whole_run_does_without_what_is_not_there(hsv, small_groups):
    ran = hsv("bench")
    assert ran.code == 0
    assert "graph: not measured: domain 7: in use" in ran.err and "jsbsim: not measured: not installed" in ran.err


def test_what_was_recorded_and_is_not_measured_is_listed(hsv, small_groups, tmp_path):
    kept = hsv("bench", "--json").json
    lost = [{"name": "lap", "group": "graph", "spread": [1.0, 1.0], "ratio": 1.0}]
    path = tmp_path / "before.json"
    path.write_text(json.dumps(kept | {"figures": kept["figures"] + lost}))
    for words, listed in (((), True), (("--only", "graph"), True), (("--only", "quick"), False)):
        ran = hsv("bench", *words, "--compare", path)
        assert ("recorded there, not measured here: lap" in ran.out) == listed
        absent = hsv("bench", *words, "--compare", path, "--json").json["recorded_but_not_measured"]
        assert absent == ["lap"] * listed
