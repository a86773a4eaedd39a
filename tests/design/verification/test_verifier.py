import copy
import dataclasses
import json

import numpy as np
import pytest

from hsv.control.design_file import ControlDesign
from hsv.design.certificate import read_certificate, write_certificate
from hsv.design.model import polytopic_model
from hsv.design.verification.model import model_claims
from hsv.design.verification.verifier import QUICK, require, verify
from hsv.errors import DesignError
from hsv.vehicle.parameters import vehicle_parameters

WALKED = ("feedback.gain", "nominal.gains", "nominal.ellipsoids", "tube.centre", "tube.shape", "tube.half_width")
BOUNDS = ("input.minimum", "input.maximum", "nominal.input_bound", "nominal.state_scale", "nominal.input_scale")
BOUNDS += ("nominal.input_minimum", "nominal.input_maximum", "nominal.region_minimum", "nominal.region_maximum")
OTHERS = ("period", "notch.zero_frequency", "notch.zero_damping", "notch.pole_frequency", "notch.pole_damping")


def failures(claims):
    return [claim.name for claim in claims if not claim.ok]


def changed(values, name, index):
    altered = dict(values)
    if index is None:
        altered[name] = values[name] * 1.01
    else:
        altered[name] = [v * 1.01 if i == index else v for i, v in enumerate(values[name])]
    return altered


def entries(values, names):
    for name in names:
        if isinstance(values[name], list):
            yield from ((name, i) for i, v in enumerate(values[name]) if v != 0.0)
        else:
            yield name, None


def caught(subject, parameters, parts):
    """Whether a claim fails; a design that the nodes refuse to load is caught too."""
    try:
        design = ControlDesign.from_parameters(parameters)
    except DesignError:
        return True
    altered = dataclasses.replace(subject, design=design)
    return any(not claim.ok for part in parts for claim in part(altered))


def test_the_shipped_design_passes_quickly(subject):
    assert failures(verify(subject, quick=True)) == []


def test_every_small_entry_is_caught_without_the_hash(subject):
    values = subject.design.to_parameters()
    parts = [QUICK["inputs"], QUICK["feedback gain"], QUICK["nominal gains"], QUICK["invariant set"]]
    missed = []
    for name, index in entries(values, WALKED + BOUNDS + OTHERS):
        try:
            if not caught(subject, changed(values, name, index), parts):
                missed.append((name, index))
        except DesignError:
            continue  # a recomputation that breaks down is a refusal too
    assert missed == []


def test_every_vertex_and_weight_is_caught(subject):
    model = polytopic_model(subject.inputs.model, vehicle_parameters("decoupled"))
    assert failures(model_claims(subject, model)) == []
    design, missed = subject.design, []
    arrays = {
        "A": design.polytope.A,
        "B": design.polytope.B,
        "h": design.altitude_samples[0],
        "hw": design.altitude_samples[1],
        "v": design.velocity_samples[0],
        "vw": design.velocity_samples[1],
    }
    for name, array in arrays.items():
        noise = np.abs(array).max(axis=0) < 1e-15 if name in "AB" else np.zeros(array.shape[1:], bool)
        for index in np.argwhere((array != 0.0) & ~noise):
            entry = tuple(index)
            original = array[entry]
            array[entry] = original * 1.01
            if all(claim.ok for claim in model_claims(subject, model)):
                missed.append((name, entry))
            array[entry] = original
    assert missed == []


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
        require(claims)


def test_a_certificate_without_a_field_says_which(subject):
    certificate = copy.deepcopy(subject.certificate)
    del certificate["tube"]["invariant_set"]["Q"]
    claims = verify(dataclasses.replace(subject, certificate=certificate), quick=True)
    assert "no field 'Q'" in [claim.value for claim in claims if not claim.ok]


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
