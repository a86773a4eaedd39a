import pytest

from hsv.flight.scenario import parse_scenario, scenario_text

SETS = ["elevator_50", "elevator_150", "elevator_20", "elevator_first_order_20", "fuel_10"]
SETS += ["ideal", "fine", "ghv", "inertial"]


def test_every_set_is_listed_with_its_source(hsv):
    listed = hsv("list", "equipment", "--json").json
    assert list(listed) == SETS
    assert all(entry["source"] for entry in listed.values())
    out = hsv("list", "equipment").out
    assert all(name in out for name in SETS)


@pytest.mark.parametrize("name", SETS)
def test_a_scenario_may_name_the_set_in_the_table_that_is_printed(hsv, name):
    described = hsv("list", "equipment", name, "--json").json
    text = f'{scenario_text("case1")}\n[{described["table"]}]\nset = "{name}"\n'
    assert parse_scenario(text, "flight").equipment == {f"{described['table']}.set": name}
    assert f'[{described["table"]}] set = "{name}"' in hsv("list", "equipment", name).out


def test_published_numbers_of_the_elevator_and_of_the_research_sensors(hsv):
    elevator = hsv("list", "equipment", "elevator_50", "--units", "paper", "--json").json["numbers"]
    numbers = {row["quantity"]: (pytest.approx(row["value"]), row["unit"]) for row in elevator}
    assert numbers == {
        "order": (2, ""),
        "natural_frequency": (50.0, "rad/s"),
        "damping_ratio": (0.7, ""),
        "stop": (20.0, "deg"),
        "rate_limit": (400.0, "deg/s"),
    }
    sensors = hsv("list", "equipment", "ghv", "--units", "paper", "--json").json["numbers"]
    noise = {row["channel"]: row["value"] for row in sensors}
    assert noise["altitude"] ** 2 == pytest.approx(10.0)
    assert noise["pitch_rate"] == pytest.approx(0.1812, rel=1e-3)


def test_an_unknown_set_is_refused_with_the_nearest(hsv):
    ran = hsv("list", "equipment", "elevator_51")
    assert ran.code == 2
    assert ran.error.startswith("equipment = 'elevator_51': expected one of elevator_50, ")
    assert ran.error.endswith("(did you mean 'elevator_50'?)")
