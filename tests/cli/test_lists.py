"""The names that ``hsv list`` prints can be used as printed."""

from pathlib import Path

import pytest

from hsv.control.design_file import design_names
from hsv.flight.scenario import parse_scenario, scenario_names, scenario_text
from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.table import FAULT_KINDS, read_fault
from hsv.model.vehicle import vehicle_names
from hsv.plugins.controllers import controller_names

ROOT = Path(__file__).parents[2]
SETS = ["elevator_50", "elevator_150", "elevator_20", "elevator_first_order_20", "fuel_10"]
SETS += ["ideal", "fine", "ghv", "inertial"]

KINDS = {
    "scenarios": scenario_names(),
    "vehicles": vehicle_names(),
    "faults": list(FAULT_KINDS),
    "equipment": SETS,
    "controllers": controller_names(),
    "designs": design_names(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_everything_of_a_kind_is_listed_with_a_title(hsv, kind):
    listed = hsv("list", kind, "--json").json
    assert sorted(listed) == sorted(KINDS[kind])
    assert all(listed.values())
    out = hsv("list", kind).out
    assert all(name in out for name in KINDS[kind])


def test_the_page_of_results_has_what_the_certificates_state(hsv):
    page = (ROOT / "offline_design" / "results.md").read_text(encoding="utf-8")
    printed = [line.rstrip() for line in hsv("list", "designs", "--units", "paper").out.splitlines()]
    assert [line.rstrip() for line in page.partition("```text\n")[2].partition("\n```")[0].splitlines()] == printed


def test_a_vehicle_that_is_printed_can_be_flown(hsv, tmp_path):
    (tmp_path / "mine.toml").write_text(hsv("list", "vehicles", "winged_cone").out)
    table = hsv("list", "vehicles", "mine.toml", "--json").json
    assert table["rigid_body"]["mass"] == {"value": "9375 slug", "symbol": "m", "uncertainty": "3 %"}
    mine, shipped = (hsv("trim", "--vehicle", name, "--json").json for name in ("mine.toml", "winged_cone"))
    assert mine == shipped != hsv("trim", "--json").json


@pytest.mark.parametrize("units", ["si", "paper"])
@pytest.mark.parametrize("kind", FAULT_KINDS)
def test_a_fault_at_either_end_of_the_ranges_that_are_printed_can_be_injected(hsv, kind, units):
    described = hsv("list", "faults", kind, "--json", "--units", units).json
    occurrence = ("intermittent_period", "intermittent_duty", "random_on", "random_off")
    for channel in described["channels"]:
        rows = [row for row in described["parameters"] if row["channel"] in ("", channel)]
        assert {row["parameter"] for row in rows} >= {*occurrence}
        for share in (1e-9, 1.0 - 1e-9):
            given = [
                f"{row['parameter']}={row['least'] + share * (row['largest'] - row['least'])!r} {row['unit']}"
                for row in rows
                if row["parameter"] not in (*occurrence, "steps")
            ]
            steps = [f"steps={row['least']:g}" for row in rows if row["parameter"] == "steps"]
            fault = read_fault(channel, kind, given + steps)
            injector = FaultInjector()
            injector.inject(fault)
            assert injector.parameters()["fault.types"] == [kind]


def test_the_bags_of_a_folder_are_a_table(hsv, tmp_path):
    reference = ROOT / "bags" / "reference"
    words = ("list", "bags", str(reference), "--metric", "altitude_end_error", "--csv", "bags.csv")
    shown = hsv(*words).out
    assert "v1:511c80d1" in shown and "altitude end error" in shown
    rows = {row["bag"]: row for row in hsv(*words, "--json").json["bags"]}
    assert rows["case1"]["scenario"] == "case1" and rows["case1"]["altitude_end_error"] == pytest.approx(
        2.684, abs=1e-3
    )
    assert rows["case1"]["fingerprint"] in (tmp_path / "bags.csv").read_text()
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "broken.mcap").write_bytes(b"none")
    [row] = hsv("list", "bags", str(tmp_path), "--json").json["bags"]
    assert "broken" in row["verdict"] and row["time_s"] is None
    assert hsv("list", "bags", "nowhere").error == "folder = 'nowhere': expected a folder with bags"


@pytest.mark.parametrize("name", SETS)
def test_a_scenario_may_name_the_set_in_the_table_that_is_printed(hsv, name):
    described = hsv("list", "equipment", name, "--json").json
    text = f'{scenario_text("case1")}\n[{described["table"]}]\nset = "{name}"\n'
    assert parse_scenario(text, "flight").settings == {f"{described['table']}.set": name}
    assert f'[{described["table"]}] set = "{name}"' in hsv("list", "equipment", name).out


def test_published_numbers_of_the_elevator(hsv):
    elevator = hsv("list", "equipment", "elevator_50", "--units", "paper", "--json").json["numbers"]
    assert {row["quantity"]: (pytest.approx(row["value"]), row["unit"]) for row in elevator} == {
        "order": (2, ""),
        "natural_frequency": (50.0, "rad/s"),
        "damping_ratio": (0.7, ""),
        "stop": (20.0, "deg"),
        "rate_limit": (400.0, "deg/s"),
    }
