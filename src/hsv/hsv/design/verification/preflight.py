"""The check of a design before it flies: the quick claims, for the controller node to make at its start."""

from __future__ import annotations

from functools import partial

from hsv.control.design import ControlDesign
from hsv.design.certificate import find_certificate, read_certificate
from hsv.design.verification.claims import Subject, gathered, require
from hsv.design.verification.quick import QUICK
from hsv.errors import DesignError


def preflight(design: ControlDesign, certificate: str = "") -> str:
    """Return what is to be warned of before ``design`` flies, mostly nothing.

    A design that differs from the one that was certified may fly, people tune, as long as what its safety rests on
    holds for it: sizes and types; gains stable at every vertex; one Lyapunov function for F with (24), one for every K
    with (34); the invariant set that is watched in flight is the certified one, and invariant at every vertex under the
    gain that flies. Each of these refuses. Everything else that no longer agrees with the certificate is a warning, and
    so is a design without a certificate. That is the file ``certificate`` or, where none is named, the one beside the
    design's own file.

    Raises:
        DesignError: Names the claim that refuses, or the certificate that cannot be read.
    """
    path = find_certificate(design.name, certificate)
    if path is None:
        return f"design {design.name!r}: no certificate found, not verified"
    subject = Subject(design, read_certificate(path))
    claims = [claim for name, part in QUICK.items() for claim in gathered(name, partial(part, subject))]
    try:
        require(claim for claim in claims if claim.required)
    except DesignError as error:
        raise DesignError(f"design {design.name!r}: {error}") from error
    return next((f"design {design.name!r} is not as certified: {claim}" for claim in claims if not claim.ok), "")
