import copy
import dataclasses
import json

import pytest

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign, read_certificate, write_certificate
from hsv.design.verification.checks import require
from hsv.design.verification.verifier import verify


def failures(checks):
    return [check.name for made in checks.values() for check in made if not check.ok]


def changed(values, name, index):
    return values | {name: [v * 1.01 if i == index else v for i, v in enumerate(values[name])]}


def test_the_shipped_design_passes_quickly(subject):
    assert failures(verify(subject, quick=True)) == []


@pytest.mark.parametrize(
    ("path", "check"),
    [
        (("feedback", "M"), "feedback.gain = M N^-1"),
        (("feedback", "N"), "feedback.gain = M N^-1"),
        (("tube", "invariant_set", "Q"), "tube.shape = Q^-1"),
        (("tube", "invariant_set", "half_width"), "certified half-widths from Q"),
        (("tube", "tightening", "lower"), "tightened bounds, lower"),
        (("tube", "tightening", "upper"), "tightened bounds, upper"),
    ],
)
def test_a_changed_certificate_is_caught(subject, path, check):
    certificate = copy.deepcopy(subject.certificate)
    place = certificate
    for key in path:
        place = place[key]
    if isinstance(place[1], list):
        place[1][1] *= 1.01
    else:
        place[1] *= 1.01
    names = failures(verify(dataclasses.replace(subject, certificate=certificate), quick=True))
    assert any(name.startswith(check) for name in names)


def test_the_first_failing_claim_is_named(subject):
    values = subject.design.to_parameters()
    design = ControlDesign.from_parameters(changed(values, "feedback.gain", 2))
    checks = verify(dataclasses.replace(subject, design=design), quick=True)
    with pytest.raises(DesignError, match=r"check fails: feedback\.gain = M N\^-1\[0, 2\]"):
        require(check for made in checks.values() for check in made)


def test_a_certificate_without_a_field_says_which(subject):
    certificate = copy.deepcopy(subject.certificate)
    del certificate["tube"]["invariant_set"]["Q"]
    checks = verify(dataclasses.replace(subject, certificate=certificate), quick=True)
    assert [check.value for check in checks["invariant set"] if not check.ok] == ["no field 'Q'"]


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
