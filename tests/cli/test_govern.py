import json

import pytest

from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario


def test_the_file_that_it_writes_flies_the_reference_inside_the_inputs(hsv, tmp_path):
    path = tmp_path / "governed.toml"
    found = json.loads(hsv("govern", "case1", "--blend", "4 s", "--out", str(path), "--json").out)
    flight = fly(assemble_flight(load_scenario(str(path))))
    metrics = flight.metrics
    assert metrics["saturated_steps"] == 0
    (_, first), (_, last) = ((c["time_s"], c["altitude_m"]) for c in (found["corners"][0], found["corners"][-1]))
    assert flight.reference[[0, -1], 0] == pytest.approx([first, last], rel=1e-12)
    assert found["end_s"] == found["corners"][-1]["time_s"] + found["blend_s"]
    for name, plan in found["plan"].items():
        assert plan["lower_bound"] < plan["least"] < plan["largest"] < plan["upper_bound"], name
    shown = hsv("govern", "case1", "--blend", "4 s", "--units", "paper").out
    assert f"at rest from {found['end_s']:g} s on" in shown


def test_a_file_that_exists_is_kept(hsv, tmp_path):
    path = tmp_path / "kept.toml"
    path.write_text("mine")
    refused = hsv("govern", "case1", "--out", str(path))
    assert (refused.code, path.read_text()) == (2, "mine")
    assert "exists, expected a new file, or --force" in refused.err


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("case1", "--blend", "0 s"), "blend = 0 s: expected above 0"),
        (("case1", "--blend", "1e9 s"), "blend = 1e+09 s: expected above 0 s, up to 600 s"),
        (("case1_rmpc",), "controller = 'robust_mpc', design = 'baseline_single_k': expected tube_mpc"),
        (("case1_qp",), "nominal.law = 'qp': expected 'family'"),
    ],
)
def test_what_cannot_be_governed_is_refused_in_one_line(hsv, arguments, why):
    refused = hsv("govern", *arguments)
    assert refused.code == 2
    assert why in refused.err and refused.err.startswith("hsv: error: ") and refused.err.count("\n") == 1
