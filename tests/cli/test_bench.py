"""The ratios of the bench."""

import pytest
from ros_domain import own_domain

from hsv.base.errors import RunError
from hsv.cli.bench import Figure, graph_lap, ring_lap


@pytest.mark.long
def test_the_groups_that_were_asked_for_are_measured(hsv):
    words = ("bench", "--only", "in_process", "--only", "startup", "--scale", "0.05")
    figure, *startup = hsv(*words, "--json").json["figures"]
    assert figure["name"] == "in_process" and figure["limit"] == 1.3 and figure["ratio"] > 0.5
    assert figure["note"] == "the same bits" and len(figure["ours"]) == len(figure["theirs"]) == 2
    assert [each["name"] for each in startup] == ["startup_help", "startup_simulate"]


@pytest.mark.long
@pytest.mark.graph
def test_laps_of_the_ring_and_of_the_graph(monkeypatch):
    with own_domain() as number:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        assert ring_lap(100) > 0.0 and graph_lap(2.0) > 0.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--only", "everything"), "only = 'everything': expected one of"),
        (("--scale", "0"), "scale = 0.0: expected above 0"),
    ],
)
def test_wrong_options_are_refused(hsv, words, message):
    ran = hsv("bench", *words)
    assert ran.code == 2 and message in ran.error


def figure(*ours, theirs=None):
    return Figure("graph", "ours", "theirs", ours, theirs or (1.0,) * len(ours), limit=1.5)


def test_ratios_are_taken_pair_by_pair_and_judged_by_the_limit():
    measured = figure(2.0, 6.0, 4.0, theirs=(1.0, 2.0, 4.0))
    assert measured.ratio == 2.0 and measured.spread == pytest.approx((1.2, 2.8))
    assert (figure(1.4).verdict, figure(1.6).verdict) == (
        "at most 1.5, as promised",
        "WORSE than the limit, at most 1.5",
    )


def test_a_ratio_above_its_limit_is_an_error(hsv, monkeypatch):
    monkeypatch.setattr("hsv.cli.bench.groups", lambda scale: {"graph": lambda: [figure(1.4), figure(1.6)]})
    for words in ((), ("--json",)):
        ran = hsv("bench", *words)
        assert ran.code == 1 and ran.error == "graph 1.6, WORSE than the limit, at most 1.5"
    monkeypatch.setattr("hsv.cli.bench.groups", lambda scale: {"graph": lambda: [figure(1.4)]})
    assert hsv("bench").code == 0


def test_a_group_that_cannot_be_measured_is_named_and_is_an_error_if_asked_for(hsv, monkeypatch):
    def fails():
        raise RunError("domain 7: in use")

    quick = Figure("quick", "ours", "theirs", (1.0,), (2.0,), 1.0)
    monkeypatch.setattr("hsv.cli.bench.groups", lambda scale: {"quick": lambda: [quick], "graph": fails})
    ran = hsv("bench", "--only", "graph", "--only", "quick")
    assert ran.code == 1 and "1 s against 2 s of theirs: ratio 0.5" in ran.out
    assert ran.err.splitlines()[-1] == "hsv: error: only = 'graph': not measured: domain 7: in use"
    ran = hsv("bench", "--json")
    assert ran.code == 0 and ran.json["skipped"] == {"graph": "domain 7: in use"}
