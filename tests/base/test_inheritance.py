import pytest

from hsv.base.errors import DesignError, ScenarioError
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_text

OWN = 'extends = "{base}"\ntitle = "mine"\n'


def test_tables_are_merged_lists_replaced_and_limits_are_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        OWN.format(base="case1_uncertain")
        + '[vehicle.perturbation]\nmass = "+7 %"\n[[command]]\naltitude_change = "10 ft"\n'
        + "[limits]\nsaturated_steps = 3\n"
    )
    base, mine = load_scenario("case1_uncertain"), load_scenario(str(path))
    assert mine.vehicle.perturbation == base.vehicle.perturbation | {"mass": 0.07}
    assert len(base.command) == len(mine.command) == 1 and mine.command[0].velocity_change == 0.0
    assert mine.limits == {"saturated_steps": 3.0}
    assert (mine.initial, mine.fault, mine.design) == (base.initial, base.fault, base.design)


def test_paths_are_those_of_the_folder_and_the_text_is_whole(tmp_path):
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "base.toml").write_text(OWN.format(base="case1"))
    (tmp_path / "lab" / "mine.toml").write_text(OWN.format(base="base.toml") + 'duration = "130 s"\n')
    text = scenario_text(str(tmp_path / "lab" / "mine.toml"))
    assert "extends" not in text
    assert parse_scenario(text, "mine").duration == 130.0
    assert parse_scenario(text, "mine").limits == load_scenario("case1").limits


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("extends = 3\n", r"scenario 'mine': extends = 3: expected a name or the path of a file"),
        ('extends = "cas1"\n', r"scenario 'cas1': expected a path or one of"),
        ('extends = "other.toml"\n', r"other.toml': cannot be read"),
        (
            'extends = "mine.toml"\n',
            r"scenario 'mine': extends: .*mine.toml extends .*mine.toml, expected files that do",
        ),
        ('extends = "case1"\ndruation = "3 s"\n', r"scenario 'mine': druation: unknown key"),
    ],
)
def test_what_cannot_be_extended_is_named(tmp_path, text, message):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=message):
        load_scenario(str(path))


def test_designs_extend_designs(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('extends = "baseline"\nname = "mine"\n[nominal]\nscales = [1.0, 0.5]\n')
    base, mine = (inputs.model_dump() for inputs in (read_inputs_of("baseline"), read_inputs(path)))
    assert mine.pop("name") == "mine" and base.pop("name") == "baseline"
    assert mine["nominal"].pop("scales") == [1.0, 0.5] and base["nominal"].pop("scales")
    assert mine == base
    path.write_text('extends = "absent"\n')
    with pytest.raises(DesignError, match="design = 'absent': no such file"):
        read_inputs(path)


def read_inputs_of(name):

    return read_inputs(find_inputs(name))
