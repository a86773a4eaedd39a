from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from hsv.control.checks import load_subject

BASELINE = Path(__file__).parents[2] / "offline_design" / "baseline.yaml"


@pytest.mark.long
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


@pytest.mark.long
def test_the_sensors_of_a_scenario_are_added_and_what_is_not_covered_is_named(hsv, tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'extends = "case1"\ntitle = "x"\n[sensors.altitude]\nquantum = "1 ft"\n[sensors.velocity]\ndrop_out = 0.01\n'
    )
    ran = hsv("certify", str(BASELINE), "--scenario", str(mine), "--json")
    assert ran.code == 1
    assert ran.json["not_covered"] == [
        "sensors.altitude.quantum: 1 ft; the certificate is for an ideal one",
        "sensors.velocity.drop_out: 0.01; the certificate is for an ideal one",
    ]
    verdicts = {verdict["name"]: verdict["certified"] for verdict in ran.json["verdicts"]}
    assert verdicts["sensor quantisation"] and verdicts["all"] and not verdicts["drop-out of a sensor"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--sensors", "coarse"), "sensors = 'coarse': expected one of ideal, fine, ghv, inertial"),
        (("--bias", "velocity=1 deg"), "bias velocity = '1 deg': wrong unit"),
        (("--gust", "2"), "gust = '2': the unit is missing"),
        (("--reach", "9"), "reach = 9: expected more than 0, up to 8.572, beyond which no noise is"),
        (("--actuators", "servo"), "actuators = 'servo': expected ideal, or names from elevator_50, "),
        (("--actuators", "elevator_50,elevator_20"), "actuators = 'elevator_50,elevator_20': expected at most one a"),
    ],
)
def test_bad_input_is_one_line(hsv, arguments, message):
    ran = hsv("certify", str(BASELINE), *arguments)
    assert ran.code == 2
    assert ran.error.startswith(message)
