"""A run of the bench held against a recorded one."""

import json

import pytest

from hsv.base.errors import QuantityError
from hsv.bench.figure import Figure
from hsv.bench.record import as_json, changes, not_measured, read_run


def ratio(*ours):
    return Figure("graph", "ours", "theirs", "s", ours, (1.0,) * len(ours))


def rate(*ours):
    return Figure("pace", "ours", "", "x real time", ours, bound="least", limit=1.0)


def recorded(folder, *figures, **changed):
    path = folder / "run.json"
    path.write_text(json.dumps(as_json({"laps": figures}, {}) | changed))
    return read_run(path)


@pytest.mark.parametrize(
    ("before", "after", "slower"),
    [
        (ratio(1.0, 1.02), ratio(1.2, 1.22), 1.21 / 1.01 - 1.0),
        (ratio(1.2, 1.22), ratio(1.0, 1.02), 1.01 / 1.21 - 1.0),
        (rate(12.0, 12.2), rate(10.0, 10.2), 12.1 / 10.1 - 1.0),
        # Within the resolution, and within the spreads.
        (ratio(1.0, 1.0), ratio(1.04, 1.04), 0.0),
        (ratio(0.8, 1.0, 1.3), ratio(1.1, 1.2, 1.4), 0.0),
    ],
)
def test_what_became_slower_or_faster_is_told(tmp_path, before, after, slower):
    [change] = changes([after], recorded(tmp_path, before))
    assert change.slower == pytest.approx(slower)
    assert change.before == before.median


def test_only_ratios_are_held_against_other_hardware(tmp_path):
    run = recorded(tmp_path, ratio(1.0), rate(10.0), hardware="another")
    assert [change.figure.name for change in changes([ratio(2.0), rate(5.0)], run)] == ["graph"]


def test_what_was_not_measured_before_is_left_out(tmp_path):
    assert changes([rate(5.0)], recorded(tmp_path, ratio(1.0))) == []


@pytest.mark.parametrize(
    ("only", "names"), [(None, ["pace"]), (("laps",), ["pace"]), (("laps", "other"), ["pace"]), (("other",), [])]
)
def test_what_was_measured_before_only_is_named_where_its_group_was_asked_for(tmp_path, only, names):
    run = recorded(tmp_path, ratio(1.0), rate(10.0))
    assert not_measured([ratio(1.0)], run, only) == names


def test_a_run_of_an_earlier_version_has_no_groups(tmp_path):
    old = as_json({"laps": [rate(10.0)]}, {})
    for figure in old["figures"]:
        del figure["group"]
    run = recorded(tmp_path, **old)
    assert not_measured([], run, None) == ["pace"]
    assert not_measured([], run, ("laps",)) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot be read"),
        ("{", "Expecting property name"),
        ("[]", "all of it: "),
        ('{"commit": "a", "hardware": "b", "figures": [{"name": "graph"}]}', "figures.0.spread: Field required"),
    ],
)
def test_what_is_no_run_is_refused(tmp_path, text, message):
    path = tmp_path / "run.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(QuantityError, match=message) as refused:
        read_run(path)
    assert str(refused.value).endswith("expected the output of hsv bench --json")
