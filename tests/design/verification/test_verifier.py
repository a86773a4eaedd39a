import copy
import dataclasses
import json

import numpy as np
import pytest

from hsv.control.design_file import ControlDesign
from hsv.design.certificate import read_certificate, write_certificate
from hsv.design.verification.claims import require
from hsv.design.verification.model import model_claims
from hsv.design.verification.quick import QUICK
from hsv.design.verification.verifier import verify
from hsv.errors import DesignError

ARRAYS = {
    "feedback.gain": (lambda design: design.feedback_gain, "feedback gain"),
    "nominal.gains": (lambda design: design.nominal_gains, "nominal gains"),
    "nominal.ellipsoids": (lambda design: design.nominal_ellipsoids, "nominal gains"),
    "nominal.input_bound": (lambda design: design.nominal_input_bound, "nominal gains"),
    "nominal.state_scale": (lambda design: design.nominal_state_scale, "nominal gains"),
    "nominal.input_scale": (lambda design: design.nominal_input_scale, "nominal gains"),
    "tube.centre": (lambda design: design.tube.centre, "invariant set"),
    "tube.shape": (lambda design: design.tube.shape, "invariant set"),
    "tube.half_width": (lambda design: design.tube.half_width, "invariant set"),
    "nominal.input_minimum": (lambda design: design.plan_bounds.input_minimum, "invariant set"),
    "nominal.input_maximum": (lambda design: design.plan_bounds.input_maximum, "invariant set"),
    "nominal.region_minimum": (lambda design: design.plan_bounds.region_minimum, "invariant set"),
    "nominal.region_maximum": (lambda design: design.plan_bounds.region_maximum, "invariant set"),
    "input.minimum": (lambda design: design.input_minimum, "inputs"),
    "input.maximum": (lambda design: design.input_maximum, "inputs"),
}
"""Every array of a design beside its model, and the part of the claims that has to notice a change of it."""

NUMBERS = ("period", "notch.zero_frequency", "notch.zero_damping", "notch.pole_frequency", "notch.pole_damping")


def failures(claims):
    return [claim.name for made in claims.values() for claim in made if not claim.ok]


def changed(values, name, index=None):
    altered = dict(values)
    if index is None:
        altered[name] = np.multiply(values[name], 1.01).tolist()
    else:
        altered[name] = [v * 1.01 if i == index else v for i, v in enumerate(values[name])]
    return altered


def missed(array, holds, noise=False):
    """Return the entries of ``array`` whose change by 1 % leaves ``holds()`` true, one after the other."""
    found = []
    for index in np.argwhere((array != 0.0) & ~np.asarray(noise)):
        entry = tuple(index)
        original = array[entry]
        array[entry] = original * 1.01
        try:
            if holds():
                found.append(entry)
        except DesignError:
            pass  # a recomputation that breaks down is a refusal too
        array[entry] = original
    return found


def test_the_shipped_design_passes_quickly(subject):
    assert failures(verify(subject, quick=True)) == []


def test_the_walk_knows_every_parameter(subject):
    model = {name for name in subject.design.to_parameters() if name.startswith(("model.", "scheduling.", "design."))}
    assert set(subject.design.to_parameters()) == model | set(ARRAYS) | set(NUMBERS)


@pytest.mark.parametrize("name", ARRAYS)
def test_every_small_entry_is_caught_without_the_hash(subject, name):
    array, part = ARRAYS[name]
    # Claims are recomputed one by one, up to the first that fails.
    assert missed(array(subject.design), lambda: all(claim.ok for claim in QUICK[part](subject))) == []


@pytest.mark.parametrize("name", NUMBERS)
def test_period_and_notch_are_caught_without_the_hash(subject, name):
    design = ControlDesign.from_parameters(changed(subject.design.to_parameters(), name))
    assert not all(claim.ok for claim in QUICK["inputs"](dataclasses.replace(subject, design=design)))


def test_every_vertex_and_weight_is_caught(subject, model):
    assert [claim.name for claim in model_claims(subject, model) if not claim.ok] == []
    design = subject.design
    for name, array in {
        "A": design.polytope.A,
        "B": design.polytope.B,
        "altitudes": design.altitude_samples[0],
        "altitude weights": design.altitude_samples[1],
        "velocities": design.velocity_samples[0],
        "velocity weights": design.velocity_samples[1],
    }.items():
        noise = np.broadcast_to(np.abs(array).max(axis=0) < 1e-15, array.shape) if name in "AB" else False
        assert (name, missed(array, lambda: all(claim.ok for claim in model_claims(subject, model)), noise)) == (
            name,
            [],
        )


@pytest.mark.parametrize(
    ("path", "claim"),
    [
        (("feedback", "M"), "feedback.gain = M N^-1"),
        (("feedback", "N"), "feedback.gain = M N^-1"),
        (("tube", "invariant_set", "Q"), "tube.shape = Q^-1"),
        (("tube", "invariant_set", "half_width"), "certified half-widths from Q"),
        (("tube", "tightening", "lower"), "tightened bounds, lower"),
        (("tube", "tightening", "upper"), "tightened bounds, upper"),
    ],
)
def test_a_changed_certificate_is_caught(subject, path, claim):
    certificate = copy.deepcopy(subject.certificate)
    place = certificate
    for key in path:
        place = place[key]
    if isinstance(place[1], list):
        place[1][1] *= 1.01
    else:
        place[1] *= 1.01
    names = failures(verify(dataclasses.replace(subject, certificate=certificate), quick=True))
    assert any(name.startswith(claim) for name in names)


def test_the_first_failing_claim_is_named(subject):
    values = subject.design.to_parameters()
    design = ControlDesign.from_parameters(changed(values, "feedback.gain", 2))
    claims = verify(dataclasses.replace(subject, design=design), quick=True)
    with pytest.raises(DesignError, match=r"claim fails: feedback\.gain = M N\^-1\[0, 2\]"):
        require(claim for made in claims.values() for claim in made)


def test_a_certificate_without_a_field_says_which(subject):
    certificate = copy.deepcopy(subject.certificate)
    del certificate["tube"]["invariant_set"]["Q"]
    claims = verify(dataclasses.replace(subject, certificate=certificate), quick=True)
    assert [claim.value for claim in claims["invariant set"] if not claim.ok] == ["no field 'Q'"]


def test_certificates_are_reproducible_bytes(subject, tmp_path):
    path = tmp_path / "x.certificate.json"
    write_certificate(path, subject.certificate)
    first = path.read_bytes()
    write_certificate(path, read_certificate(path))
    assert path.read_bytes() == first
    assert "time" not in json.dumps(subject.certificate["feedback"]["solver"])
    path.write_text("{}")
    with pytest.raises(DesignError, match="expected a design certificate"):
        read_certificate(path)
