"""Vehicles: files, parameters, coupling, perturbations, refused values, and conversion to node parameters and back."""

import copy
import sys
from pathlib import Path

import numpy as np
import pytest
from published_model import DERIVED, FOOT, INERTIA, PAPER_LIKE, SLUG

from hsv.base.errors import ParameterError, QuantityError, VehicleError
from hsv.base.units import parse_quantity
from hsv.model.dynamics import COEFFICIENT_UNITS
from hsv.model.trim import trim
from hsv.model.vehicle import (
    VEHICLE_PARAMETERS,
    Vehicle,
    load_vehicle,
    parse_vehicle,
    vehicle_names,
    vehicle_tables,
    vehicle_text,
)

OTHER = str(Path(__file__).parents[1] / "golden" / "stiffened.toml")
"""A vehicle file that extends Parker's vehicle."""


@pytest.mark.parametrize("name", vehicle_names())
def test_every_registered_vehicle_is_whole_and_trims_all_over_its_envelope(name):
    vehicle = load_vehicle(name)
    assert vehicle.title
    assert vehicle.centre == (np.mean(vehicle.altitude_range), np.mean(vehicle.velocity_range))
    for coupling in vehicle.couplings:
        for altitude in np.linspace(*vehicle.altitude_range, 3):
            for velocity in np.linspace(*vehicle.velocity_range, 3):
                point = trim(vehicle.coupled(coupling), altitude, velocity)
                assert point.residual < 1e-9
                assert np.all(point.input > vehicle.decoupled.input_minimum)
                assert np.all(point.input < vehicle.decoupled.input_maximum)


def test_a_vehicle_that_extends_another_differs_in_what_it_lists():
    parker, other = load_vehicle("parker"), load_vehicle(OTHER)
    differing = {n for n in COEFFICIENT_UNITS if getattr(parker.decoupled, n) != getattr(other.decoupled, n)}
    assert {"mass", "natural_frequency_1", "moment_elevator", "thrust_beta_1"} < differing
    assert not {"gravity", "reference_area", "drag_alpha", "thrust_beta_2"} & differing
    assert other.decoupled.mass == parse_quantity("318 slug", "kg", "mass")
    assert other.uncertainty == parker.uncertainty
    assert other.altitude_range == (parker.altitude_range[0], parse_quantity("87000 ft", "m", "altitude"))
    assert "extends" not in vehicle_text(OTHER) and vehicle_text("parker").startswith("# Flexible")


PSI = "inertial_coupling.derived.inertial_coupling_1.value"
WRONG = [
    ("rigid_body.mass", None, "rigid_body.mass.value: missing, expected a quantity such as '1.0 kg'"),
    ("rigid_body", None, "rigid_body.mass.value: missing, expected a quantity such as '1.0 kg'"),
    ("rigid_body.mass", "300 slug", "rigid_body.mass = '300 slug': expected a table of value, symbol, uncertainty"),
    ("rigid_body.mass.value", "300 ft", "rigid_body.mass.value = '300 ft': wrong unit, expected a finite quantity"),
    ("rigid_body.mass.value", "-3 kg", "mass = -3 kg: expected above zero"),
    ("rigid_body.mass.valu", "3 kg", "rigid_body.mass.valu: unknown key, expected one of value, symbol, uncertainty"),
    ("rigid_body.weight", {}, "rigid_body.weight: unknown key, expected one of mass, moment_of_inertia, gravity"),
    ("wings", {}, "wings: unknown key, expected one of title, structure, rigid_body, geometry"),
    ("structure", "parkr", "structure = 'parkr': expected one of parker, winged_cone (did you mean 'parker'?)"),
    ("structure", {}, "structure = {}: expected one of parker, winged_cone"),
    ("title", " ", "title = ' ': expected a text that is not empty"),
    ("rigid_body.mass.uncertainty", "-1 %", "rigid_body.mass.uncertainty = '-1 %': expected from 0 to 90 %"),
    ("envelope.altitude.minimum", "90000 ft", "altitude_range: 27432.0 to 26365.2, expected minimum < maximum"),
    ("envelope.velocity.minimum", "-1 m/s", "velocity_range: from -1.0 m/s, expected above zero"),
    ("envelope.angle.maximum", "0 deg", "angle_limit = 0 rad: expected above zero"),
    ("input_limits.elevator_deflection.maximum", "-40 deg", "elevator_deflection: -0.5235987755982988 to -0.69813"),
    ("inertial_coupling.derived", None, "coupling_sets.names = ['paper_like']: expected one called"),
    ("inertial_coupling.0.5", {}, "inertial_coupling.0: expected a name of lower-case letters, digits and _"),
    (PSI, "-1e9 slug^0.5 ft", "inertial_coupling.derived = -1.1644e+09, 346.291 kg^0.5 m: expected squares whose sum"),
    ("elastic_modes.damping_ratio_1.value", -0.02, "damping_ratio_1 = -0.02: expected at least 0"),
    (PSI, "3 kg", "inertial_coupling.derived.inertial_coupling_1.value = '3 kg': wrong unit"),
]


def changed(field, value):
    tables = copy.deepcopy(vehicle_tables("parker"))
    *path, key = field.split(".")
    place = tables
    for name in path:
        place = place.setdefault(name, {})
    if value is None:
        del place[key]
    else:
        place[key] = value
    return tables


@pytest.mark.parametrize(("field", "value", "message"), WRONG)
def test_a_wrong_field_is_named_with_what_was_expected(field, value, message):
    with pytest.raises(VehicleError) as caught:
        parse_vehicle(changed(field, value), "mine")
    assert str(caught.value).startswith(f"vehicle 'mine': {message}")
    assert "\n" not in str(caught.value)


def test_a_mode_may_be_undamped():
    vehicle = parse_vehicle(changed("elastic_modes.damping_ratio_1.value", 0.0), "mine")
    assert vehicle.decoupled.damping_ratio_1 == 0.0


def test_no_more_parameters_are_uncertain_than_a_design_can_fly_the_corners_of():
    tables = vehicle_tables("parker")
    for row in tables["drag"].values():
        row["uncertainty"] = "1 %"
    with pytest.raises(VehicleError, match="uncertainty: of 15 coefficients, expected at most 12"):
        parse_vehicle(tables, "mine")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title = ", r"mine.toml': .*, expected a TOML file"),
        (
            'extends = "parkr"\n',
            r"vehicle 'parkr': expected one of parker, winged_cone, winged_cone_lift or the path",
        ),
    ],
)
def test_a_file_that_is_no_vehicle_is_named(tmp_path, text, message):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(VehicleError, match=message):
        load_vehicle(str(tmp_path / "mine.toml"))


def test_flat_parameters_are_the_whole_vehicle():
    vehicle = load_vehicle(OTHER)
    values = vehicle.to_parameters()
    others = {f"vehicle.{name}" for name in {*COEFFICIENT_UNITS} - {*vehicle.decoupled.form.names}}
    assert set(values) == {parameter.name for parameter in VEHICLE_PARAMETERS} - others
    again = Vehicle.from_parameters(values)
    assert again.to_parameters() == values
    assert again.coupled("derived") == vehicle.coupled("derived")
    assert again.digest == vehicle.digest != "" == load_vehicle().digest
    # Missing values are those of the named vehicle, or of the default vehicle if none is named.
    assert Vehicle.from_parameters({}).to_parameters() == load_vehicle().to_parameters()
    heavier = Vehicle.from_parameters({"vehicle.name": "parker", "vehicle.mass": 5000.0})
    assert heavier.to_parameters() == load_vehicle().to_parameters() | {"vehicle.mass": 5000.0}
    assert heavier.digest != ""


def test_no_path_in_parameters_is_followed(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('extends = "parker"\n')
    with pytest.raises(ParameterError, match=r"parameter vehicle.mass: missing, expected that of the vehicle '.*mine"):
        Vehicle.from_parameters({"vehicle.name": str(path)})
    values = load_vehicle(OTHER).to_parameters() | {"vehicle.name": str(path)}
    assert Vehicle.from_parameters(values).digest == load_vehicle(OTHER).digest


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("vehicle.mass", 0.0, "parameter vehicle.mass = 0 kg: expected above zero"),
        (
            "vehicle.altitude_range",
            [2.0, 1.0],
            "parameter vehicle.altitude_range: 2.0 to 1.0, expected minimum <",
        ),
        ("vehicle.input_maximum", [1.5, -1.0], "parameter vehicle.elevator_deflection: "),
        ("vehicle.input_maximum", [1.5], "parameter vehicle.input_maximum = [1.5]: expected 2 numbers"),
        ("vehicle.coupling_sets.names", ["a"], "parameter vehicle.coupling_sets.values = "),
        ("vehicle.uncertainty.bounds", [0.1], "parameter vehicle.uncertainty.bounds = [0.1]: expected 10 numbers"),
    ],
)
def test_a_wrong_flat_parameter_is_named(name, value, message):
    with pytest.raises(ParameterError) as caught:
        Vehicle.from_parameters({name: value})
    assert str(caught.value).startswith(message)


def test_a_package_registers_its_files_and_is_not_imported(tmp_path, monkeypatch):
    package, info = tmp_path / "my_vehicles", tmp_path / "my_vehicles-1.0.dist-info"
    package.mkdir()
    info.mkdir()
    (package / "__init__.py").write_text("raise RuntimeError('imported')\n")
    (package / "glider.toml").write_text('extends = "parker"\n[rigid_body]\nmass = { value = "4000 kg" }\n')
    (info / "METADATA").write_text("Name: my_vehicles\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[hsv.vehicles]\nzeppelin = nowhere_at_all:zeppelin.toml\n"
        "glider = my_vehicles:glider.toml\ngone = nowhere_at_all:gone.toml\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert {"glider", "gone"} < set(vehicle_names())
    assert load_vehicle("glider").decoupled.mass == 4000.0
    assert "my_vehicles" not in sys.modules
    with pytest.raises(VehicleError, match=r"vehicle 'gone': registered as 'nowhere_at_all:gone\.toml', expected"):
        load_vehicle("gone")


def test_table_is_converted_to_si():
    vehicle = load_vehicle().coupled()
    assert vehicle.mass == pytest.approx(300 * SLUG, rel=1e-12)
    assert vehicle.moment_of_inertia == pytest.approx(INERTIA * SLUG * FOOT**2, rel=1e-12)
    assert vehicle.reference_area == pytest.approx(17 * FOOT**2, rel=1e-12)
    assert vehicle.gravity == pytest.approx(9.80664, rel=1e-6)
    assert vehicle.thrust_beta_1 == pytest.approx(-3.7693e5 * 4.4482216152605, rel=1e-12)
    assert vehicle.lift_alpha == 4.6773
    assert vehicle.natural_frequency_2 == 19.58


def test_inertial_coupling_is_the_same_in_both_systems_of_units():
    for name, (psi_1, psi_2) in (("derived", DERIVED), ("paper_like", PAPER_LIKE)):
        vehicle = load_vehicle().coupled(name)
        inertia = vehicle.moment_of_inertia
        assert vehicle.inertial_coupling_1**2 / inertia == pytest.approx(psi_1**2 / INERTIA, rel=1e-12)
        assert vehicle.inertial_coupling_2**2 / inertia == pytest.approx(psi_2**2 / INERTIA, rel=1e-12)
    derived = load_vehicle().coupled("derived")
    assert derived.inertial_coupling_1**2 / derived.moment_of_inertia == pytest.approx(0.3230, abs=5e-5)


def test_coupling_scale_joins_the_named_sets():
    vehicle = load_vehicle()
    for kappa, name in ((0.25, "paper_like"), (1.0, "derived"), ("0.25", "paper_like")):
        assert vehicle.coupled(kappa) == pytest.approx(vehicle.coupled(name), rel=1e-14)
    assert vehicle.coupled(0.0) == vehicle.decoupled == vehicle.coupled("derived").decoupled()
    assert vehicle.coupled(0.65).inertial_coupling_2 == pytest.approx(0.65 * DERIVED[1] * SLUG**0.5 * FOOT, rel=1e-12)
    assert [vehicle.coupling_scale(name) for name in vehicle.couplings] == [0.25, 1.0]


def test_perturbation_changes_what_it_names_and_nothing_else():
    vehicle = load_vehicle().coupled()
    heavy = vehicle.perturbed({"mass": 0.1, "thrust_beta_7": -0.03})
    assert heavy.mass == 1.1 * vehicle.mass
    assert heavy.thrust_beta_7 == 0.97 * vehicle.thrust_beta_7
    assert heavy._replace(mass=vehicle.mass, thrust_beta_7=vehicle.thrust_beta_7) == vehicle
    assert vehicle.perturbed({}) == vehicle


@pytest.mark.parametrize(
    ("perturbation", "message"),
    [
        ({"mas": 0.1}, "perturbation.mas = 0.1: no such parameter, expected one of mass, moment_of_inertia"),
        ({"mass": float("nan")}, "perturbation.mass = nan: expected a finite relative change"),
    ],
)
def test_a_wrong_perturbation_is_named(perturbation, message):
    with pytest.raises(QuantityError) as caught:
        load_vehicle().coupled().perturbed(perturbation)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("coupling", ["strong", "-0.1", "nan", "inf", -1.0, 2.1, "65000", True, None])
def test_a_coupling_that_is_no_set_and_no_multiple_is_refused(coupling):
    with pytest.raises(QuantityError) as caught:
        load_vehicle().coupled(coupling)
    expected = "expected one of paper_like, derived, or a multiple of derived from 0 to 2, such as 0.65"
    assert str(caught.value) == f"coupling = {coupling!r}: {expected}"
