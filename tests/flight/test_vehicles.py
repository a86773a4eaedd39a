"""Flights of other vehicles: named in a scenario, found next to it, kept with the flight, and not certified."""

import shutil
from pathlib import Path

import pytest

from hsv.base.errors import ScenarioError
from hsv.control.tube_law import TubeStatusCode
from hsv.flight.assembly import assemble, assemble_flight, flight_parameters
from hsv.flight.blocks import steps
from hsv.flight.campaign.campaign import plan
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_text

SHORT = {"duration": "4 s", "fault[0].start": "2 s", "limits": {}}

OTHER = Path(__file__).parents[1] / "golden" / "stiffened"
"""Vehicle and design of the golden flights that do not fly Parker's vehicle."""

MINE = """extends = "parker"
rigid_body.mass = { value = "4600 kg", uncertainty = "5 %" }
geometry.thrust_moment_arm.uncertainty = "2 %"
lift.lift_alpha.uncertainty = "4 %"
envelope.altitude.maximum = "87000 ft"
envelope.velocity = { minimum = "2350 m/s", maximum = "2600 m/s" }
inertial_coupling.measured.inertial_coupling_1.value = "-150 kg^0.5 m"
inertial_coupling.measured.inertial_coupling_2.value = "110 kg^0.5 m"
"""

FLIGHT = 'extends = "case1"\ntitle = "mine"\nvehicle = "{}"\n'


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a vehicle and a scenario that names it."""
    (tmp_path / "mine.toml").write_text(MINE)
    (tmp_path / "flight.toml").write_text(FLIGHT.format("mine.toml"))
    return tmp_path


def test_a_vehicle_beside_its_scenario_is_flown_from_any_folder_and_taken_along(folder, monkeypatch):
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    scenario = load_scenario(str(folder / "flight.toml"), SHORT)
    text = scenario_text(str(folder / "flight.toml"))
    flight = fly(assemble_flight(scenario))
    shutil.move(folder / "mine.toml", folder / "gone.toml")
    assert str(folder) not in text
    taken = parse_scenario(text, "flight")
    assert taken.vehicle.described.digest == scenario.vehicle.described.digest != ""
    assert taken.vehicle.name == "mine" and taken.vehicle.described.decoupled.mass == 4600.0
    assert flight.fingerprint != fly(assemble_flight(load_scenario("case1", SHORT))).fingerprint
    # The flat parameters, which a bag keeps, are enough to repeat the flight.
    assert fly(assemble(flight_parameters(scenario))).fingerprint == flight.fingerprint
    with pytest.raises(ScenarioError, match=r"scenario 'flight': vehicle '.*mine.toml': cannot be read \(No such file"):
        load_scenario(str(folder / "flight.toml"))


def test_a_vehicle_that_is_named_replaces_that_of_the_scenario_before(folder):
    (folder / "next.toml").write_text('extends = "flight.toml"\ntitle = "next"\nvehicle = "parker"\n')
    (folder / "other.toml").write_text('extends = "flight.toml"\ntitle = "other"\n[vehicle]\ncoupling = "measured"\n')
    following, other = (load_scenario(str(folder / f"{name}.toml")).vehicle for name in ("next", "other"))
    assert following.described.digest == "" and following.definition == {}
    assert (other.name, other.coupling, other.described.decoupled.mass) == ("mine", "measured", 4600.0)
    (folder / "written.toml").write_text(scenario_text(str(folder / "flight.toml")))
    (folder / "last.toml").write_text('extends = "written.toml"\ntitle = "last"\nvehicle = "parker"\n')
    assert load_scenario(str(folder / "last.toml")).vehicle.described.digest == ""


def test_envelope_and_uncertainty_are_those_of_the_vehicle(folder):
    path = str(folder / "flight.toml")
    assert load_scenario(path, {"initial.velocity": "2595 m/s", "command": []}).initial.velocity == 2595.0
    with pytest.raises(ScenarioError, match=r"initial.velocity = '7700 ft/s': expected 7710 ft/s to 8530 ft/s, the"):
        load_scenario(path, {"initial.velocity": "7700 ft/s"})
    with pytest.raises(ScenarioError, match=r"command\[0\].altitude_change leads to 87100 ft at 0 s: .* to 87000 ft"):
        load_scenario(path, {"command[0].altitude_change": "1600 ft"})
    assert load_scenario(path, {"vehicle.perturbation.lift_alpha": "4 %"}).vehicle.perturbation == {"lift_alpha": 0.04}
    with pytest.raises(ScenarioError, match=r"vehicle.perturbation.gravity = 0.04: no such parameter, expected one of"):
        load_scenario(path, {"vehicle.perturbation.gravity": "4 %"})
    with pytest.raises(ScenarioError, match=r"vehicle.perturbation.lift_alpha = 0.04: no such parameter"):
        load_scenario("case1", {"vehicle.perturbation.lift_alpha": "4 %"})
    bounds = {factor.name: factor.high for factor in plan(path).factors}
    assert bounds["mass"] == 0.05 and bounds["thrust_moment_arm"] == 0.02 and bounds["lift_alpha"] == 0.04


@pytest.mark.parametrize(
    ("design", "changes", "status"),
    [
        ("baseline", {}, TubeStatusCode.OK),
        ("baseline", {"vehicle.coupling": 0.65}, TubeStatusCode.UNCERTIFIED_VEHICLE),
        ("baseline", {"vehicle": f"{OTHER}.toml"}, TubeStatusCode.UNCERTIFIED_VEHICLE),
        (f"{OTHER}.yaml", {"vehicle": f"{OTHER}.toml"}, TubeStatusCode.OK),
        (f"{OTHER}.yaml", {}, TubeStatusCode.UNCERTIFIED_VEHICLE),
    ],
)
def test_a_tube_is_certified_for_its_own_vehicle(design, changes, status):
    parts = assemble_flight(load_scenario("case1", SHORT | {"design": design} | changes))
    assert next(steps(parts)).diagnostics.status is status


@pytest.mark.parametrize(
    ("vehicle", "message"),
    [
        ('vehicle = "parkr"', "vehicle 'parkr': expected one of parker, winged_cone, winged_cone_lift or the path"),
        ("[vehicle]\nname = 3", "vehicle.name = 3: expected a name or a path"),
        ("[vehicle]\ndefinition = { wings = 2 }", "vehicle 'parker': wings: unknown key, expected one of title"),
        ("[vehicle]\ncoupling = { uniform = [-1, 1] }", "vehicle.coupling = -1.0: expected one of paper_like, derived"),
        (f"[vehicle]\ncoupling = 1{400 * '0'}", f"vehicle.coupling = 1{400 * '0'}: expected one of paper_like,"),
    ],
)
def test_a_wrong_vehicle_is_named(tmp_path, vehicle, message):
    (tmp_path / "mine.toml").write_text(f'extends = "case1"\ntitle = "mine"\n{vehicle}\n')
    with pytest.raises(ScenarioError) as caught:
        load_scenario(str(tmp_path / "mine.toml"))
    assert str(caught.value).startswith(f"scenario 'mine': {message}")
