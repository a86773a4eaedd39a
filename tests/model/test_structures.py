"""The example of another structure in the documentation is built and flies."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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
        ("core/vehicle.h", "        default: return parker_forces", f"{case}\n        default: return parker_forces"),
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
