"""The commands that launchers other than hsv run call before and after a flight."""

import tempfile
from pathlib import Path

import pytest
import yaml
from recorded_flight import record_flight

from hsv.bags.description import COMPOSED, EXIT_DIVERGED, graph
from hsv.bags.reader import Bag
from hsv.bags.recover import recover


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Return the folder in which temporary folders are created."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_prepare_tells_what_to_start_with_which_files(hsv, tmp_path, temporary):
    told = hsv(
        "prepare", "case1_rmpc", "--bag", "new/bag", "--folder", "files", "--real-time-factor", "2", "--json"
    ).json
    started = [(node["name"], node["package"], node["executable"]) for node in told["nodes"]]
    assert started == [(node.name, node.package, node.executable) for node in graph("robust_mpc")]
    assert [node["name"] for node in told["nodes"] if node["ends_run"]] == ["plant"]
    assert told["landed_exit_codes"] == [0, EXIT_DIVERGED] and told["last_step"] == 10_000
    values = {}
    for path in told["parameter_files"]:
        assert Path(path).parent == tmp_path / "files"
        values |= yaml.safe_load(Path(path).read_text())["/**"]["ros__parameters"]
    assert values["bag.directory"] == str(tmp_path / told["bag"]) and (tmp_path / told["bag"]).is_dir()
    assert values["real_time_factor"] == 2.0 and values["duration"] == 200.0 and values["controller"] == "robust_mpc"
    assert all(Path(path).is_file() for path in values["bag.attachments"])
    assert not list(temporary.iterdir())


def test_prepare_composed_names_one_process_and_a_command_for_people(hsv, temporary):
    lines = hsv("prepare", "case1", "--composed").out.splitlines()
    assert len(lines) == 2 and lines[1].startswith("bag bags/case1_")
    start = f"ros2 run {COMPOSED.package} {COMPOSED.executable} --ros-args --params-file {temporary}/hsv_run_"
    assert lines[0].startswith(start) and lines[0].count("--params-file") == 3
    assert len(list(temporary.iterdir())) == 1


def test_prepare_live_names_who_watches_and_keeps_the_pace_of_the_clock(hsv):
    told = hsv("prepare", "case1", "--live", "--live-port", "0", "--folder", "files", "--json").json
    first, *others = told["nodes"]
    assert (first["name"], first["in_flight"], first["ends_run"]) == ("live", False, False)
    assert all(node["in_flight"] for node in others) and [node["name"] for node in others][-1] == "plant"
    values = yaml.safe_load(Path(told["parameter_files"][-1]).read_text())["/**"]["ros__parameters"]
    assert values["real_time_factor"] == 1.0 and values["live.bag"] == told["bag"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["case1", "--live", "--live-port", "65535"], "live-port = 65535: expected 1 to 65534"),
        (["case1", "--real-time-factor", "nan"], "real-time-factor = nan: expected 0"),
        (["case1", "--step-timeout", "0"], "step-timeout = 0.0: expected at least 0.1"),
        (["case1", "--namespace", "1st"], "namespace = '1st': expected names of letters"),
        (["case1", "--bag", "."], "bag = '.': exists already"),
        (["case1", "--folder", "/dev/null/folder"], "folder = '/dev/null/folder': cannot be written"),
    ],
)
def test_what_prepare_refuses_leaves_nothing_behind(hsv, tmp_path, temporary, words, said):
    ran = hsv("prepare", *words)
    assert ran.code == 2 and said in ran.error
    assert not list(temporary.iterdir()) and list(tmp_path.iterdir()) == [temporary]


@pytest.fixture
def bag(tmp_path):
    record_flight(tmp_path / "flown", duration=10.0, fault=5.0)
    return tmp_path / "flown"


def test_conclude_gives_metrics_report_and_fingerprint(hsv, bag):
    concluded = hsv("conclude", str(bag), "--json")
    told = hsv("info", str(bag), "--json").json
    assert concluded.code == 0
    assert concluded.json["metrics"] == told["metrics"] and concluded.json["fingerprint"] == told["fingerprint"]
    assert concluded.json["wall_time_s"] is None and concluded.json["diverged_at_s"] is None
    assert concluded.json["report"] == str(bag / "report.html") and (bag / "report.html").is_file()
    said = [line.split() for line in hsv("conclude", str(bag), "--no-report").out.splitlines()]
    assert ["flown", "10", "s"] in said and ["bag", str(bag)] in said


@pytest.mark.long
def test_conclude_ends_with_1_after_a_lost_flight(hsv, bag, tmp_path):
    record_flight(tmp_path / "diverged", "case1_derived_no_notch", duration=30.0)
    ran = hsv("conclude", str(tmp_path / "diverged"), "--no-report")
    assert ran.code == 1 and "flight diverged at t = 17." in ran.error and "flown 17." in " ".join(ran.out.split())
    failed = hsv("conclude", str(bag), "--failure", "plant was killed by SIGKILL")
    assert failed.code == 1 and failed.error == f"{bag}: plant was killed by SIGKILL" and not failed.out


def test_conclude_closes_the_bag_of_a_killed_recorder_and_says_where_it_breaks_off(hsv, bag):
    file = bag / "flown_0.mcap"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (bag / "metadata.yaml").unlink()
    ran = hsv("conclude", str(bag), "--no-report")
    assert ran.code == 1 and Bag(bag).complete
    end = Bag(bag).span[1] * 1e-9
    assert 2.0 < end < 8.0
    assert ran.error.startswith("flight broken off at t = ") and ran.error.endswith(" s of 10.00 s")
    assert not recover(bag).changed


def test_conclude_removes_the_folder_of_a_bag_without_a_file(hsv, tmp_path):
    (tmp_path / "empty").mkdir()
    ran = hsv("conclude", "empty", "--failure", "recorder ended with exit code 2")
    assert ran.code == 1 and ran.error == "recorder ended with exit code 2"
    assert not (tmp_path / "empty").exists()
