import json

import pytest
from node_processes import short_scenario


@pytest.fixture
def campaign(hsv, tmp_path):
    """Fly a small campaign by the command."""
    short_scenario(tmp_path, duration=3, fault=2)

    def fly(*words):
        return hsv("montecarlo", "short.toml", "--samples", "12", "--workers", "1", *words)

    return fly


def test_a_campaign_by_the_command_and_one_flight_again(campaign, hsv, tmp_path):
    ran = campaign("--fault-start", "1 s", "2.5 s", "--json")
    values = ran.json
    assert ran.code == 0
    assert values["flown_now"] == 12
    assert {share["name"] for share in values["limits"]} == {"flown_to_the_end", "tube_level"}
    assert "flights on 1 cores" in ran.err
    result = tmp_path / values["result"]
    assert result.exists() and (tmp_path / values["page"]).read_text().startswith("<!DOCTYPE html>")
    again = hsv("montecarlo", "replay", str(result), "--flight", "7", "--json").json
    assert again["identical"] is True
    assert 1.0 <= again["sample_si"]["fault_start"] <= 2.5
    shown = hsv("montecarlo", "summary", str(result), "--units", "paper", "--no-page").out
    assert "12 of 12" in shown and "worst flights" in shown


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--samples", "0"), "samples = 0"),
        (("--fault-start", "1 m", "2 s"), "fault-start = '1 m': wrong unit"),
        (("--initial-altitude", "10 km", "11 km"), "initial.altitude"),
        (("--scale", "0"), "varies"),
        (("--out", "result.csv"), ".parquet"),
        (("--workers", "-1"), "workers = -1: expected 0 to 4096"),
        (("--scheduler", "nonsense"), "scheduler = 'nonsense'"),
    ],
)
def test_bad_settings_end_with_one_line_and_leave_nothing(campaign, tmp_path, words, expected):
    ran = campaign(*words)
    assert ran.code == 2
    assert expected in ran.error
    assert not list(tmp_path.rglob("*.parquet*"))


def test_what_a_program_reads_is_json_only(campaign):
    assert json.loads(campaign("--json").out)["scenario"] == "short"
