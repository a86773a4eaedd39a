"""Bags recorded, split, compressed or converted by rosbag2's tools give the same results as the original."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from marking import long
from mcap.writer import CompressionType
from rosbag2_bags import converted, numbered, out_of_order, recorded
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import CompressionMode

from hsv.bags.description import ROSOUT, TRANSIENT_LOCAL, resolved
from hsv.bags.reader import Bag

REFERENCE = Path(__file__).parents[2] / "bags" / "reference" / "case1"
TIMELESS = ("custom_data", "ending", "faults", "saturation", "tube", "messages", "metrics", "metrics_complete")
"""Output of ``hsv info`` that does not depend on the reception times of messages without a stamp."""


def _reindexed(path):
    """Copy the original without its metadata.yaml; reindex makes a new one from the MCAP file."""
    shutil.copytree(REFERENCE, path)
    (path / "metadata.yaml").unlink()
    return path


FORMS = {
    "split": lambda path: recorded(REFERENCE, path, files=3, begin=None),
    "split, zstd by file": lambda path: recorded(REFERENCE, path, files=2, begin=None, compressed="file zstd"),
    "lz4 by message": lambda path: recorded(REFERENCE, path, begin=None, compressed="message lz4"),
    "lz4 chunks": lambda path: recorded(REFERENCE, path, begin=None, chunks=CompressionType.LZ4),
    "zstd by file": lambda path: converted(REFERENCE, path, CompressionMode.FILE),
    "zstd by message": lambda path: converted(REFERENCE, path, CompressionMode.MESSAGE),
    "converted": lambda path: converted(REFERENCE, path),
    "reindexed": _reindexed,
}


QUICK = ("split, zstd by file", "lz4 by message")
"""The forms that are read in make test; the long run reads all."""


@pytest.mark.parametrize("form", [form if form in QUICK else long(form) for form in FORMS])
def test_every_form_gives_what_the_original_gives(hsv, tmp_path, form):
    original, path = Bag(REFERENCE), FORMS[form](tmp_path / "given")
    bag = Bag(path)
    assert bag.complete and not bag.loss
    assert bag.topics.keys() == original.topics.keys()
    for topic in original.topics:
        assert bag.topics[topic].type == original.topics[topic].type
        assert bag.messages(topic) == original.messages(topic)
    ran, expected = hsv("info", str(path), "--json"), hsv("info", str(REFERENCE), "--json")
    assert ran.code == 0 and ran.err == ""
    theirs, ours = expected.json, ran.json
    attached = bool(bag.attachments)
    for said in (theirs, ours):
        for name in ("path", "folder", *(() if attached else ("attachments", "not_covered"))):
            del said[name]
    if not original.custom_data.items() <= bag.custom_data.items():
        assert form.startswith(("converted", "zstd by"))  # rosbags keeps no custom data
        for name in ("custom_data", "as_published"):  # the scenario is in the custom data
            ours[name] = theirs[name]
    assert ours == theirs


@pytest.mark.parametrize(
    "form",
    [
        {"begin": 2**63 - 10**10},
        *map(long, ({}, {"stored": out_of_order}, {"qos": numbered}, {"qos": lambda profiles: []})),
    ],
    ids=["more than signed integers hold", "wall time", "out of order", "numbered profiles", "no profiles"],
)
def test_wall_clock_log_times_change_nothing(hsv, tmp_path, form):
    path = recorded(REFERENCE, tmp_path / "wall", files=2, **form)
    ran, expected = hsv("info", str(path), "--json"), hsv("info", str(REFERENCE), "--json")
    assert ran.code == 0 and ran.err == ""
    for name in TIMELESS:
        assert ran.json[name] == expected.json[name], name
    assert ran.json["metrics"]["post_fault_attitude_deviation_rad"] > 0.0
    assert ran.json["duration_s"] == expected.json["duration_s"]
    assert ran.json["faults"][0]["start_s"] == 20.0
    same = hsv("diff", str(REFERENCE), str(path))
    assert same.code == 0 and same.out.endswith("messages: identical\n")
    original, bag = Bag(REFERENCE), Bag(path)
    assert bag.complete
    for topic in original.topics:
        latched = topic in map(resolved, TRANSIENT_LOCAL)
        assert (bag.topics[topic].qos.durability is QosDurability.TRANSIENT_LOCAL) == latched or topic == ROSOUT, topic
        # Messages without a stamp get the time of the previous message, whose step may be the one before.
        assert np.abs(bag.times(topic) - original.times(topic)).max(initial=0) <= 20_000_000, topic


@pytest.mark.long
@pytest.mark.filterwarnings("error")
def test_log_times_that_roll_over_are_out_of_order_and_change_no_metric(hsv, tmp_path):
    path = recorded(REFERENCE, tmp_path / "rolled", begin=2**64 - 10**10)
    ran = hsv("info", str(path), "--json")
    assert ran.code == 0
    assert (
        ran.err.startswith(f"hsv: warning: {path / 'rolled_0.mcap'}: /clock is out of order")
        and ran.err.count("\n") == 1
    )
    assert ran.json["metrics"] == hsv("info", str(REFERENCE), "--json").json["metrics"]


def test_a_fifth_of_the_steps_is_missing(hsv, tmp_path):
    lost = {int(step) for step in np.random.default_rng(3).choice(2001, 400, replace=False)}
    period = 20_000_000
    path = recorded(
        REFERENCE,
        tmp_path / "lossy",
        stored=lambda messages: [
            row
            for row, (topic, time) in enumerate(messages)
            if not topic.startswith(("/hsv/", "/clock"))
            or topic in ("/hsv/run", "/hsv/ready")
            or time // period not in lost
        ],
    )
    said = f"lacks 400 of 2001 steps on all topics, the first at t = {min(lost) * 0.02:.2f} s"
    for command, *words in (
        ("report", "--out", "out.html"),
        ("plot", "--out", "out.svg"),
        ("export", "--csv", "--out", "tables"),
        ("diff", str(REFERENCE)),
    ):
        ran = hsv(command, str(path), *words)
        assert ran.code == (command == "diff"), command
        assert said in ran.err, command
    assert f"first difference at t = {min(lost) * 0.02:.2f} s: step {min(lost)} " in ran.out
    assert f"{9 * 1601} messages of the same steps are compared, and they are equal" in ran.out
    ran = hsv("info", str(path))
    out = " ".join(ran.out.split())
    assert said in ran.err and said in out and "Metrics of an incomplete bag: 1601 of 2001 steps" in out
    report = hsv("info", str(path), "--json").json
    assert not report["metrics_complete"] and said in report["warnings"]
    page = (tmp_path / "out.html").read_text()
    assert said in page and page.count("incomplete: 1601 of 2001 steps") >= 2
    assert "within all" not in page or "in what is recorded" in page
    assert "lacks 400 of 2001 steps" in " ".join(
        (tmp_path / "out.svg").read_text().replace("-->", "<!--").split("<!--")
    )
    assert said in (tmp_path / "tables" / "incomplete.txt").read_text()


def test_a_missing_file_is_named_and_counted(hsv, tmp_path):
    path = recorded(REFERENCE, tmp_path / "part", files=4)
    (path / "part_2.mcap").unlink()
    ran = hsv("info", str(path))
    assert ran.code == 0 and "lacks its file part_2.mcap" in ran.err and "steps on all topics" in ran.err
    (path / "metadata.yaml").unlink()
    assert "lacks its file part_2.mcap" in hsv("info", str(path)).err
    made = hsv("recover", str(path))
    assert made.code == 0 and "lacks its file part_2.mcap" in made.out and " s lost: " in made.out
    shutil.copy(path / "part_0.mcap", path / "other_0.mcap")
    assert "of 2 bags, expected a bag directory" in hsv("info", str(path)).error


@pytest.mark.long
def test_what_needs_attachments_takes_scenario_and_design(hsv, tmp_path):
    path = recorded(REFERENCE, tmp_path / "bare")
    ran = hsv("replay", str(path))
    assert ran.code == 2 and "no attachment design.yaml" in ran.error and "--scenario NAME|FILE" in ran.error
    scenario = str(REFERENCE.with_suffix(".toml"))
    design = tmp_path / "flown.yaml"
    design.write_bytes(Bag(REFERENCE).attachments["design.yaml"])
    given = hsv("replay", str(path), "--node", "notch_filter", "--scenario", scenario, "--design", str(design))
    assert given.code == 0 and given.out.startswith("notch_filter          2001 messages")
    for words, name in ((["--scenario", "nosuch"], "nosuch"), (["--design", "nosuch.yaml"], "nosuch.yaml")):
        refused = hsv("replay", str(path), *words)
        assert refused.code == 2 and name in refused.error
    assert hsv("report", str(path), "--out", "bare.html").code == 0
    assert "--scenario gives one" in (tmp_path / "bare.html").read_text()
    assert hsv("report", str(path), "--out", "given.html", "--scenario", "case1").code == 0
    assert "no limits to judge by" not in (tmp_path / "given.html").read_text()
