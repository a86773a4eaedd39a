"""From a vehicle file to a controller that is certified for this vehicle."""

import json

import pytest

from hsv.base.errors import DesignError
from hsv.certificate.checks import load_subject
from hsv.cli.entry import main
from hsv.control.design_file import read_design
from hsv.control.tube_law import TubeStatusCode
from hsv.design.inputs import read_inputs
from hsv.flight.assembly import assemble_flight
from hsv.flight.blocks import steps
from hsv.flight.flown_checks import verify
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle

VEHICLE = """extends = "parker"
rigid_body.mass.value = "4600 kg"
geometry.reference_area.uncertainty = "0 %"
geometry.mean_aerodynamic_chord.uncertainty = "0 %"
geometry.thrust_moment_arm.uncertainty = "0 %"
thrust.thrust_beta_1.uncertainty = "0 %"
thrust.thrust_beta_3.uncertainty = "0 %"
thrust.thrust_beta_5.uncertainty = "0 %"
input_limits.elevator_deflection = { minimum = "-31 deg", maximum = "32 deg" }
"""

SMALL = """extends = "baseline_single_k"
name = "small"
vehicle = "mine.toml"
model = { representation = "grid", grid = { altitude_vertices = 2, velocity_vertices = 2 } }
disturbance = { coupling = 0.3, duration = "8 s", fault_start = "4 s", share = 0.5 }
"""


@pytest.fixture
def folder(tmp_path):
    """Return a folder with design inputs and the vehicle file that they name."""
    (tmp_path / "inputs").mkdir()
    (tmp_path / "inputs" / "mine.toml").write_text(VEHICLE)
    (tmp_path / "inputs" / "small.toml").write_text(SMALL)
    return tmp_path


def holds(path, quick=False):
    return all(claim.ok for claims in verify(load_subject(path), quick, seed=1).values() for claim in claims)


def designed(monkeypatch, source, target):
    """Run ``hsv design`` from a folder other than that of the inputs."""
    words = ["hsv", "design", str(source), "--out", str(target)]
    monkeypatch.chdir(target.parent)
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code


@pytest.mark.long
def test_a_design_is_for_the_vehicle_beside_its_inputs_and_its_certificate_is_enough(folder, monkeypatch):
    # Random sequences, which do not depend on the vehicle, take most of the time of a small design.
    monkeypatch.setattr("hsv.design.tube.SEQUENCES", 1000)
    design, source = folder / "small.yaml", folder / "inputs" / "small.toml"
    designed(monkeypatch, source, design)
    mine = load_vehicle(str(folder / "inputs" / "mine.toml"))
    found = read_design(design)
    assert found.vehicle == mine.digest != ""
    assert found.coupling == "0.3"
    assert found.input_maximum.tolist() == mine.decoupled.input_maximum.tolist()
    flown = {"design": str(design), "vehicle": str(folder / "inputs" / "mine.toml"), "vehicle.coupling": 0.3}
    short = {"duration": "4 s", "fault": [], "limits": {}}
    parts = assemble_flight(load_scenario("case1", flown | short))
    assert next(steps(parts)).diagnostics.status is TubeStatusCode.OK
    # Verification must need only the certificate.
    for path in (folder / "inputs").iterdir():
        path.unlink()
    assert holds(design, quick=True)
    certificate = design.with_suffix(".certificate.json")
    report = json.loads(certificate.read_text())
    assert report["inputs"]["vehicle"]["vehicle.mass"] == 4600.0
    report["inputs"]["vehicle"]["vehicle.mass"] = 4700.0
    certificate.write_text(json.dumps(report))
    failed = {
        claim.name for part in verify(load_subject(design), True, seed=1).values() for claim in part if not claim.ok
    }
    assert "design.vehicle" in failed
    assert any(name.startswith("model.a from the vehicle") for name in failed)


@pytest.mark.parametrize(
    ("own", "message"),
    [
        ('vehicle = "parkr"', "vehicle 'parkr': expected one of parker, winged_cone"),
        ("vehicle = 3", "vehicle = 3: expected a name or a path"),
        ('[disturbance]\ncoupling = "strong"', "disturbance.coupling = 'strong': expected one of paper_like,"),
    ],
)
def test_a_wrong_vehicle_of_a_design_is_named(folder, own, message):
    path = folder / "inputs" / "wrong.toml"
    path.write_text(f'extends = "baseline"\n{own}\n')
    with pytest.raises(DesignError) as caught:
        read_inputs(path)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_nominal_scales_that_do_not_decrease_are_refused_with_the_inputs(folder):
    path = folder / "inputs" / "late.toml"
    path.write_text('extends = "baseline"\n[nominal]\nscales = [0.1, 1.0]\n')
    with pytest.raises(DesignError, match=r"nominal.scales = \[0.1, 1.0\]: expected decreasing factors above zero"):
        read_inputs(path)
