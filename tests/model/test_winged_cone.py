"""Other structures: the Winged-Cone with numbers of the literature, and the documented glider, built and flown."""

import os
import re
import shutil
import subprocess
import sys
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import hsv
from hsv.base.errors import QuantityError
from hsv.control.tube_law import TubeStatusCode
from hsv.flight.assembly import assemble_flight
from hsv.flight.blocks import steps
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import derivative, forces, jacobian
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle, load_vehicle

FOOT = 0.3048
CRUISE = 110_000 * FOOT, 15_060 * FOOT


@pytest.fixture(scope="module")
def vehicle():
    """Return the parameters of the vehicle."""
    return load_vehicle("winged_cone").coupled()


def test_it_trims_in_cruise_as_the_equations_say_and_not_as_the_rounded_trim_that_was_printed(vehicle):
    point = trim(vehicle, *CRUISE)
    assert point.residual < 1e-12
    assert np.degrees(point.state[2]) == pytest.approx(1.789, abs=5e-4)
    assert point.input[0] == pytest.approx(0.1762, abs=5e-5)
    assert np.degrees(point.input[1]) == pytest.approx(-0.398, abs=5e-4)


def test_its_poles_in_cruise_are_those_of_an_unstable_short_period_and_a_slow_phugoid(vehicle):
    point = trim(vehicle, *CRUISE)
    A, _ = jacobian(point.state, point.input, vehicle)
    poles = np.sort_complex(np.linalg.eigvals(A[:5, :5]))
    expected = np.sort_complex(np.array([-0.827, 0.715, 0.0276j, -0.0276j, 0.0005]))
    assert poles == pytest.approx(expected, abs=6e-4)
    assert not A[:5, 5:].any() and not A[5:, :5].any()


def test_its_coefficients_at_mach_15_are_the_constant_set_of_the_literature_to_the_printed_digits(vehicle):
    # Xu, Mirmirani, Ioannou (2004), per dynamic pressure and area. At this altitude the speed is exactly Mach 15.
    altitude = CRUISE[0]
    feet = altitude / FOOT
    speed = 15.0 * FOOT * (8.99e-9 * feet**2 - 9.16e-4 * feet + 996.0)

    def coefficients(alpha, fuel=0.0, elevator=None, rate=0.0):
        state = np.array([altitude, speed, alpha, alpha, rate, 0.0, 0.0, 0.0, 0.0])
        inputs = np.array([fuel, alpha if elevator is None else elevator])
        lift, drag, thrust, moment, pressure = forces(state, inputs, vehicle)
        area = pressure * vehicle.reference_area
        return lift / area, drag / area, thrust / area, moment / (area * vehicle.mean_aerodynamic_chord)

    polynomial = np.array([coefficients(alpha) for alpha in (-0.05, 0.0, 0.05)])
    zero, first = polynomial[1], (polynomial[2] - polynomial[0]) / 0.1
    second = (polynomial[2] - 2.0 * polynomial[1] + polynomial[0]) / 0.005
    assert first[0] == pytest.approx(0.6203, abs=5e-5) and zero[0] == 0.0
    drag, moment = ((second[i], first[i], zero[i]) for i in (1, 3))
    assert drag == pytest.approx((0.6450, 0.0043378, 0.003772), abs=5e-5)
    assert moment == pytest.approx((-0.035, 0.036617, 5.3261e-6), abs=5e-5)
    assert coefficients(0.0, fuel=1.0)[2] == pytest.approx(0.02576, abs=5e-6)
    assert coefficients(0.0, fuel=2.0)[2] - coefficients(0.0, fuel=1.0)[2] == pytest.approx(0.00336, abs=5e-6)
    assert coefficients(0.0, elevator=0.1)[3] - zero[3] == pytest.approx(0.00292, abs=1e-12)
    damping = (coefficients(0.0, rate=0.01)[3] - zero[3]) / (vehicle.mean_aerodynamic_chord * 0.01 / (2.0 * speed))
    assert damping == pytest.approx(-0.2289, abs=5e-5)


def test_derivatives_by_the_complex_step_agree_with_differences_on_both_sides_of_a_full_fuel_ratio(vehicle):
    point = trim(vehicle, *CRUISE)
    for fuel in (0.4, 1.2):
        u = np.array([fuel, point.input[1]])
        A, B = jacobian(point.state, u, vehicle)
        for matrix, at, moved in ((A, point.state, 0), (B, u, 1)):
            for j in range(5 if moved == 0 else 2):
                step = 1e-4 * max(abs(at[j]), 1e-2)
                ends = []
                for sign in (1.0, -1.0):
                    x, v = point.state.copy(), u.copy()
                    (x, v)[moved][j] += sign * step
                    ends.append(derivative(x, v, vehicle))
                assert (ends[0] - ends[1]) / (2.0 * step) == pytest.approx(matrix[:, j], rel=1e-5, abs=1e-7)


def test_its_flight_has_no_metric_of_modes_and_stays_in_the_certified_tube():
    parts = assemble_flight(load_scenario("winged_cone"))
    flight = fly(parts)
    assert not any(name.startswith("elastic") for name in flight.metrics)
    limits = load_scenario("winged_cone").limits
    assert all(abs(flight.metrics[name]) <= limit for name, limit in limits.items())
    # Without a notch filter, the set has only the five rigid-body states.
    monitored = [step.diagnostics for step in islice(steps(parts), 1000)]
    assert all(found.status is TubeStatusCode.OK and len(found.error) == 5 for found in monitored)
    assert 0.0 < max(found.level for found in monitored) < 0.02


@pytest.mark.long
def test_at_all_corners_of_its_uncertainty_none_is_lost_and_none_leaves_the_set():
    flights = hsv.montecarlo("winged_cone", corners=True)
    assert len(flights) == 128 and not flights["diverged"].any() and not flights["crashed"].any()
    assert (flights["end_time"] == 200.0).all() and (flights["saturated_steps"] == 0).all()
    assert flights["tube_level"].max() == pytest.approx(0.205, abs=5e-4)


def test_parameters_of_another_structure_are_refused_and_perturbations_of_it_are_named():
    named = load_vehicle("winged_cone")
    values = named.to_parameters()
    assert "vehicle.thrust_beta_1" not in values and values["vehicle.structure"] == "winged_cone"
    again = Vehicle.from_parameters(values)
    assert again.to_parameters() == values and again.digest == named.digest
    assert Vehicle.from_parameters({"vehicle.name": "winged_cone"}).to_parameters() == values
    with pytest.raises(QuantityError, match=r"perturbation.thrust_beta_1 = 0.1: no such parameter, expected one of"):
        named.decoupled.perturbed({"thrust_beta_1": 0.1})


ROOT = Path(__file__).resolve().parents[2]

VEHICLE = """structure = "glider"
geometry = { reference_area = { value = "12 m^2" }, mean_aerodynamic_chord = { value = "0.8 m" } }
lift = { lift_alpha = { value = "5.5" }, lift_zero = { value = "0.3" } }
drag = { drag_zero = { value = "0.012" }, drag_lift = { value = "0.02" } }
thrust = { thrust_fuel = { value = "600" } }
pitch_damping = { damping_zero = { value = "-8" } }
rigid_body.mass.value = "500 kg"
rigid_body.moment_of_inertia.value = "900 kg m^2"
rigid_body.gravity.value = "9.81 m/s^2"
pitching_moment.moment_alpha.value = "-0.8"
pitching_moment.moment_zero.value = "0.05"
pitching_moment.moment_elevator.value = "-1.1"
atmosphere.reference_density.value = "1.225 kg/m^3"
atmosphere.reference_altitude.value = "0 m"
atmosphere.density_scale_height.value = "8500 m"
envelope.altitude = { minimum = "500 m", maximum = "3000 m" }
envelope.velocity = { minimum = "25 m/s", maximum = "60 m/s" }
envelope.angle.maximum = "20 deg"
input_limits.fuel_equivalence_ratio = { minimum = 0.0, maximum = 1.0 }
input_limits.elevator_deflection = { minimum = "-25 deg", maximum = "25 deg" }
"""

FLY = """
from hsv.model.dynamics import advance
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle, vehicle_names
vehicle = load_vehicle("glider.toml").coupled()
point = trim(vehicle, 1000.0, 40.0)
x = advance(point.state, point.input, vehicle, 1.0, 100)
for name in vehicle_names():
    load_vehicle(name)
print(point.residual, abs(x - point.state)[:2].max(), load_vehicle().digest == "")
"""


@pytest.mark.long
def test_the_documented_glider_is_built_trims_and_flies(tmp_path):
    page = (ROOT / "docs" / "structures.md").read_text()
    blocks = dict(re.findall(r"```(?:c|python)\n(?:/\*|#) src/hsv/(\S+)(?: \*/)?\n(.*?)```", page, re.DOTALL))
    copy = tmp_path / "hsv"
    shutil.copytree(ROOT / "src" / "hsv", copy, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    (copy / "hsv/core/glider.h").write_text(blocks["hsv/core/glider.h"])
    numbers, included, case = blocks["hsv/core/vehicle.h"].splitlines()
    field, row = blocks["hsv/model/dynamics.py"].split("\n\n", 1)
    for name, before, after in (
        ("core/vehicle.h", "enum { PARKER, WINGED_CONE };", numbers),
        ("core/vehicle.h", '#include "winged_cone.h"', f'#include "winged_cone.h"\n{included}'),
        ("core/vehicle.h", "    default: return parker_forces", f"{case}\n    default: return parker_forces"),
        ("core/vehicle_fields.h", "/* The number of", f"{blocks['hsv/core/vehicle_fields.h']}/* The number of"),
        ("model/dynamics.py", "    structure: float = 0.0", f"    {field}\n    structure: float = 0.0"),
    ):
        path = copy / "hsv" / name
        text = path.read_text()
        assert text.count(before) == 1
        path.write_text(text.replace(before, after))
    path = copy / "hsv/model/dynamics.py"
    text = path.read_text()
    end = text.index('\n}\n"""All structures by name')
    path.write_text(text[:end] + "\n" + row.rstrip() + text[end:])
    environment = os.environ | {"PYTHONPATH": f"{copy}:{os.environ.get('PYTHONPATH', '')}", "HSV_CFLAGS": "-O0"}
    build = [sys.executable, "setup.py", "-q", "build_ext", "--inplace", "--force"]
    subprocess.run(build, cwd=copy, env=environment, check=True, capture_output=True)
    (tmp_path / "glider.toml").write_text(VEHICLE)
    ran = subprocess.run([sys.executable, "-c", FLY], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert not ran.returncode, ran.stderr
    residual, moved, default = ran.stdout.split()
    assert float(residual) < 1e-12 and float(moved) < 1e-6 and default == "True"
