"""The commands on bags: what they print, their exit codes, and one line for what they cannot use."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from flown_bags import flown_bag, parameters, write_bag
from marking import long

from hsv.bags.description import TOPICS
from hsv.bags.metadata import FILE_NAME
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.topic import Qos, Topic
from hsv.bags.writer import BagWriter

Hsv = Callable[..., Any]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown_bag(tmp_path_factory.mktemp("bags") / "flown")


def test_replay_says_one_line_a_process(hsv: Hsv, bag: Path) -> None:
    done = hsv("replay", str(bag))
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines] == [
        "plant",
        "notch_filter",
        "nominal_trajectory",
        "tube_mpc",
        "fault_injector",
    ]
    assert all("identical in every byte" in line for line in lines)
    report = hsv("replay", str(bag), "--rerun", "--json").json
    assert report["passed"] and all(process["identical"] for process in report["processes"])


def test_replay_names_process_step_and_field(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    design, _ = parameters(12.0, 6.0)
    gain = list(design["feedback.gain"])
    gain[9 + 3] *= 1.0 + 1e-6
    file = tmp_path / "under_test.yaml"
    file.write_text(ParameterSections(design | {"feedback.gain": gain}).to_yaml())
    done = hsv("replay", str(bag), "--parameters", str(file))
    assert done.code == 1
    (line,) = [line for line in done.out.splitlines() if line.startswith("tube_mpc")]
    assert " differ step " in line and "/hsv/command elevator_deflection: 0.2" in line
    assert done.error == f"tube_mpc: differs from the recording in {bag}"
    one = hsv("replay", str(bag), "--node", "notch_filter", "--parameters", str(file))
    assert one.code == 0 and len(one.out.splitlines()) == 1


def test_diff(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    same = hsv("diff", str(bag), str(bag))
    assert same.code == 0 and same.out == "5409 messages: identical\n" and same.err == ""
    copy = shutil.copytree(bag, tmp_path / "copy")
    assert hsv("diff", str(bag), str(copy), "--json").json["identical"]
    other = flown_bag(tmp_path / "other", fault=8.0)
    done = hsv("diff", str(bag), str(other))
    assert done.code == 1
    assert done.out.startswith("first difference at t = 6.00 s: step 300 /hsv/actuator elevator_deflection")
    report = hsv("diff", str(bag), str(other), "--json").json
    assert report["first_difference"]["step"] == 300
    assert report["largest_difference"]["/hsv/state"]["pitch_angle"] > 0.0
    assert report["units"]["/hsv/state"]["pitch_angle"] == "rad"
    assert report["units"].keys() == report["largest_difference"].keys()
    [row] = [line.split() for line in done.out.splitlines() if line.split()[1:2] == ["pitch_angle"]]
    assert row[0] == "/hsv/state" and row[-1] == "rad"


def test_info_tells_what_happened(hsv: Hsv, bag: Path) -> None:
    out = hsv("info", str(bag)).out
    assert "loss_of_effectiveness 0.9 of elevator_deflection, from 6 s to the end" in " ".join(out.split())
    assert "saturation   0 steps" in out and "largest level" in out
    assert "design.yaml (" in out and "scenario     short" in out


def test_export_writes_into_the_folder_of_the_bag(hsv: Hsv, bag: Path) -> None:
    done = hsv("export", str(bag), "--csv", "--topic", "/hsv/state")
    assert done.code == 0
    header = (bag / "csv" / "hsv_state.csv").read_text().splitlines()[0]
    assert '"altitude [m]"' in header and '"elastic_rate_1 [kg^0.5 m/s]"' in header
    again = hsv("export", str(bag), "--csv")
    assert again.code == 2 and "exists already" in again.error
    assert hsv("export", str(bag), "--csv", "--npz").code == 2


def test_recover_completes_a_truncated_bag(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut"
    cut.mkdir()
    data = next(bag.glob("*.mcap")).read_bytes()
    (cut / "cut_0.mcap").write_bytes(data[: len(data) // 2])
    done = hsv("recover", str(cut), "--json")
    assert done.code == 0 and done.json["changed"] and 3.0 < done.json["duration_s"] < 9.0
    assert [file.name for file in cut.iterdir()] == ["cut_0.mcap"], "the old bag stays as it is"
    new = tmp_path / "cut_recovered"
    assert (new / FILE_NAME).is_file() and done.json["path"] == str(new)
    assert "already complete" in hsv("recover", str(new)).out
    again = hsv("recover", str(cut))
    assert again.code == 2 and "exists already" in again.error
    assert hsv("recover", str(cut), "--out", "other").code == 0 and (tmp_path / "other" / "other_0.mcap").is_file()


def _empty(folder: Path, bag: Path) -> Path:
    return folder


def _cut(folder: Path, bag: Path) -> Path:
    path = folder / "cut.mcap"
    path.write_bytes(next(bag.glob("*.mcap")).read_bytes()[:300])
    return path


def _other_format(folder: Path, bag: Path) -> Path:
    path = folder / "bag.mcap"
    path.write_bytes(b"SQLite format 3\0" * 100)
    return path


def _foreign(folder: Path, bag: Path) -> Path:
    path = folder / "foreign"
    pose = Topic("/turtle/pose", "std_msgs/msg/Float64", "float64 data\n", "", Qos())
    BagWriter(path, [pose]).close()
    return path


@pytest.mark.parametrize(
    "words",
    ["replay", "replay --rerun", "info", "export --npz", "recover", "diff", "report", "plot", "play", "view"],
)
@pytest.mark.parametrize("make", [_cut, *map(long, (_empty, _other_format, _foreign))])
def test_unusable_bags_are_one_line(
    hsv: Hsv, bag: Path, tmp_path: Path, words: str, make: Callable[[Path, Path], Path]
) -> None:
    folder = tmp_path / "given"
    folder.mkdir()
    path = make(folder, bag)
    command, *options = words.split()
    done = hsv(command, str(path), *([str(bag)] if command == "diff" else []), *options)
    assert done.code == 2 and str(path) in done.error


def test_wrong_words_are_one_line(hsv: Hsv, bag: Path) -> None:
    for words in (["--node", "rudder"], ["--node", "plant", "--rerun"], ["--parameters", "missing.yaml"]):
        done = hsv("replay", str(bag), *words)
        assert done.code == 2 and words[1] in done.error


def test_what_a_replay_over_dds_needs_is_looked_for_before_it_starts(hsv: Hsv, bag: Path) -> None:
    for words in (["--node", "notch_filter"], ["--node", "plant"]):
        done = hsv("replay", str(bag), "--over-dds", *words)
        assert done.code == 2 and f"{bag.name}_0.mcap: no topic /hsv/run" in done.error


def test_a_wrong_attached_parameter_is_told_with_its_bag(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    opened = Bag(bag)
    design, scenario = parameters(12.0, 6.0)
    tracks = {topic: opened.track(topic) for topic in TOPICS}
    done = hsv("replay", str(write_bag(tmp_path / "wrong", tracks, design | {"period": "x"}, scenario)))
    assert done.code == 2 and "wrong_0.mcap: attached parameter period = 'x': expected double" in done.error


@pytest.mark.long
def test_what_is_exported_is_in_the_way_of_no_command_on_all_bags(hsv, bag):
    before = sorted(bag.parent.iterdir())
    assert hsv("export", str(bag), "--parquet").code == hsv("export", str(bag), "--npz").code == 0
    assert sorted(bag.parent.iterdir()) == before
    several = hsv("info", str(bag), str(bag), "--json").json["bags"]
    assert several == 2 * [hsv("info", str(bag), "--json").json]
    assert hsv("info", str(bag), str(bag)).out.count("fingerprint") == 2
