"""What the controller checks at its start: what refuses a design, what is only told."""

import copy
import subprocess
import sys

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.control.design import (
    ControlDesign,
    certificate_path,
    find_design,
    read_certificate,
    read_design,
    read_parameters,
    write_certificate,
)
from hsv.design.verification.preflight import preflight


@pytest.fixture(scope="module")
def shipped():
    return read_parameters(find_design("baseline"))


def with_entry(values, name, index, factor):
    changed = [v * factor if i == index else v for i, v in enumerate(values[name])]
    return ControlDesign.from_parameters(values | {name: changed})


@pytest.mark.parametrize(
    "name",
    [
        "baseline",
        "baseline_single_k",
        "baseline_derived",
        "adjustable",
        "realistic",
        "smooth",
        "governed",
        "tight",
        "derived",
    ],
)
def test_shipped_designs_fly_without_a_word(name):
    assert preflight(read_design(find_design(name))) == ""


def test_a_design_that_was_tuned_a_little_flies_with_a_warning(shipped):
    warning = preflight(with_entry(shipped, "feedback.gain", 12, 1.0 + 1e-6))
    assert warning.startswith("design 'baseline' is not as certified: feedback.gain = M N^-1[1, 3]: ")
    assert "nominal.input_bound" in preflight(with_entry(shipped, "nominal.input_bound", 0, 1.01))


@pytest.mark.parametrize(
    ("name", "index", "factor", "check"),
    [
        # Stable at every vertex still, but no longer with the certified Lyapunov function.
        ("feedback.gain", 13, 0.7, r"\(24\)"),
        ("nominal.gains", 13, 1.5, "nominal gain 0: decrease at vertex"),
        ("tube.centre", 1, 1.01, r"tube\.centre\[1\]"),
        ("tube.shape", 0, 1.01, r"tube\.shape = Q\^-1\[0, 0\]"),
        ("tube.half_width", 2, 0.99, r"tube\.half_width from Q\[2\]"),
    ],
)
def test_a_design_without_its_stability_or_its_set_is_refused(shipped, name, index, factor, check):
    with pytest.raises(DesignError, match=rf"design 'baseline': check fails: .*{check}"):
        preflight(with_entry(shipped, name, index, factor))


def test_a_set_that_is_not_invariant_is_refused(shipped, tmp_path):
    certificate = read_certificate(certificate_path(find_design("baseline")))
    small = copy.deepcopy(certificate)
    described = small["tube"]["invariant_set"]
    described["Q"] = (0.9 * np.array(described["Q"])).tolist()
    described["half_width"] = (np.sqrt(0.9) * np.array(described["half_width"])).tolist()
    write_certificate(tmp_path / "small.json", small)
    values = shipped | {
        "tube.shape": (np.array(shipped["tube.shape"]) / 0.9).tolist(),
        "tube.half_width": described["half_width"],
    }
    with pytest.raises(DesignError, match="check fails: invariance, smallest eigenvalue over the vertices"):
        preflight(ControlDesign.from_parameters(values), str(tmp_path / "small.json"))


def test_a_design_without_a_certificate_flies_with_a_warning(shipped):
    mine = ControlDesign.from_parameters(shipped | {"design.name": "mine"})
    assert preflight(mine) == "design 'mine': no certificate found, not verified"
    with pytest.raises(DesignError, match=r"absent\.json: cannot be read"):
        preflight(mine, "absent.json")


def test_the_check_needs_neither_solvers_nor_units():
    code = (
        "import sys, hsv.design.verification.preflight; print([m for m in ('cvxpy', 'pydantic') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
