"""The ratios of the bench, and a run held against a recorded one."""

import json
import time

import pytest

from hsv.base.errors import QuantityError
from hsv.cli.bench.figure import Figure, interleaved
from hsv.cli.bench.record import as_json, changes, not_measured, read_run


def figure(*ours, theirs=None, name="graph"):
    return Figure(name, "ours", "theirs", ours, theirs or (1.0,) * len(ours), limit=1.5)


def recorded(folder, *figures):
    path = folder / "run.json"
    path.write_text(json.dumps(as_json({"laps": figures}, {})))
    return read_run(path)


def test_ratios_are_taken_pair_by_pair():
    measured = figure(2.0, 6.0, 4.0, theirs=(1.0, 2.0, 4.0))
    assert measured.ratio == 2.0
    assert measured.spread == pytest.approx((1.2, 2.8))


@pytest.mark.parametrize(
    ("value", "verdict"), [(1.4, "at most 1.5, as promised"), (1.6, "WORSE than the limit, at most 1.5")]
)
def test_a_ratio_is_compared_with_its_limit(value, verdict):
    assert figure(value).verdict == verdict


def test_the_two_sides_are_measured_alternately_and_the_first_pair_is_discarded():
    order = []
    ours, theirs = interleaved(lambda: order.append("a"), lambda: order.append("b"), 3, time.perf_counter)
    assert "".join(order) == "ab" * 4
    assert len(ours) == len(theirs) == 3


@pytest.mark.parametrize(
    ("before", "after", "slower"),
    [
        (figure(1.0, 1.02), figure(1.2, 1.22), 1.21 / 1.01 - 1.0),
        (figure(1.2, 1.22), figure(1.0, 1.02), 1.01 / 1.21 - 1.0),
        # Within the resolution, and within the spreads.
        (figure(1.0, 1.0), figure(1.04, 1.04), 0.0),
        (figure(0.8, 1.0, 1.3), figure(1.1, 1.2, 1.4), 0.0),
    ],
)
def test_a_change_beyond_the_spread_counts(tmp_path, before, after, slower):
    [change] = changes([after, figure(5.0, name="new")], recorded(tmp_path, before))
    assert change.slower == pytest.approx(slower)
    assert change.before == before.ratio


@pytest.mark.parametrize(("only", "names"), [(None, ["lost"]), (("laps", "other"), ["lost"]), (("other",), [])])
def test_a_recorded_figure_that_is_missing_is_named_where_its_group_is_measured(tmp_path, only, names):
    run = recorded(tmp_path, figure(1.0), figure(1.0, name="lost"))
    assert not_measured([figure(1.0)], run, only) == names


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot be read"),
        ("{", "Expecting property name"),
        ("[]", "all of it: "),
        ('{"commit": "a", "figures": [{"name": "graph", "group": "graph"}]}', "figures.0.spread: Field required"),
    ],
)
def test_a_file_that_is_no_run_is_refused(tmp_path, text, message):
    path = tmp_path / "run.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(QuantityError, match=message) as refused:
        read_run(path)
    assert str(refused.value).endswith("expected the output of hsv bench --json")
