"""Agreement of computed designs with the shipped ones, also from other processors; wrong inputs are named."""

import copy
import dataclasses
import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from hsv.base.errors import DesignError
from hsv.certificate.tolerances import PARAMETERS
from hsv.design.agreement import deviations
from hsv.design.inputs import parse_inputs, read_inputs


def test_a_design_agrees_with_itself(subject):
    found = deviations(subject.design, subject)
    assert {d.parameter for d in found} == set(PARAMETERS) & set(subject.design.to_parameters())
    assert all(d.ok and d.scaled == 0.0 for d in found)


def test_a_deviation_is_counted_in_scaled_coordinates_and_named(subject):
    gains = subject.design.nominal_gains.copy()
    scale = 0.1 / 0.02  # scale of elevator over scale of angle of attack
    expected = float(gains[2, 1, 2])
    gains[2, 1, 2] += 0.01 * max(scale, abs(expected))
    changed = dataclasses.replace(subject.design, nominal_gains=gains)
    worst = max(deviations(changed, subject), key=lambda d: d.scaled)
    assert (worst.parameter, worst.index, worst.ok) == ("nominal.gains", (2, 1, 2), False)
    assert abs(worst.scaled - 0.01) < 1e-9
    assert str(worst).startswith(f"nominal.gains[2, 1, 2] = {float(gains[2, 1, 2])!r}: expected {expected!r}")
    slightly = subject.design.nominal_gains.copy()
    slightly[:, :, 5:] += 1e-9  # these entries are zero, but deviations are relative to the scale
    assert all(d.ok for d in deviations(dataclasses.replace(subject.design, nominal_gains=slightly), subject))


OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture
def table():
    return tomllib.loads((OFFLINE_DESIGN / "baseline.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", sorted(OFFLINE_DESIGN.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_inputs_load_and_carry_their_name(path):
    assert read_inputs(path).name == path.stem


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("feedback.state_scale.altitude", "20 s", "feedback.state_scale.altitude = '20 s': wrong unit"),
        ("feedback.state_scale.altitude", "-20 ft", "feedback.state_scale.altitude = '-20 ft': input should be"),
        ("model.representation", "lucky", "model.representation = 'lucky': input should be"),
        ("model.grid.altitude_vertices", 1, "model.grid.altitude_vertices = 1: input should be greater than or equal"),
        ("nominal.input_bound.elevator", "5 deg", "nominal.input_bound.elevator: unknown field"),
    ],
)
def test_a_wrong_field_is_named(table, path, value, message):
    *parents, leaf = path.split(".")
    changed = copy.deepcopy(table)
    branch = changed
    for parent in parents:
        branch = branch[parent]
    branch[leaf] = value
    with pytest.raises(DesignError) as caught:
        parse_inputs(changed)
    assert str(caught.value).startswith(message)


def test_a_missing_field_is_named(table):
    del table["nominal"]["target"]["velocity"]
    with pytest.raises(DesignError, match=r"nominal.target.velocity: missing"):
        parse_inputs(table)


AGREED = 1e-4
"""Largest deviation in scaled coordinates; `hsv design --check` itself allows a tenth of it."""

WITHOUT_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA"}
PROCESSORS = {
    "Haswell, two threads": {"OPENBLAS_CORETYPE": "Haswell", "OPENBLAS_NUM_THREADS": "2"},
    "Nehalem, libm without FMA": {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"} | WITHOUT_FMA,
}


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("name", "processor"),
    [
        ("baseline", "Haswell, two threads"),
        *((name, "Nehalem, libm without FMA") for name in ("adjustable", "realistic", "winged_cone")),
        pytest.param(
            "tight",
            "Nehalem, libm without FMA",
            marks=pytest.mark.xfail(strict=True, reason="one entry of its invariant set comes out 12 % different"),
        ),
    ],
)
def test_a_shipped_design_comes_out_as_shipped(name, processor):
    words = [sys.executable, "-m", "hsv.cli.entry", "design", name, "--check", "--json"]
    ran = subprocess.run(words, env=os.environ | PROCESSORS[processor], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    found = {d["parameter"]: d["scaled"] for d in json.loads(ran.stdout)["deviations"]}
    assert {parameter: scaled for parameter, scaled in found.items() if scaled > AGREED} == {}
