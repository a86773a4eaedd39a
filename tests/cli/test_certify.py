from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from hsv.design.verification.verifier import load_subject

BASELINE = Path(__file__).parents[2] / "offline_design" / "baseline.yaml"


def test_a_design_is_certified_as_it_was_and_with_a_small_gust(hsv):
    certificate = load_subject(BASELINE).certificate["tube"]
    alone, gust = hsv("certify", str(BASELINE), "--gust", "0.5 ft/s", "--json").json["verdicts"]
    assert (alone["name"], gust["name"]) == ("as certified", "gust 0.5 ft/s")
    assert alone["certified"] and gust["certified"]
    assert_allclose(alone["half_width"], certificate["invariant_set"]["half_width"][:5], rtol=1e-5)
    margins = certificate["tightening"]["plan"]
    assert_allclose(alone["room"], list(zip(margins["margin_to_lower"], margins["margin_to_upper"], strict=True)), 1e-4)
    assert all(wide > narrow for wide, narrow in zip(gust["half_width"], alone["half_width"], strict=True))
    assert min(min(row) for row in gust["room"]) < min(min(row) for row in alone["room"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--sensors", "coarse"), "sensors = 'coarse': expected one of ideal, fine, ghv, inertial"),
        (("--bias", "yaw=1 deg"), "bias = 'yaw=1 deg': expected one of altitude, velocity, angle_of_attack"),
        (("--bias", "velocity=1 deg"), "bias velocity = '1 deg': wrong unit"),
        (("--gust", "2"), "gust = '2': the unit is missing"),
        (("--gust=-2 ft/s",), "gust = -0.6096: expected zero or more"),
        (("--density", "2 ft"), "density = '2 ft': wrong unit"),
        (("--actuators", "servo"), "actuators = 'servo': expected names from elevator_50, "),
        (("--actuators", "elevator_50,elevator_20"), "actuators = 'elevator_50,elevator_20': expected at most one a"),
    ],
)
def test_bad_input_is_one_line(hsv, arguments, message):
    ran = hsv("certify", str(BASELINE), *arguments)
    assert ran.code == 2
    assert ran.error.startswith(message)
