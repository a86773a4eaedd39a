import re

import pytest
from marking import long
from node_processes import short_scenario

from hsv.base.parameters import Parameter, validate
from hsv.control.design_file import find_design


@pytest.fixture
def campaign(hsv, tmp_path):
    """Return a function that flies a small campaign with the command."""
    short_scenario(tmp_path, duration=3, fault=2)

    def fly(*words):
        defaults = {"--samples": "12", "--workers": "1"}
        given = [word for option in defaults if option not in words for word in (option, defaults[option])]
        return hsv("montecarlo", "short.toml", *given, *words)

    return fly


def test_a_campaign_by_the_command_and_one_flight_again(campaign, hsv, tmp_path):
    ran = campaign("--factor", "fault[0].start=1 s..2.5 s", "--json")
    values = ran.json
    assert ran.code == 0
    assert values["flown_now"] == 12
    assert {share["name"] for share in values["limits"]} == {"flown_to_the_end", "tube_level"}
    result = tmp_path / values["result"]
    assert result.exists() and (tmp_path / values["page"]).read_text().startswith("<!DOCTYPE html>")
    again = hsv("montecarlo", "replay", str(result), "--flight", "7", "--json").json
    assert again["identical"] is True
    assert 1.0 <= again["sample_si"]["fault[0].start"] <= 2.5
    shown = hsv("montecarlo", "summary", str(result), "--units", "paper", "--no-page").out
    assert "12 of 12" in shown and "worst flights" in shown
    printed = hsv("montecarlo", "replay", str(result), "--flight", "7", "--units", "paper").out
    assert all(re.search(r"^altitude overshoot .* %\s*$", text, re.MULTILINE) for text in (printed, shown))
    assert re.search(r"^sample  mass [+-]\S+ %, .*fault\[0\]\.start \d\.\d+ s$", printed, re.MULTILINE)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--factor", "fault[0].start=1 m..2 s"), "uniform = '1 m': wrong unit"),
        (("--corners", "--sampling", "sobol"), "sampling = sobol: expected no --sampling with --corners"),
        (("--factor", "fault[0].start"), "factor = 'fault[0].start': expected FIELD=LEAST..LARGEST"),
        (("--factor", "=1..2"), "no such field"),
        (("--factor", "fault[0].start=0 s..1 s", "--factor", "fault[0].start=1 s..2 s"), "a field is given twice"),
        (("--scale", "0"), "varies"),
        (("--factor", "duration=2.5 s..3.01 s"), "duration = 3.01 s: expected a whole number of periods, 0.02 s each"),
        (("--workers", "-1"), "workers = -1: expected 0 to 4096"),
        (("--workers", "0", "--scheduler", "nonsense"), "scheduler = 'nonsense'"),
    ],
)
def test_bad_settings_end_with_one_line_and_leave_nothing(campaign, tmp_path, words, expected):
    ran = campaign(*words)
    assert ran.code == 2
    assert expected in ran.error
    assert [path.name for path in tmp_path.iterdir()] == ["short.toml"]


@pytest.mark.parametrize(
    ("interrupted", "words"),
    [
        ("executors.make_executor", None),
        ("store.ResultStore.finish", "finished results are in a.parquet.parts, the same command continues from there"),
        ("summary.shares", "all flights are finished, their results are in a.parquet; the same command shows them"),
    ],
)
def test_an_interrupted_campaign_says_where_its_results_are(campaign, monkeypatch, interrupted, words):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"hsv.flight.campaign.{interrupted}", interrupt)
    ran = campaign("--out", "a.parquet", "--no-page")
    assert (ran.code, ran.out, ran.error) == (130, "", f"interrupted; {words}" if words else "interrupted")


DRAWN = """
extends = "short.toml"
[initial]
velocity = { uniform = ["7890 ft/s", "7910 ft/s"] }
[integral]
rate = { normal = ["0.05 / s", "0.01 / s"] }
"""


@pytest.fixture
def drawn(hsv, tmp_path):
    """Fly a small campaign over distributions with the command."""
    short_scenario(tmp_path, duration=3, fault=2)
    (tmp_path / "drawn.toml").write_text(DRAWN)
    words = ("--samples", "5", "--scale", "0", "--workers", "1", "--out", "drawn.parquet", "--no-page")
    assert hsv("montecarlo", "drawn.toml", *words).code == 0
    return "drawn.parquet"


def test_a_flight_printed_as_a_scenario_flies_by_itself_with_its_fingerprint(drawn, hsv, tmp_path):
    (tmp_path / "one.toml").write_text(hsv("montecarlo", "scenario", drawn, "--flight", "3").out)
    replayed = hsv("montecarlo", "replay", drawn, "--flight", "3", "--json").json
    assert replayed["identical"]
    assert hsv("simulate", "one.toml", "--json").json["fingerprint"] == replayed["fingerprint"]


def test_a_flight_keeps_the_design_that_was_flown(drawn, hsv, tmp_path, monkeypatch):
    replayed = hsv("montecarlo", "replay", drawn, "--flight", "3", "--json").json
    (tmp_path / "designs").mkdir()
    other = find_design("baseline").read_text().replace("period: 0.02", "period: 0.01")
    (tmp_path / "designs" / "baseline.yaml").write_text(other)
    monkeypatch.setenv("HSV_DESIGN_PATH", str(tmp_path / "designs"))
    refused = hsv("montecarlo", "scenario", drawn, "--flight", "3")
    assert refused.code == 2 and "'baseline': not the one that the campaign flew" in refused.error
    text = hsv("montecarlo", "scenario", drawn, "--flight", "3", "--design", "kept.yaml").out
    (tmp_path / "one.toml").write_text(text)
    assert hsv("simulate", "one.toml", "--json").json["fingerprint"] == replayed["fingerprint"]


def test_a_distribution_is_shown_but_not_flown_alone(drawn, hsv):
    assert "7910 ft/s" in hsv("list", "scenarios", "drawn.toml").out
    for command in ("simulate", "run"):
        refused = hsv(command, "drawn.toml")
        assert refused.code == 2
        assert refused.error.startswith(
            "scenario 'drawn': initial.velocity: a distribution, which hsv montecarlo draws"
        )


def test_campaigns_are_compared_and_plotted(campaign, hsv, tmp_path):
    swept = ("--factor", "fault[0].effectiveness=0.9,0.5", "--samples", "4", "--no-page")
    assert campaign(*swept, "--out", "a.parquet").code == 0
    assert campaign(*swept, "--out", "b_c.parquet").code == 0
    files = ("--csv", "t.csv", "--latex", "t.tex", "--out", "figure.pdf", "--size", "120x90mm")
    compared = hsv("compare", "a.parquet", "b_c.parquet", *files)
    assert compared.code == 0 and "b_c: 8 pairs finish" in compared.out
    assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")
    assert r"b\_c" in (tmp_path / "t.tex").read_text() and "tube_level,b_c" in (tmp_path / "t.csv").read_text()
    assert "95 % interval" in (tmp_path / "comparison.html").read_text()
    rows = hsv("compare", "a.parquet", "b_c.parquet", "--json", "--metric", "altitude_end_error").json["rows"]
    assert [row["metric"] for row in rows] == ["flown_to_the_end"] * 2 + ["altitude_end_error"] * 2
    panels = "survival,altitude_error,altitude_end,altitude_end over mass"
    assert hsv("plot", "a.parquet", "b_c.parquet", "--panels", panels, "--out", "all.png").code == 0
    assert (tmp_path / "all.png").stat().st_size > 10_000
    assert hsv("plot", "a.parquet", "--panels", "height").error.startswith("panels: 'height', expected")
    assert hsv("compare", "a.parquet").error == "1 campaign: expected at least two to compare"


class Failing:
    """A controller that holds the trim and fails if the flight starts above an altitude."""

    PARAMETERS = (Parameter("failing.above", 0.0, "altitude", "m", 0.0, 1e5),)

    @classmethod
    def from_parameters(cls, values, design):
        made = cls()
        made.above = validate(cls.PARAMETERS, values)["failing.above"]
        return made

    def reset(self):
        pass

    def step(self, inputs):
        if inputs.estimate[0] > self.above:
            raise ValueError("too high")
        return inputs.reference_input


@pytest.mark.parametrize(("above", "code"), [("0 ft", 1), long("85500 ft", 0)])
def test_a_campaign_fails_only_where_every_flight_crashed(hsv, tmp_path, above, code):
    short_scenario(tmp_path, duration=3, fault=2)
    own = f'extends = "short.toml"\ncontroller = "{__name__}:Failing"\ndesign = ""\n[failing]\nabove = "{above}"\n'
    (tmp_path / "own.toml").write_text(own)
    words = ("--samples", "4", "--scale", "0", "--factor", "initial.altitude=85400 ft..85600 ft", "--workers", "1")
    for flown in (4, 0):
        ran = hsv("montecarlo", "own.toml", *words, "--out", "own.parquet", "--no-page", "--json")
        assert (ran.code, ran.json["flown_now"]) == (code, flown)
        [ended] = ran.json["limits"]
        assert ended["within"] == 0 if code else 0 < ended["within"] < 4
        said = [re.sub(r" \(test_montecarlo.py:\d+\)$", "", line) for line in ran.err.splitlines() if "error" in line]
        where = f"{__name__}:Failing, step 0: ValueError: too high"
        assert said == ([f"hsv: error: all 4 flights crashed, the first: {where}"] if code else [])
