import pytest

from hsv.base.errors import ScenarioError
from hsv.control.design_file import find_design
from hsv.flight.assembly import assemble, assemble_flight, flight_parameters
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_text

CASE1 = scenario_text("case1")


def refusal(text):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "mine")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("scenario 'mine': ")
    return message.removeprefix("scenario 'mine': ")


def test_case1_is_the_flight_of_the_paper():
    values = load_scenario("case1").parameters()
    foot = 0.3048
    assert values["initial.altitude"] == pytest.approx(85500 * foot)
    assert values["initial.velocity"] == pytest.approx(7900 * foot)
    assert values["reference.altitudes"] == pytest.approx([86100 * foot])
    assert values["reference.velocities"] == pytest.approx([8150 * foot])
    assert values["duration"] == 200.0
    assert values["fault.channels"] == ["elevator_deflection"]
    assert values["fault.parameters"] == ["effectiveness=0.9"]
    assert values["fault.starts"] == [100.0]
    assert values["vehicle.coupling"] == "paper_like"
    assert not any(name.startswith("vehicle.perturbation") for name in values)


@pytest.mark.parametrize(
    ("altitude", "step"),
    [("85000 ft", "1500 ft"), ("86500 ft", "-1500 ft"), ("85950 ft", "550 ft"), ("85030 ft", "-30 ft")],
)
def test_edges_of_the_envelope_belong_to_it(altitude, step):
    text = CASE1.replace('"85500 ft"', f'"{altitude}"').replace('"600 ft"', f'"{step}"')
    assemble(flight_parameters(parse_scenario(text, "edge")))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[vehicle]", "[vehicle]\nwings = 2", "vehicle.wings: unknown key, expected one of name, definition, model"),
        ('title = "', 'wings = 2\ntitle = "', "wings: unknown key, expected one of title, design, "),
        ("effectiveness = 0.9", "effectiveness = 0.9\nwhen = 3", "fault[0].when: unknown key, expected one of"),
        ('"600 ft"', '"600 s"', "command[0].altitude_change = '600 s': wrong unit, expected a finite quantity such as"),
        ('"600 ft"', '"6000 ft"', "command[0].altitude_change leads to 91500 ft at 0 s: expected 85000 ft to 86500 ft"),
        ('"85500 ft"', '"865000 ft"', "initial.altitude = '865000 ft': expected 85000 ft to 86500 ft, the flight env"),
        ('duration = "200 s"', 'duration = "-1 s"', "duration = '-1 s': expected a time from 0 s to 100000 s"),
        ('duration = "200 s"', "", "duration: missing"),
        ('"100 s"', '"-1 s"', "fault[0].start = '-1 s': expected a time"),
        ('"100 s"', '"200 s"', "fault[0].start = 200 s: expected a time before the flight's end, 200 s"),
        ('"600 ft"', '"600 ft"\nstart = "250 s"', "command[0].start = 250 s: expected a time before the flight's end"),
        ("[limits]", '[[tube.change]]\nstart = "999 s"\ntau = 1.0\n[limits]', "tube.change[0].start = 999 s: expected"),
        ("saturated_steps", "stalls", "limits.stalls: unknown key, expected one of altitude_rise_time"),
        ('"8 ft"', '"-8 ft"', "limits.altitude_end_error = '-8 ft': expected of at least 0 ft"),
        ("saturated_steps = 0", "saturated_steps = 0.5", "limits.saturated_steps = 0.5: expected a whole number of"),
        ('duration = "200 s"', 'duration = "２００ s"', "duration = '２００ s': cannot be read"),
        ('title = "', 'title = " " # "', "title = ' ': expected a text that is not empty"),
        ('title = "', 'robust_mpc.gain_index = -1\ntitle = "', "robust_mpc.gain_index = -1: expected integer from 0"),
    ],
)
def test_a_wrong_field_is_named_with_value_and_expectation(old, new, message):
    assert CASE1.count(old) >= 1
    assert refusal(CASE1.replace(old, new, 1)).startswith(message)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('mas = "+10 %"', "vehicle.perturbation.mas = 0.1: no such parameter, expected one of mass, moment_of"),
        ('mass = "-95 %"', "vehicle.perturbation.mass = '-95 %': expected -90 % to +1000 %"),
        ("mass = 5", "vehicle.perturbation.mass = 5: the unit is missing, expected one such as '+5 %'"),
        ("mass = { uniform = [-0.1, 0.1] }", "vehicle.perturbation.mass = -0.1: the unit is missing"),
    ],
)
def test_a_wrong_perturbation_is_named(line, message):
    assert refusal(CASE1.replace("[initial]", f"[vehicle.perturbation]\n{line}\n[initial]")).startswith(message)


def test_a_scenario_that_is_not_there_is_named():
    with pytest.raises(ScenarioError, match=r"^scenario 'case9': expected a path or one of case1, case1_active"):
        load_scenario("case9")
    with pytest.raises(ScenarioError, match=r"^scenario '/': cannot be read \(Is a directory\), expected a TOML file"):
        load_scenario("/")


def test_a_flight_may_have_another_notch_filter_than_its_design():
    table = '[notch]\nzero_frequency = ["15 rad/s", "19.5 rad/s"]\npole_frequency = ["15 rad/s", "19.5 rad/s"]\n'
    scenario = parse_scenario(CASE1 + table + "zero_damping = [0.02, 0.02]\npole_damping = [0.5, 0.4]\n", "two")
    flown = assemble(flight_parameters(scenario)).notch_filter.sections
    assert [(s.zero_frequency, s.pole_damping) for s in flown] == [(15.0, 0.5), (19.5, 0.4)]


LATER = '[[tube.change]]\nstart = "5 s"\ntau = 1\n[[tube.change]]\nstart = "6 s"\ntau = 0.01\n[limits]'
TWO_SECTIONS = '[notch]\nzero_frequency = ["15 rad/s", "19 rad/s"]\n[limits]'
ANOTHER_GAIN = 'controller = "robust_mpc"\nrobust_mpc.gain_index = 40\ntitle = "'
STEEP = '[[command]]\nvelocity_change = "100 ft/s"\nstart = "1 s"\nend = "1.1 s"\n[limits]'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[limits]", "[tube]\ntau = 2\n[limits]", r"tube\.tau\[0\] = 2\.0: expected double array from 0 to 1"),
        ("[limits]", LATER, r"tube\.change\[1\]\.tau\[0\] = 0\.01: expected .*certified"),
        ("[limits]", TWO_SECTIONS, r"notch\.zero_frequency: 2 values, expected as many as notch\.zero_damping, 1 "),
        ('title = "', ANOTHER_GAIN, r"robust_mpc\.gain_index = 40: expected 0 to \d+"),
        ("[limits]", STEEP, r"command: reference at 1 s: altitude = .* no equilibrium"),
        ('"200 s"', '"200.01 s"', r"duration = 200\.01 s: expected a whole number of periods, 0\.02 s each"),
        ('"200 s"', '"0.009 s"', r"duration = 0\.009 s: expected at least a period, 0\.02 s"),
        ('title = "', 'design = "absent"\ntitle = "', r"design = 'absent': no such file"),
    ],
)
def test_what_the_design_does_not_admit_is_named_as_the_scenario_calls_it(old, new, message):
    text = CASE1.replace('design = "baseline"\n', "").split("[[fault]]")[0] + "[limits]\n"
    text = text.replace(old, new, 1)
    with pytest.raises(ScenarioError, match=f"^scenario 'mine': {message}"):
        assemble_flight(parse_scenario(text, "mine"))


def test_a_wrong_design_is_told_from_a_wrong_scenario(tmp_path):
    path = tmp_path / "wrong.yaml"
    path.write_text(find_design("baseline").read_text().replace("zero_damping: [0.02]", "zero_damping: [-1.0]", 1))
    scenario = parse_scenario(CASE1.replace('"baseline"', f'"{path}"'), "mine")
    with pytest.raises(ScenarioError, match=rf"^scenario 'mine': {path}: parameter notch\.zero_damping"):
        assemble_flight(scenario)


def test_commands_add_up_to_breakpoints():
    def scenario(*commands):
        text = scenario_text("case1").split("[[command]]")[0]
        return parse_scenario(text + "".join(f"[[command]]\n{c}\n" for c in commands), "x").parameters()

    def shown(values):
        columns = (values[f"reference.{name}"] for name in ("times", "altitudes", "velocities"))
        return [(t, round(h / 0.3048, 6), round(v / 0.3048, 6)) for t, h, v in zip(*columns, strict=True)]

    assert shown(scenario()) == [(0.0, 85500.0, 7900.0)]
    ramp = 'altitude_change = "600 ft"\nvelocity_change = "250 ft/s"\nstart = "20 s"\nend = "80 s"'
    assert shown(scenario(ramp)) == [(20.0, 85500.0, 7900.0), (80.0, 86100.0, 8150.0)]
    step = 'altitude_change = "-100 ft"\nstart = "50 s"'
    assert shown(scenario(ramp, step)) == [
        (20.0, 85500.0, 7900.0),
        (50.0, 85800.0, 8025.0),
        (50.0, 85700.0, 8025.0),
        (80.0, 86000.0, 8150.0),
    ]
    at_once = 'velocity_change = "10 ft/s"'
    assert shown(scenario(at_once, ramp))[0] == (0.0, 85500.0, 7910.0)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ('start = "20 s"\nend = "10 s"', "command[0].end = 10 s: expected a time after start, 20 s, or none"),
        ('altitude_change = "1 ft"\nstart = "9 s"\nend = "9 s"', "command[0].end = 9 s: expected a time after start"),
        ("", "command[0]: changes nothing, expected altitude_change or velocity_change"),
        ('altitude_change = "-600 ft"\nend = "60 s"', "command[0].altitude_change leads to 84900 ft at 60 s: expected"),
        ('altitude_step = "600 ft"', "command[0].altitude_step: unknown key, expected one of altitude_change, vel"),
    ],
)
def test_a_wrong_command_is_named(command, message):
    text = scenario_text("case1").split("[[command]]")[0] + f"[[command]]\n{command}\n"
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "x")
    assert message in str(caught.value)


def test_tau_and_its_changes_become_parameters():
    tube = '[tube]\ntau = 0.8\n[[tube.change]]\nstart = "5 s"\ntau = [0.6, 0.6, 0.7, 0.8, 1.0]\n'
    text = CASE1 + tube + '[[tube.change]]\nstart = "9 s"\ntau = 0.9\n'
    values = parse_scenario(text, "x").parameters()
    assert values["feedback.tau"] == [0.8]
    assert values["tau_change.starts"] == [5.0, 9.0]
    assert values["tau_change.values"] == [0.6, 0.6, 0.7, 0.8, 1.0, 0.9, 0.9, 0.9, 0.9, 0.9]
    assert not {"feedback.tau", "tau_change.starts"} & parse_scenario(CASE1, "x").parameters().keys()
    assert "tube.change[1].tau: 2 values, expected 1 or 5" in refusal(text.replace("tau = 0.9", "tau = [0.9, 0.9]"))
    assert "tube.change[1].tau = []: expected one value at least" in refusal(text.replace("tau = 0.9", "tau = []"))
    assert "tube.tau = []: expected one value at least" in refusal(text.replace("tau = 0.8", "tau = []", 1))
    assert "tube.change[1].start = 5 s: expected one change at a time" in refusal(text.replace("9 s", "5 s"))


@pytest.mark.parametrize(
    ("controller", "table", "expected"),
    [
        ("robust_mpc", '[integral]\nrate = "0.1 / s"', "controller tube_mpc"),
        ("robust_mpc", "[tube]\ntau = 0.8", "controller tube_mpc"),
        ("robust_mpc", '[nominal]\nlaw = "qp"', "one that follows the nominal state"),
        ("tube_mpc", "[robust_mpc]\ngain_index = 1", "controller robust_mpc"),
        ("one.of:Ours", '[integral]\nrate = "0.1 / s"', "controller tube_mpc"),
    ],
)
def test_a_table_that_the_controller_does_not_read_is_refused(controller, table, expected):
    name = table[1 : table.index("]")]
    said = refusal(f'controller = "{controller}"\n{CASE1}\n{table}\n')
    assert f"{name}: {controller} does not read it, expected {expected}" in said
