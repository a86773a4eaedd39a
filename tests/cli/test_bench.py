import json

import pytest

from hsv.base.errors import RunError
from hsv.cli.bench.figure import Figure


@pytest.mark.long
def test_the_groups_that_were_asked_for_are_measured_and_held_against_a_recorded_run(hsv, tmp_path):
    words = ("bench", "--only", "in_process", "--scale", "0.05")
    kept = hsv(*words, "--json").json
    [figure] = kept["figures"]
    assert figure["name"] == "in_process" and figure["limit"] == 1.3 and figure["ratio"] > 0.5
    assert figure["note"] == "the same bits"
    assert len(figure["ours"]) == len(figure["theirs"]) == 2
    # Of a machine on which the loop was twice as fast beside C.
    figure["ratio"], figure["spread"] = figure["ratio"] / 2.0, [value / 2.0 for value in figure["spread"]]
    path = tmp_path / "before.json"
    path.write_text(json.dumps(kept))
    ran = hsv(*words, "--compare", path)
    assert ran.code == 1
    assert "SLOWER by" in ran.out and "as before: 0 of 1" in ran.out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--only", "everything"), "only = 'everything': expected one of"),
        (("--compare", "none.json"), "compare = 'none.json'"),
        (("--scale", "0"), "scale = 0.0: expected above 0"),
    ],
)
def test_wrong_options_are_refused(hsv, words, message):
    ran = hsv("bench", *words)
    assert ran.code == 2
    assert message in ran.error


@pytest.fixture
def small_groups(monkeypatch):
    """Let the bench have two groups: one that is measured, one that fails."""

    def fails():
        raise RunError("domain 7: in use")

    quick = Figure("quick", "ours", "theirs", (1.0,), (2.0,), 1.0)
    monkeypatch.setattr("hsv.cli.bench.measure.groups", lambda scale: {"quick": lambda: [quick], "graph": fails})


@pytest.mark.parametrize("json_output", [(), ("--json",)])
def test_a_group_that_was_asked_for_and_cannot_be_measured_is_an_error(hsv, small_groups, json_output):
    ran = hsv("bench", "--only", "graph", "--only", "quick", *json_output)
    assert ran.code == 1
    assert ran.err.splitlines()[-1] == "hsv: error: only = 'graph': not measured: domain 7: in use"
    assert "1 s against 2 s of theirs: ratio 0.5" in ran.out or ran.json["skipped"] == {"graph": "domain 7: in use"}


def test_a_complete_run_names_the_groups_that_are_missing(hsv, small_groups, tmp_path):
    ran = hsv("bench")
    assert ran.code == 0
    assert "graph: not measured: domain 7: in use" in ran.err
    kept = hsv("bench", "--json").json
    lost = [{"name": "lap", "group": "graph", "spread": [1.0, 1.0], "ratio": 1.0}]
    path = tmp_path / "before.json"
    path.write_text(json.dumps(kept | {"figures": kept["figures"] + lost}))
    for words, listed in (((), True), (("--only", "graph"), True), (("--only", "quick"), False)):
        ran = hsv("bench", *words, "--compare", path)
        assert ("recorded there, not measured here: lap" in ran.out) == listed
        absent = hsv("bench", *words, "--compare", path, "--json").json["recorded_but_not_measured"]
        assert absent == ["lap"] * listed
