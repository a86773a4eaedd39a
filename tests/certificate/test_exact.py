"""Exact proofs: every design is proved, and the verdict on changed matrices is that of 60-digit arithmetic."""

import copy
import dataclasses
import signal
import subprocess
import sys
from fractions import Fraction
from itertools import islice
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from marking import long

from hsv.certificate.checks import Subject, load_subject
from hsv.certificate.exact import exact_checks, positive_definite, rational, roots_at_most
from hsv.control.design_file import find_design
from hsv.control.notch_filter import discretise, series
from hsv.model.lpv.linearisation import acceleration_channels
from hsv.model.signals import CHANNELS

DESIGNS = sorted(path.stem for path in find_design("baseline").parent.glob("*.toml"))


@pytest.fixture(scope="module")
def baseline():
    return load_subject(find_design("baseline"))


@pytest.mark.parametrize("name", [name if name in ("adjustable", "realistic") else long(name) for name in DESIGNS])
def test_every_design_is_proved(name):
    checks = list(exact_checks(load_subject(find_design(name))))
    assert [str(check) for check in checks if not check.ok] == []
    assert len(checks) == {"adjustable": 21, "derived": 23, "robust": 23, "tight": 23}.get(name, 9)


def changed(subject, what, entry, factor):
    """Return ``subject`` with one entry of M, N, F or Q multiplied; N and Q stay symmetric."""
    if what == "F":
        gain = subject.design.feedback_gain.copy()
        gain[entry] *= factor
        return dataclasses.replace(subject, design=dataclasses.replace(subject.design, feedback_gain=gain))
    certificate = copy.deepcopy(subject.certificate)
    matrix = certificate["tube"]["invariant_set"]["Q"] if what == "Q" else certificate["feedback"][what]
    i, j = entry
    matrix[i][j] *= factor
    if what != "M":
        matrix[j][i] = matrix[i][j]
    return Subject(subject.design, certificate)


def definite(S):
    """Return whether a symmetric matrix is positive definite in mpmath's present precision."""
    try:
        mpmath.cholesky(S)
    except ValueError:
        return False
    return True


def verdicts(subject):
    """Return, in 60-digit arithmetic, whether (24) holds with M and N, and with F, and whether the set is invariant.

    The closed loop is put together here, for one section of the notch filter and ideal actuators.
    """
    design, certificate = subject.design, subject.certificate
    M, N = (mpmath.matrix(certificate["feedback"][name]) for name in "MN")
    inside, channels = certificate["tube"]["invariant_set"], certificate["tube"]["disturbance"]["channels"]
    Q, c, lam = mpmath.matrix(inside["Q"]), mpmath.matrix(inside["centre"]), mpmath.mpf(inside["contraction"])
    F = mpmath.matrix(design.feedback_gain[:, :5].tolist())
    A_s, B_s, C_s, D_s = (np.asarray(each) for each in series(discretise(design.notch, design.period)))
    W = acceleration_channels(subject.vehicle, design.period)
    found = [definite(N), definite(N), definite(Q)]
    for i, factors in enumerate(inside["multipliers"]):
        A, B = (mpmath.matrix(each[i].tolist()) for each in (design.polytope.A[:, :5, :5], design.polytope.B[:, :5]))
        block, image = mpmath.zeros(10), A * N + B * M
        block[:5, :5], block[5:, 5:], block[5:, :5], block[:5, 5:] = N, N, image, image.T
        loop = A + B * F
        found[0] = found[0] and definite(block)
        found[1] = found[1] and definite(N - loop * N * loop.T)
        whole, G = mpmath.zeros(7), mpmath.zeros(7, 8)
        on_rate = B * F[:, 4]
        whole[:5, :5] = A + B * F
        for k in range(5):
            whole[k, 4] = A[k, 4] + on_rate[k] * mpmath.mpf(float(D_s))
            for j in range(2):
                whole[k, 5 + j] = on_rate[k] * mpmath.mpf(float(C_s[j]))
            for j in range(3):
                G[k, j] = mpmath.mpf(float(W[k, j]))
            G[k, 3], G[k, 4] = B[k, 1], on_rate[k]
        for k in range(2):
            whole[5 + k, 4] = mpmath.mpf(float(B_s[k]))
            for j in range(2):
                whole[5 + k, 5 + j] = mpmath.mpf(float(A_s[k, j]))
        G[0, 5] = G[3, 6] = 1
        low, high = ([mpmath.mpf(channels[c.name][side]) for c in CHANNELS] for side in ("lower", "upper"))
        drift = whole * c - c
        for j in range(7):
            drift += G[:, j] * ((low[j] + high[j]) / 2)
            G[:, j] *= (high[j] - low[j]) / 2
        G[:, 7] = drift
        S, total = Q - whole * Q * whole.T / lam, mpmath.fsum(factors)
        for j, factor in enumerate(factors):
            S -= G[:, j] * G[:, j].T * (total / (mpmath.mpf(factor) * (1 - lam)))
        found[2] = found[2] and definite((S + S.T) / 2)
    return found


def at_vertices(subject, kept):
    """Return ``subject`` with the matrices of the vertices ``kept`` alone; the proofs need no weights."""
    polytope, certificate = subject.design.polytope, copy.deepcopy(subject.certificate)
    fewer = SimpleNamespace(A=polytope.A[kept], B=polytope.B[kept])
    inside = certificate["tube"]["invariant_set"]
    inside["multipliers"] = [inside["multipliers"][i] for i in kept]
    return Subject(dataclasses.replace(subject.design, polytope=fewer), certificate)


@pytest.mark.parametrize(("changes", "vertices"), [(4, 20), pytest.param(500, 4, marks=pytest.mark.long)])
def test_the_verdict_is_that_of_60_digits(baseline, changes, vertices):
    """Entries change by 1e-9 to 1e-1 of their size; both verdicts occur for each of the three inequalities.

    The 500 changes are judged at vertices that are drawn for each.
    """
    draw, mixed = np.random.default_rng(11), []
    with mpmath.workdps(60):
        for number in range(changes):
            what = "MNFQ"[number % 4]
            rows, columns = {"M": (2, 5), "N": (5, 5), "F": (2, 5), "Q": (7, 7)}[what]
            entry = int(draw.integers(rows)), int(draw.integers(columns))
            factor = 1.0 + draw.choice((-1.0, 1.0)) * 10.0 ** draw.uniform(-9.0, -1.0)
            kept = draw.permutation(20)[:vertices].tolist()
            subject = changed(at_vertices(baseline, kept), what, entry, factor)
            _, first, second, _, third = (check.ok for check in islice(exact_checks(subject), 5))
            assert [first, second, third] == verdicts(subject), (what, entry, factor)
            mixed.append([first, second, third])
    for verdict in zip(*mixed, strict=True):
        assert changes < 500 or 0.02 < np.mean(verdict) < 0.98


def test_a_matrix_that_is_not_exactly_symmetric_is_refused(baseline):
    certificate = copy.deepcopy(baseline.certificate)
    N = certificate["feedback"]["N"]
    N[0][1] = float(np.nextafter(N[0][1], 1.0))
    first = next(iter(exact_checks(Subject(baseline.design, certificate))))
    assert not first.ok and first.required
    assert str(first) == ("feedback.N: symmetric and positive definite: refuted, case 1, expected proved in all cases")


def test_pivots_that_vanish_or_cancel_are_decided():
    edge = rational([[1.0, 1.0], [1.0, 1.0]])
    assert not positive_definite(edge)
    edge[1, 1] += Fraction(1, 10**40)
    assert positive_definite(edge)
    assert not positive_definite(rational([[0.0, 0.0], [0.0, 1.0]]))


@pytest.mark.parametrize(
    ("squares", "limit", "holds"),
    [
        ([4, Fraction(9, 4)], Fraction(7, 2), True),  # rational roots, equality
        ([4, Fraction(9, 4)], Fraction(7, 2) - Fraction(1, 10**50), False),
        ([2, 3], Fraction(314626436994198, 10**14), True),  # root 2 + root 3 = 3.14626436994197234...
        ([2, 3], Fraction(31462643699419723423291350657155704455124771291, 10**46), False),
        ([2, 3], Fraction(31462643699419723423291350657155704455124771292, 10**46), True),
        ([-1], Fraction(1), False),
        ([], Fraction(0), True),
    ],
)
def test_sums_of_roots_are_compared_exactly(squares, limit, holds):
    assert roots_at_most([Fraction(square) for square in squares], limit) == holds


def test_an_interruption_leaves_what_is_proved():
    code = (
        "import sys; from hsv.cli.entry import main; sys.argv[1:] = ['verify', 'tight', '--exact', '--verbose']; main()"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with process:
        proved = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest, error = process.communicate()
    assert proved == "ok    feedback.N: symmetric and positive definite: proved\n"
    assert error == "hsv: error: interrupted\n" and process.returncode == 130
    assert "FAIL" not in rest
