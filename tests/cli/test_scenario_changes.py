"""What a user changes or gets wrong on the first day: fields of a scenario, its folder, names of commands."""

import sys
from pathlib import Path

import pytest

from hsv.flight.campaign.summary import Results
from hsv.flight.scenario import load_scenario
from hsv.graph.preparation import prepare

REFERENCE = Path(__file__).parents[2] / "bags" / "reference" / "case1"

CHANGES = ("duration=2 s", "fault[0].start=1 s", "fault[0].effectiveness=0.7")

FIXED = """
class Fixed:
    PARAMETERS = ()

    @classmethod
    def from_parameters(cls, values, design):
        return cls()

    def reset(self): ...

    def step(self, inputs):
        return inputs.reference_input * FACTOR
"""


def options(*changes):
    return [word for change in changes for word in ("--set", change)]


def test_a_changed_field_is_flown_and_named_in_the_title_and_its_flight_is_not_the_published_one(hsv):
    ran = hsv("simulate", "case1", *options(*CHANGES), "--json")
    expected = load_scenario("case1", dict(change.split("=") for change in CHANGES))
    assert expected.fault[0].parameters["effectiveness"] == 0.7
    assert expected.title.endswith(", with duration = 2 s, fault[0].start = 1 s, fault[0].effectiveness = 0.7")
    assert ran.json["as_published"] is None
    assert hsv("simulate", "case1", "--json").json["as_published"]
    assert hsv("simulate", "case1", *options("tube.tau=[1.0, 1.0, 1.0, 1.0, 1.0]", "fault=[]", "seed=7")).code == 0


def test_changes_are_recorded_with_a_run_and_with_a_campaign(hsv, tmp_path):
    run = prepare("case1", changes=CHANGES, bag=tmp_path / "bag", folder=tmp_path / "run")
    assert 'set=["duration=2 s", ' in (tmp_path / "run" / "run.yaml").read_text().replace("\\", "").replace("\n", " ")
    assert run.scenario.duration == 2.0
    ran = hsv("montecarlo", "case1", "--samples", "2", "--workers", "1", "--no-page", *options(*CHANGES), "--json")
    results = Results(Path(ran.json["result"]))
    expected = load_scenario("case1", dict(change.split("=") for change in CHANGES))
    assert results.campaign.scenario.model_dump() == expected.model_dump()
    assert 'title = "case1, flight 1"' in results.file(1)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ("fault[0].efectiveness=0.7", "fault[0].efectiveness: unknown key, expected one of effectiveness, ramp_time"),
        ("fault[1].effectiveness=0.7", "fault[1].effectiveness: no such field, expected fault[0]"),
        ("durration=5 s", "durration: unknown key, expected one of title, design, controller, duration"),
        ("duration", "set = 'duration': expected FIELD=VALUE"),
    ],
)
def test_an_unknown_field_names_its_neighbours(hsv, change, error):
    ran = hsv("simulate", "case1", *options(change))
    assert ran.code == 2 and error in ran.error


def test_all_mistakes_of_a_file_are_reported_a_line_each_and_at_most_ten(hsv, tmp_path):
    (tmp_path / "mine.toml").write_text(
        'extends = "case1"\nduration = "-1 s"\nseed = -1\nwings = 2\n'
        '[initial]\nvelocity = "7900 ft"\n[sensors.pitch_rate]\nnoise = "3 K"\nlag = 2\n'
        '[limits]\nstalls = 1\n[[fault]]\nchannel = "engine"\ntype = "flameout"\nstart = "x"\n'
    )
    ran = hsv("simulate", "mine.toml")
    lines = ran.err.splitlines()
    assert ran.code == 2 and len(lines) == 9
    assert all(line.startswith("hsv: error: scenario 'mine': ") for line in lines)
    for field in ("duration", "seed", "wings", "initial.velocity", "pitch_rate.noise", "pitch_rate.lag", "stalls"):
        assert any(field in line for line in lines)
    (tmp_path / "more.toml").write_text('extends = "case1"\n' + "".join(f"wing{n} = {n}\n" for n in range(13)))
    lines = hsv("simulate", "more.toml").err.splitlines()
    assert len(lines) == 11 and lines[-1] == "hsv: error: and 3 more"


def test_a_controller_is_found_next_to_its_scenario_and_one_in_degrees_is_a_warning(hsv, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setenv("PYTHONPATH", "")
    (tmp_path / "far").mkdir()
    for name, factor in (("radians", "1.0"), ("degrees", "57.3")):
        (tmp_path / "far" / f"{name}_law.py").write_text(FIXED.replace("FACTOR", factor))
        (tmp_path / "far" / f"{name}.toml").write_text(
            f'extends = "case1"\ncontroller = "{name}_law:Fixed"\ndesign = ""\nduration = "1 s"\nfault = []\n'
        )
    ran = hsv("simulate", "far/radians.toml")
    assert "radians (from case1)" in ran.out and ran.err == ""
    ran = hsv("simulate", "far/degrees.toml")
    assert ran.out and "degrees_law:Fixed: first elevator deflection" in ran.err and "in degrees?" in ran.err


def test_files_of_the_wrong_kind_name_the_right_command(hsv, tmp_path):
    (tmp_path / "case1.parquet").write_bytes(b"PAR1")
    assert "hsv montecarlo summary case1.parquet" in hsv("report", "case1.parquet").error
    assert f"hsv replay {REFERENCE}" in hsv("simulate", str(REFERENCE)).error
