"""The commands on bags: output, exit codes, and a one-line message if a bag lacks something."""

import shutil
from dataclasses import replace

import pytest
from changed_bags import changed_bag
from marking import long
from mcap.reader import make_reader
from recorded_flight import record_flight

from hsv.bags.metadata import FILE_NAME
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter

COMMAND = "/hsv/command"
RESULTS = {
    "info": [],
    "replay": [],
    "export": ["--npz", "--out", "out.npz"],
    "report": ["--out", "out.html"],
    "plot": ["--out", "out.png"],
}
"""Commands that need most parts of a bag, with the files that they write."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flown", duration=12.0, fault=6.0).folder


@pytest.fixture
def without(bag, tmp_path):
    """Return a function that copies the bag without one of its topics."""
    return lambda topic: changed_bag(bag, tmp_path / "partial", lambda kind: None if kind.name == topic else kind)


def test_replay_says_one_line_a_process(hsv, bag):
    done = hsv("replay", str(bag))
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    names = ["plant", "notch_filter", "nominal_trajectory", "tube_mpc", "fault_injector"]
    assert [line.split()[0] for line in lines] == names
    assert all("identical in every byte" in line for line in lines)
    report = hsv("replay", str(bag), "--rerun", "--json").json
    assert report["passed"] and all(process["identical"] for process in report["processes"])


def test_replay_names_process_step_and_field(hsv, bag, tmp_path):
    design = ParameterSections.parse(Bag(bag).text("design.yaml"), "design.yaml")
    gain = list(design.shared["feedback.gain"])
    gain[9 + 3] *= 1.0 + 1e-6
    file = tmp_path / "under_test.yaml"
    file.write_text(design.updated({"feedback.gain": gain}).to_yaml())
    done = hsv("replay", str(bag), "--parameters", str(file))
    assert done.code == 1
    (line,) = [line for line in done.out.splitlines() if "identical" not in line]
    assert line.startswith("tube_mpc") and " differ step " in line and "/hsv/command elevator_deflection: 0.2" in line
    assert done.error == f"tube_mpc: differs from the recording in {bag}"
    one = hsv("replay", str(bag), "--node", "notch_filter", "--parameters", str(file))
    assert one.code == 0 and len(one.out.splitlines()) == 1


def test_a_replay_of_one_node_repeats_no_loop(hsv, bag):
    for words in ("--over-dds", "--rerun"):
        done = hsv("replay", str(bag), words, "--node", "plant")
        assert done.code == 2 and done.error.startswith("node = 'plant': the whole loop is repeated, expected no ")


def test_diff_names_the_first_difference_and_the_largest_with_units(hsv, bag, tmp_path):
    same = hsv("diff", str(bag), str(bag))
    assert same.code == 0 and same.out == "5409 messages: identical\n" and same.err == ""
    other = record_flight(tmp_path / "other", duration=12.0, fault=8.0).folder
    done = hsv("diff", str(bag), str(other))
    assert done.code == 1
    assert done.out.startswith("first difference at t = 6.00 s: step 300 /hsv/actuator elevator_deflection")
    report = hsv("diff", str(bag), str(other), "--json").json
    assert report["first_difference"]["step"] == 300
    assert report["largest_difference"]["/hsv/state"]["pitch_angle"] > 0.0
    assert report["units"]["/hsv/state"]["pitch_angle"] == "rad"
    assert report["units"].keys() == report["largest_difference"].keys()


def test_diff_takes_padding_for_no_difference(hsv, bag, tmp_path):
    padded = changed_bag(
        bag,
        tmp_path / "padded",
        messages=lambda topic, found: [(time, data + b"\0" * (topic == "/clock")) for time, data in found],
    )
    ran = hsv("diff", str(bag), str(padded))
    assert ran.code == 0 and "identical in every byte except the padding" in ran.out


def test_info_tells_what_happened(hsv, bag):
    out = hsv("info", str(bag)).out
    assert "loss_of_effectiveness 0.9 of elevator_deflection, from 6 s to the end" in " ".join(out.split())
    assert "saturation   steps 0\n" in out and "largest level" in out
    assert "design.yaml (" in out and "scenario     case1" in out


def test_recover_completes_a_truncated_bag(hsv, bag, tmp_path):
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


@pytest.mark.long
def test_a_recovered_bag_is_replayed_as_far_as_it_is_complete(hsv, bag, tmp_path):
    last = {"/hsv/nominal", COMMAND, "/hsv/tube_status", "/hsv/actuator"}
    ragged = changed_bag(bag, tmp_path / "ragged", messages=lambda topic, found: found[:-1] if topic in last else found)
    file = ragged / "ragged_0.mcap"
    with file.open("rb") as stream:
        indexes = make_reader(stream).get_summary().chunk_indexes
    end = max(index.chunk_start_offset + index.chunk_length for index in indexes)
    (ragged / FILE_NAME).unlink()
    file.write_bytes(file.read_bytes()[: end + 1])
    assert hsv("recover", str(ragged), "--out", "repaired").code == 0
    ran = hsv("replay", "repaired")
    assert ran.code == 0 and ran.err == "" and ran.out.count("identical in every byte") == 5
    assert hsv("replay", "repaired", "--rerun").code == 0
    assert hsv("info", "repaired", "--json").json["ending"] == "broken off"


@pytest.mark.parametrize("command", ["info", *map(long, ("replay", "export", "report", "plot"))])
def test_a_bag_that_is_cut_off_is_used_and_said_to_be_cut_off(hsv, bag, tmp_path, command):
    cut, data = tmp_path / "cut.mcap", next(bag.glob("*.mcap")).read_bytes()
    cut.write_bytes(data[: len(data) * 85 // 100])
    ran = hsv(command, str(cut), *RESULTS[command])
    assert ran.code == 0 and ran.err.count("\n") == 1
    assert ran.err.startswith(f"hsv: warning: {cut}: truncated after ") and "hsv recover completes it" in ran.err
    assert RESULTS[command] == [] or (tmp_path / RESULTS[command][-1]).is_file()
    if command == "info":
        assert hsv("info", str(cut), "--json").json["complete"] is False


@pytest.mark.parametrize("command", ["info", long("replay")])
def test_metadata_that_contradict_their_file_are_named_once_and_not_believed(hsv, bag, tmp_path, command):
    lying = shutil.copytree(bag, tmp_path / "lying")
    (file,), count = lying.glob("*.mcap"), sum(topic.count for topic in Bag(bag).topics.values())
    metadata = lying / FILE_NAME
    metadata.write_text(metadata.read_text().replace(f"message_count: {count}", "message_count: 7"))
    ran = hsv(command, str(lying))
    said = f"metadata.yaml states 7 messages in {file.name}, which has {count}"
    assert ran.code == 0 and ran.err == f"hsv: warning: {file}: {said}\n"


@pytest.mark.parametrize("topic", [COMMAND, long("/hsv/state"), long("/hsv/nominal"), long("/hsv/actuator")])
def test_info_of_a_filtered_bag_says_what_it_lacks(hsv, without, topic):
    partial = without(topic)
    ran = hsv("info", str(partial))
    assert ran.code == 0 and ran.out.endswith(f"no metrics: they need {topic}\n")
    assert ran.err == f"hsv: warning: {partial / 'partial_0.mcap'}: no topic {topic}\n"
    described = hsv("info", str(partial), "--json").json
    assert described["metrics"] is None and described["messages"] > 1000


def test_a_topic_that_is_needed_is_missing(hsv, without, tmp_path):
    partial = without(COMMAND)
    for words in (("replay",), ("export", "--npz", "--out", "out.npz", "--topic", COMMAND)):
        ran = hsv(words[0], str(partial), *words[1:])
        assert ran.code == 2 and ran.out == ""
        assert ran.error.startswith(f"{partial / 'partial_0.mcap'}: no topic /hsv/command, only /clock, ")
    assert [path.name for path in tmp_path.iterdir()] == ["partial"]


def test_a_bag_without_a_step_is_refused(hsv, bag, tmp_path):
    BagWriter(tmp_path / "stillborn", Bag(bag).topics.values()).close()
    for command in ("info", "report", "plot"):
        ran = hsv(command, "stillborn")
        assert ran.code == 2 and "holds no complete step, expected a flight" in ran.error


@pytest.mark.parametrize("words", ["replay", "replay --rerun", "info", "export --npz", "recover", "report", "plot"])
def test_an_unusable_bag_is_one_line(hsv, tmp_path, words):
    (tmp_path / "bag.mcap").write_bytes(b"SQLite format 3\0" * 100)
    done = hsv(*words.split(), "bag.mcap")
    assert done.code == 2 and "bag.mcap" in done.error


def test_a_bag_of_sqlite3_is_refused_with_the_command_that_converts_it(hsv, tmp_path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "old_0.db3").write_bytes(b"SQLite format 3\0")
    for path in ("old", "old/old_0.db3"):
        ran = hsv("info", path)
        assert ran.code == 2
        assert f"{path}: recorded with sqlite3, expected MCAP: ros2 bag convert -i {path} " in ran.error


@pytest.mark.parametrize(
    ("words", "topic", "changes", "said"),
    [
        (["info"], COMMAND, {"type": "std_msgs/msg/Float64", "definition": "float64 data\n"}, "is std_msgs/msg/Flo"),
        (["plot"], "/hsv/forces", {"definition": "VehicleForces again\n"}, "VehicleForces holds itself"),
        (["report"], "/hsv/forces", {"definition": "no message\0"}, "definition of hsv_msgs/msg/VehicleForces: "),
        (["export", "--csv"], COMMAND, {"type": "ControlInput"}, "expected hsv_msgs/msg/ControlInput"),
    ],
    ids=["other type", "holds itself", "no definition", "no package"],
)
def test_a_topic_of_another_type_or_definition(hsv, bag, tmp_path, words, topic, changes, said):
    made = changed_bag(bag, tmp_path / "made", lambda each: replace(each, **changes) if each.name == topic else each)
    ran = hsv(*words, str(made))
    assert ran.code == 2 and said in ran.error and str(made) in ran.error


def test_definitions_may_have_the_line_ends_of_windows_or_be_empty(hsv, bag, tmp_path):
    def written(topic):
        if topic.name == "/diagnostics":
            return replace(topic, name="/other", type="std_msgs/msg/Empty", definition="")
        return replace(topic, definition=topic.definition.replace("\n", "\r\n"))

    made = changed_bag(bag, tmp_path / "made", written)
    assert "identical" in hsv("diff", str(bag), str(made)).out
    assert hsv("info", str(made)).code == 0
    assert hsv("export", str(made), "--csv", "--topic", "/hsv/state", "--out", "tables").code == 0
    assert hsv("export", str(made), "--topic", "/hsv/state", "--out", "state.mat").out.split() == [
        "written",
        "state.mat",
    ]
    assert '"altitude [m]"' in (tmp_path / "tables" / "hsv_state.csv").read_text()


@pytest.mark.parametrize(
    ("kind", "field", "command"),
    [
        ("ControlInput", "fuel_equivalence_ratio", "report"),
        ("VehicleState", "altitude", "info"),
        ("VehicleState", "step", "replay"),
        ("VehicleState", "step", "replay --rerun"),
        ("Actuator", "active", "plot"),
    ],
)
def test_a_field_that_a_definition_lacks_is_named(hsv, bag, tmp_path, kind, field, command):
    def older(topic):
        renamed = replace(topic, definition=topic.definition.replace(f" {field} ", " other "))
        return renamed if topic.type == f"hsv_msgs/msg/{kind}" else topic

    made = changed_bag(bag, tmp_path / "made", older)
    ran = hsv(*command.split(), str(made))
    assert ran.code == 2 and "recorded with another definition" in ran.err and ran.err.count("\n") == 1
    assert f"expected a field {field}" in ran.err and str(made) in ran.err
