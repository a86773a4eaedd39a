"""The independent verification: the fields that it recomputes, those that it rejects, and those that it only lists."""

import copy
import dataclasses
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from marking import long
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.certificate.checks import STATED, Subject, field_checks, gathered, leaves, load_subject, same
from hsv.certificate.tolerances import PARAMETERS, TOLERANCES
from hsv.certificate.verification import QUICK, RECOMPUTED, input_checks, preflight
from hsv.control.design import ControlDesign
from hsv.control.design_file import certificate_path, find_design, read_certificate, read_parameters, write_certificate

PARTS = QUICK | RECOMPUTED
DESIGNS = sorted(path.stem for path in Path(__file__).parents[2].glob("offline_design/*.toml"))


def made(subject, parts=PARTS):
    return [check for name, part in parts.items() for check in gathered(name, partial(part, subject))]


def failing(subject, parts=PARTS):
    """Return the name of the first failing check, or "". Parts of the verification run until one fails."""
    for name, part in parts.items():
        for check in gathered(name, partial(part, subject)):
            if not check.ok:
                return check.name
    return ""


FILTER = sorted(name for name in PARAMETERS if name == "period" or name.startswith("notch."))


@pytest.fixture(scope="module")
def baseline():
    return load_subject(find_design("baseline"))


@pytest.fixture(scope="module")
def shipped():
    return read_parameters(find_design("baseline"))


@pytest.mark.parametrize("name", [name if name in ("baseline", "derived") else long(name) for name in DESIGNS])
def test_every_shipped_design_passes(name):
    failing = [check.name for check in made(load_subject(find_design(name))) if not check.ok]
    assert failing == (["share of W"] if name == "baseline_derived" else [])


def test_nothing_is_shared_with_the_design():
    code = (
        "import sys, hsv.certificate.verification; "
        "print([m for m in sys.modules if m.startswith('hsv.design') or m in ('cvxpy', 'pydantic')])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def place(certificate, field):
    """Return the table or list that contains a field, and the field's key in it; keys may contain dots."""
    if field in certificate:
        return certificate, field
    key, _, inside = field.partition(".")
    return place(certificate[int(key) if isinstance(certificate, list) else key], inside)


@pytest.mark.parametrize("name", FILTER)
def test_period_and_notch_are_held_to_their_tolerance(baseline, shipped, name):
    changed = np.array(shipped[name]) + 10.0 * TOLERANCES[PARAMETERS[name]].allowed(np.array(shipped[name]))
    design = ControlDesign.from_parameters(shipped | {name: changed.tolist()})
    assert failing(dataclasses.replace(baseline, design=design), {"inputs": QUICK["inputs"]})


def test_a_falsified_certificate_is_refused_field_by_field(baseline):
    certificate = copy.deepcopy(baseline.certificate)
    false = {"vertices": 1, "units": "US", "name": "other"}
    for gain in ("feedback", *(f"nominal.{i}" for i in range(7))):
        false[f"{gain}.spectral_radius_all_states"] = 0.5
    false["model.accuracy.relative_frobenius_error"] = 0.0
    for field, value in false.items():
        table, last = place(certificate, field)
        table[last] = value
    failed = {check.name for check in made(Subject(baseline.design, certificate)) if not check.ok}
    assert failed >= set(false)


def test_a_closed_loop_whose_modes_are_just_unstable_is_refused(baseline):
    design, A = baseline.design, baseline.design.polytope.A.copy()
    A[:, 5:, 5:] *= 1.005 / np.abs(np.linalg.eigvals(A[:, 5:, 5:])).max()
    unstable = dataclasses.replace(design, polytope=dataclasses.replace(design.polytope, A=A))
    failed = [check.name for check in made(dataclasses.replace(baseline, design=unstable)) if not check.ok]
    assert "spectral radius of A + BK, gain 0" in failed


def test_an_unknown_field_is_refused_and_named(baseline):
    certificate = copy.deepcopy(baseline.certificate)
    certificate["inputs"]["disturbance"]["probability"] = 0.1
    known = [leaf for leaf in leaves(baseline.certificate) if leaf not in STATED]
    [check] = field_checks(Subject(baseline.design, certificate), [], known)
    assert str(check) == "inputs.disturbance.probability: unknown field, expected none of that name"
    del certificate["versions"]
    with pytest.raises(KeyError, match="versions"):
        list(field_checks(Subject(baseline.design, certificate), [], known))


def test_a_certificate_of_the_first_format_says_what_to_do(baseline, tmp_path):
    path = tmp_path / "old.certificate.json"
    write_certificate(path, {key: value for key, value in baseline.certificate.items() if key != "format"})
    with pytest.raises(DesignError, match=r"format = 1: expected 2; compute the design again with hsv design NAME"):
        read_certificate(path)


def test_the_inputs_of_a_vehicle_are_complete():
    subject = load_subject(find_design("winged_cone"))
    certificate = copy.deepcopy(subject.certificate)
    del certificate["inputs"]["vehicle"]["vehicle.mass"]
    [check] = [c for c in input_checks(Subject(subject.design, certificate)) if c.name == "inputs.vehicle"]
    assert str(check) == "inputs.vehicle: vehicle.mass, expected complete"


def test_a_certificate_without_a_field_says_which(baseline):
    certificate = copy.deepcopy(baseline.certificate)
    del certificate["tube"]["invariant_set"]["Q"]
    checks = made(Subject(baseline.design, certificate), {"invariant set": QUICK["invariant set"]})
    assert [check.value for check in checks if not check.ok] == ["no field 'Q'"]


def test_a_wider_range_of_the_factor_than_certified_is_refused():
    subject = load_subject(find_design("adjustable"))
    values = subject.design.to_parameters() | {"feedback.tau_minimum": [0.7]}
    checks = made(dataclasses.replace(subject, design=ControlDesign.from_parameters(values)), QUICK)
    assert any(c.name.startswith("feedback.tau_minimum") and c.required for c in checks if not c.ok)


def with_entry(values, name, index, factor):
    changed = [v * factor if i == index else v for i, v in enumerate(values[name])]
    return ControlDesign.from_parameters(values | {name: changed})


def test_a_tuned_gain_flies_with_a_warning(baseline, shipped):
    assert preflight(baseline.design) == ""
    warning = preflight(with_entry(shipped, "feedback.gain", 12, 1.000001))
    assert warning.startswith("design 'baseline' is not as certified: feedback.gain = M N^-1[1, 3]: ")
    assert "nominal.input_bound" in preflight(with_entry(shipped, "nominal.input_bound", 0, 1.01))


@pytest.mark.parametrize(
    ("name", "index", "factor", "check"),
    [
        # The loop is still stable at every vertex, but not with the certified Lyapunov function.
        ("feedback.gain", 13, 0.7, r"\(24\)"),
        ("nominal.gains", 13, 1.5, r"nominal\.0: decrease of the cost"),
        ("tube.centre", 1, 1.01, r"tube\.centre\[1\]"),
        ("tube.shape", 0, 1.01, r"tube\.shape = Q\^-1\[0, 0\]"),
        ("tube.half_width", 2, 0.99, r"tube\.half_width from Q\[2\]"),
    ],
)
def test_a_design_without_its_stability_or_its_set_is_refused(shipped, name, index, factor, check):
    with pytest.raises(DesignError, match=rf"design 'baseline': check fails: .*{check}"):
        preflight(with_entry(shipped, name, index, factor))


def test_a_set_that_is_not_invariant_is_refused(shipped, tmp_path):
    small = read_certificate(certificate_path(find_design("baseline")))
    described = small["tube"]["invariant_set"]
    described["Q"] = (0.9 * np.array(described["Q"])).tolist()
    described["half_width"] = (np.sqrt(0.9) * np.array(described["half_width"])).tolist()
    write_certificate(tmp_path / "small.json", small)
    values = shipped | {
        "tube.shape": (np.array(shipped["tube.shape"]) / 0.9).tolist(),
        "tube.half_width": described["half_width"],
    }
    with pytest.raises(DesignError, match="check fails: tube: invariance, smallest eigenvalue over the vertices"):
        preflight(ControlDesign.from_parameters(values), str(tmp_path / "small.json"))


def test_a_design_without_a_certificate_flies_with_a_warning(shipped):
    mine = ControlDesign.from_parameters(shipped | {"design.name": "mine"})
    assert preflight(mine) == "design 'mine': no certificate found, not verified"
    with pytest.raises(DesignError, match=r"absent\.json: cannot be read"):
        preflight(mine, "absent.json")


PAGE = Path(__file__).parents[2] / "docs" / "tolerances.md"


def test_the_page_has_the_numbers_of_the_table():
    rows = [line.split("|") for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")][2:]
    written = {row[1].partition(":")[0].strip(): (float(row[2]), float(row[3])) for row in rows}
    assert written == {name: tuple(tolerance) for name, tolerance in TOLERANCES.items()}
    kinds = [row[1].strip().partition(": ") for row in rows]
    named = {name.strip("`"): kind for kind, _, names in kinds for name in names.split(", ") if name}
    assert named == PARAMETERS


def test_a_difference_is_held_to_the_larger_of_two_bounds():
    t = TOLERANCES["model.a"]
    expected, size = np.array([2.0, 0.0, 1e-20]), np.array([1.0, 3.0, 3.0])
    allowed = t.allowed(expected, size)
    assert_allclose(allowed, [2.0 * t.relative, 3.0 * t.absolute, 3.0 * t.absolute])
    assert same("x", expected + 0.99 * allowed, expected, "model.a", size).ok
    for entry in range(3):
        outside = expected.copy()
        outside[entry] += 1.01 * allowed[entry]
        check = same("x", outside, expected, "model.a", size)
        assert not check.ok and check.name == f"x[{entry}]"


def test_what_is_no_number_or_of_another_shape_fails():
    assert not same("x", [1.0, float("nan")], [1.0, 1.0], "copied").ok
    assert not same("x", 1.0, float("nan"), "copied").ok
    assert not same("x", [1.0], [1.0, 1.0], "copied").ok
    assert same("x", [], [], "copied").ok
