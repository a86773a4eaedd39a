"""Check of a design before a flight: the quick checks, which the controller node makes at its start."""

from __future__ import annotations

from functools import partial

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign, find_certificate, read_certificate
from hsv.design.verification.checks import Subject, gathered, require
from hsv.design.verification.quick import QUICK


def preflight(design: ControlDesign, certificate: str = "") -> str:
    """Return warnings about ``design`` before a flight, usually none.

    A design that differs from the one that was certified may fly, people tune, as long as what its safety rests on
    holds for it: sizes and types; gains stable at every vertex; one Lyapunov function for F with (24), one for every K
    with (34); the invariant set that is watched in flight is the certified one, and invariant at every vertex under the
    gain that flies. Each of these refuses. Everything else that no longer agrees with the certificate is a warning, and
    so is a design without a certificate. That is the file ``certificate`` or, where none is named, the one beside the
    design's own file.

    Raises:
        DesignError: Names the check that fails, or the certificate that cannot be read.
    """
    path = find_certificate(design.name, certificate)
    if path is None:
        return f"design {design.name!r}: no certificate found, not verified"
    subject = Subject(design, read_certificate(path))
    checks = [check for name, part in QUICK.items() for check in gathered(name, partial(part, subject))]
    try:
        require(check for check in checks if check.required)
    except DesignError as error:
        raise DesignError(f"design {design.name!r}: {error}") from error
    return next((f"design {design.name!r} is not as certified: {check}" for check in checks if not check.ok), "")
