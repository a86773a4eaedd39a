"""The public names of the package, as a notebook uses them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hsv
from hsv.base.errors import CampaignError, DesignError, ParameterError, ScenarioError, TrimError
from hsv.base.units import UnitSystem
from hsv.control.design import digest
from hsv.control.design_file import find_design, read_design
from hsv.flight.assembly import design_parameters
from hsv.flight.fingerprint import as_published
from hsv.gym import TrackEnv, TrackVectorEnv

SHORT = {"duration": "6 s", "fault[0].start": "3 s"}


def test_a_changed_scenario_is_flown_measured_and_drawn(tmp_path):
    flight = hsv.fly(hsv.load("case1", SHORT | {"vehicle.perturbation.mass": "+5 %", "fault[0].effectiveness": 0.8}))
    assert flight.time[-1] == 6.0 and flight.fault_start == 3.0
    np.testing.assert_array_equal(flight.history.actuator[150:, 1], 0.8 * flight.history.command[150:, 1])
    assert flight.metrics["altitude_error_maximum"] == pytest.approx(182.88, rel=1e-3)
    hsv.plot(flight, units="paper").savefig(tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 20_000


@pytest.mark.parametrize("given", ["case2", hsv.load("case2", {})], ids=["by name", "loaded"])
def test_a_shipped_scenario_flies_as_published(given):
    design_hash = digest(design_parameters(hsv.load("case2")))
    assert as_published(hsv.fly(given).fingerprint, hsv.load("case2"), design_hash) is True


def test_flights_are_compared_and_swept():
    flights = dict(hsv.sweep("case1", "fault[0].effectiveness", [1.0, 0.7], SHORT))
    assert [*flights] == [1.0, 0.7]
    table = hsv.compare({"whole": flights[1.0], "lost": flights[0.7]})
    deviation = table["post_fault_attitude_deviation"]
    assert 0.0 < deviation["whole"] < deviation["lost"]
    assert "altitude_settling_time" not in table  # six seconds are too short to settle
    assert len(hsv.plot({"whole": flights[1.0], "lost": flights[0.7]}).axes) == 8


def test_a_swept_flight_is_the_one_flown_alone():
    values = [f"{i} s" for i in range(1, 6)]
    flights = dict(hsv.sweep("case1", "fault[0].start", values, {"duration": "6 s"}))
    assert [*flights] == values
    for value in values[::4]:
        assert flights[value].fingerprint == hsv.fly(hsv.load("case1", {**SHORT, "fault[0].start": value})).fingerprint
    designs = dict(hsv.sweep("case1", "design", ["baseline", "tight"], SHORT))
    assert designs["tight"].fingerprint == hsv.fly(hsv.load("case1", {**SHORT, "design": "tight"})).fingerprint
    with pytest.raises(ScenarioError, match=r"^scenario 'case1': duration = 0.03 s: expected a whole number"):
        list(hsv.sweep("case1", "duration", ["0.02 s", "0.03 s"], {"fault": []}))
    with pytest.raises(ScenarioError, match=r"^scenario 'case1': design = 'none': no such file"):
        list(hsv.sweep("case1", "design", ["none"]))


def test_a_design_is_kept_until_its_file_changes(tmp_path):
    own, text = tmp_path / "own.yaml", find_design("baseline").read_text()
    own.write_text(text)
    assert read_design(own) is read_design(own)
    own.write_text(text.replace("period: 0.02", "period: -1.0"))
    with pytest.raises(DesignError, match="period"):
        read_design(own)


def test_a_flight_is_a_table_with_units():
    flight = hsv.fly(hsv.load("case1", SHORT))
    assert repr(flight).startswith("<Flight of ") and "\n" not in repr(flight)
    frame = flight.to_frame()
    np.testing.assert_array_equal(frame["command.elevator_deflection"], flight.history.command[:, 1])
    np.testing.assert_array_equal(frame.index, flight.time)
    units = frame.attrs["units"]
    assert units.keys() == {"time", *frame.columns} and units["deviation.pitch_rate"] == "rad/s"
    assert "\n" not in repr(flight) and flight.fingerprint in repr(flight)


def test_a_campaign_is_a_table_with_a_row_per_flight():
    table = hsv.montecarlo("case1", 3, seed=5, factor={"fault[0].start": ("90 s", "110 s")})
    assert len(table) == 3 and table["fingerprint"].nunique() == 3
    assert table["sample_fault[0].start"].between(90.0, 110.0).all()
    assert table.attrs["units"]["sample_fault[0].start"] == "s"
    with pytest.raises(CampaignError, match=r"samples = 0: expected 1"):
        hsv.montecarlo("case1", 0)


def test_a_trim_point_has_names_and_units():
    point = hsv.trim("85500 ft", 2407.92)
    assert point.quantities["altitude"] == (pytest.approx(26060.4), "m")
    assert hsv.trim(26060.4, "7900 ft/s").quantities == point.quantities
    assert hsv.trim().state.tolist() == hsv.linearise().operating_state.tolist()
    with pytest.raises(TrimError, match=r"altitude = '200 ft', velocity = '10 ft/s': no equilibrium"):
        hsv.trim("200 ft", "10 ft/s")


def test_trim_and_linear_model_of_a_rigid_vehicle_have_no_elastic_states():
    cruise = {"altitude": "110000 ft", "velocity": "15060 ft/s", "vehicle": "winged_cone"}
    rigid = ["altitude", "velocity", "angle_of_attack", "pitch_angle", "pitch_rate"]
    assert [*hsv.trim(**cruise).quantities] == [*rigid, "fuel_equivalence_ratio", "elevator_deflection"]
    found = hsv.linearise(**cruise)
    assert [*found.states] == rigid and found.A.shape == (5, 5) and len(found.operating_state) == 5
    assert max(mode.pole.real for mode in found.poles) == pytest.approx(0.715, abs=5e-4)
    extended = hsv.linearise(**cruise, model="ECM")
    assert [*extended.states] == [*rigid[:4], "filtered_pitch_rate", "filter_1", "filter_2"]
    assert extended.B.shape == (7, 2)


@pytest.mark.parametrize("model", ["CM", "DM", "ECM"])
def test_a_linear_model_describes_itself_and_is_one_of_python_control(model, tmp_path):
    found = hsv.linearise(model=model)
    system = found.to_control()
    assert system.state_labels == list(found.states) and system.input_labels == list(found.inputs)
    assert np.sort_complex(system.poles()) == pytest.approx(np.sort_complex(np.linalg.eigvals(found.A)), abs=1e-9)
    assert found.D.shape == found.B.shape and len(found.operating_state) == len(found.A)
    assert (found.vehicle, found.model) == ("parker", model)
    paper = found.in_units(UnitSystem.paper)
    assert paper.states["velocity"] == "ft/s"
    assert paper.operating_state[:2] == pytest.approx([85000.0, 7702.0808])
    found.save(tmp_path / "model.npz")
    with np.load(tmp_path / "model.npz") as data:
        np.testing.assert_array_equal(data["A"], found.A)
        assert data["state_units"].tolist() == list(found.states.values())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fault[1].start": 0.8}, r"scenario 'case1': fault\[1\].start: no such field"),
        ({"fault.start": 0.8}, r"scenario 'case1': fault.start: no such field"),
        ({"duration.x": 0.8}, r"scenario 'case1': duration.x: no such field"),
        ({"durations": "3 s"}, r"scenario 'case1': durations: unknown key"),
        ({"vehicle.mass": "3 %"}, r"scenario 'case1': vehicle.mass: unknown key"),
        ({"duration": "3 ft"}, r"scenario 'case1': duration = '3 ft': wrong unit"),
    ],
)
def test_fields_that_are_not_there_are_named(changes, message):
    with pytest.raises(ScenarioError, match=message):
        hsv.load("case1", changes)


def test_the_package_itself_imports_nothing_heavy():
    program = "import sys, hsv; print([m for m in ('numpy', 'cffi', 'hsv.api') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    with pytest.raises(AttributeError, match="no attribute 'flies'"):
        _ = hsv.flies


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hsv.fly(5), "scenario = 5: expected a scenario of hsv.load, its name, or its path as text"),
        (lambda: hsv.load(Path("case1")), "scenario = PosixPath('case1'): expected a name, or a path as text"),
        (lambda: hsv.load("case1", "seed"), "changes = 'seed': expected values by field, such as "),
        (lambda: hsv.plot({}), "flights = {}: expected at least one flight"),
        (lambda: hsv.plot(None), "flights = None: expected flights by label"),
        (lambda: hsv.compare({"a": 1}), "flights['a'] = 1: expected a flight of hsv.fly"),
        (lambda: hsv.montecarlo("case1", 4, workers=2.5), "workers = 2.5: expected an integer from 0 to 4096"),
        (lambda: hsv.montecarlo("case1", "many"), "samples = 'many': expected an integer"),
        (lambda: hsv.montecarlo("case1", 4, seed=1.5), "seed = 1.5: expected an integer"),
        (lambda: hsv.montecarlo("case1", 4, factor=[1]), "factors = [1]: expected least and largest values by field"),
        (lambda: hsv.montecarlo("case1", 4, factor={"seed": 5}), "seed = 5: expected a pair of least and largest"),
        (lambda: hsv.montecarlo("case1", 4, factor={5: (1, 2)}), "factors = 5: expected names of fields"),
        (lambda: hsv.montecarlo("case1", 4, factor={"seed": [None]}), "factors = {'seed': [None]}: expected values as"),
        (lambda: hsv.sweep("case1", 5, [1]), "field = 5: expected a field as text"),
        (lambda: hsv.sweep("case1", "seed", 5), "values = 5: expected a list of values"),
        (lambda: hsv.read_campaign(5), "path = 5: expected the path of a result file"),
        (lambda: hsv.loop(5), "design = 5: expected a name, or a path as text"),
        (lambda: TrackEnv(5), "scenario = 5: expected a name, or a path as text"),
        (lambda: TrackVectorEnv(2.5), "num_envs = 2.5: expected an integer above zero"),
        (lambda: TrackVectorEnv(0), "num_envs = 0: expected an integer above zero"),
    ],
)
def test_an_argument_of_a_wrong_type_is_named_in_one_line(call, message):
    with pytest.raises(ParameterError) as refused:
        call()
    assert str(refused.value).startswith(message) and "\n" not in str(refused.value)
