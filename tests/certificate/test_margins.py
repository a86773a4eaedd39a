"""Disk margins against python-control, published examples, classical margins and poles; the certificate's block."""

import copy
import json
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.linalg import expm

from hsv.certificate.checks import field_checks, leaves, load_subject
from hsv.certificate.loops import INPUTS, MEASUREMENTS, BrokenLoop, vertex_loops
from hsv.certificate.margin_checks import corner_checks, margin_checks, margins_report
from hsv.certificate.margins import (
    SLACK,
    classical_margins,
    crossings,
    design_loops,
    destabilising,
    disk_margin,
    grid,
    is_proved,
    mu,
)
from hsv.control.design_file import find_design, read_design

DESIGNS = sorted(path.stem for path in find_design("baseline").parent.glob("*.toml"))


def worst_vertex(name, broken="elevator"):
    loops = vertex_loops(read_design(find_design(name)))
    return min(loops, key=lambda loop: disk_margin(loop.broken(broken)).margin)


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("broken", ["fuel", "elevator"])
def test_disk_margins_of_single_loops_equal_those_of_python_control(name, broken):
    loop = worst_vertex(name, broken)
    (own,), (other,) = INPUTS[broken], INPUTS["elevator" if broken == "fuel" else "fuel"]
    found = disk_margin(loop.broken(broken))
    A = loop.A + np.outer(loop.B[:, other], loop.gain[other])
    L = control.ss(A, loop.B[:, [own]], -loop.gain[[own]], 0.0, loop.period)
    frequencies = np.sort(np.append(np.geomspace(0.01, 150.0, 60), found.frequency))
    theirs = control.disk_margins(L, frequencies, skew=0.0)[0]
    assert found.attained == pytest.approx(theirs, rel=1e-5)
    assert found.margin == pytest.approx(found.attained, rel=2.0 * SLACK)


def sampled(A, B, C, period=1e-4):
    """Return the loop of the strictly proper L = C (s I - A)^-1 B, sampled so fast that it is nearly continuous."""
    n, m = B.shape
    whole = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * period)
    A, B = whole[:n, :n], whole[:n, n:]
    return BrokenLoop("example", A - B @ C, B, -C, period)


def test_published_examples():
    """Published: 0.46 at 1.94 rad/s, a loop at a time 2 and both 0.0998 (Seiler, Packard and Gahinet 2020)."""
    example = control.ss(control.tf(25.0, [1.0, 10.0, 10.0, 10.0]))
    found = disk_margin(sampled(example.A, example.B, example.C))
    assert found.margin == pytest.approx(0.458, abs=5e-4) and found.frequency == pytest.approx(1.95, abs=0.01)
    a = 10.0
    A, C = np.array([[0.0, a], [-a, 0.0]]), np.array([[1.0, a], [-a, 1.0]])
    both = disk_margin(sampled(A, np.eye(2), C))
    assert both.margin == pytest.approx(0.0998, abs=1e-4) and both.attained == pytest.approx(0.0998, abs=1e-4)
    one = sampled(A - np.outer([0.0, 1.0], C[1]), np.eye(2)[:, :1], C[:1])
    assert disk_margin(one).margin == pytest.approx(2.0, rel=1e-3)


@pytest.mark.parametrize("name", DESIGNS)
def test_the_disk_margin_is_never_above_the_classical_ones_and_a_border_is_one(name):
    for loop in vertex_loops(read_design(find_design(name))):
        for broken in ("fuel", "elevator", "pitch_rate"):
            disk, classical = disk_margin(loop.broken(broken)), classical_margins(loop.broken(broken))
            assert disk.gain <= classical.gain_up and 1.0 / disk.gain >= classical.gain_down
            assert disk.phase <= classical.phase
    loop = worst_vertex(name)
    found = classical_margins(loop.broken("elevator"))
    for border, outward in ((found.gain_up, 1e-4), (found.gain_down, -1e-4)):
        if 0.0 < border < np.inf:
            growths = [loop.scaled(border * (1.0 + side), "elevator").growth for side in (-outward, outward)]
            assert growths[0] < 0.0 < growths[1]


@pytest.mark.parametrize("broken", ["fuel", "elevator", *MEASUREMENTS])
def test_the_pencil_decides_next_to_the_margin(broken):
    loop = worst_vertex("robust").broken(broken)
    found = disk_margin(loop)
    assert is_proved(loop, found.margin)
    between = crossings(loop, found.attained * (1.0 + 1e-5))
    assert between.min() < found.frequency < between.max() and not is_proved(loop, found.attained * (1.0 + 1e-5))
    # A grid that misses the peak finds it by the pencil.
    assert disk_margin(loop, np.array([0.5, 50.0])).margin == pytest.approx(found.margin, rel=1e-5)


def test_both_inputs_at_once_are_between_search_and_scaling():
    for name in ("baseline", "robust"):
        loop = worst_vertex(name, "both")
        found = disk_margin(loop.broken("both"))
        assert 0.99 * found.attained < found.margin <= found.attained <= disk_margin(loop.broken("elevator")).attained
        assert is_proved(loop.broken("both"), found.margin, found.scaling)
    generator = np.random.default_rng(5)
    for M in generator.standard_normal((20, 2, 2)) + 1j * generator.standard_normal((20, 2, 2)):
        assert destabilising(M) == pytest.approx(mu(M), rel=1e-6)


def test_an_unstable_loop_has_no_margin():
    loop = worst_vertex("baseline").scaled(4.0, "elevator")
    found = disk_margin(loop.broken("elevator"))
    assert loop.growth > 0.0 and (found.margin, found.frequency) == (0.0, 0.0)
    assert not is_proved(loop.broken("elevator"), 0.1)


@pytest.fixture(scope="module")
def stated():
    """Return the design `robust` whose certificate has the block that its design writes, read back from JSON."""
    subject = load_subject(find_design("robust"))
    block = margins_report(subject.design, subject.vehicle, subject.certificate["inputs"])
    return replace(subject, certificate=subject.certificate | {"margins": json.loads(json.dumps(block))})


def test_published_margins_of_robust(stated):
    block = stated.certificate["margins"]
    assert min(block["vertices"]["elevator"]["margin"]) == pytest.approx(0.900, abs=5e-4)
    assert min(block["vertices"]["both"]["margin"]) == pytest.approx(0.846, abs=5e-4)
    assert block["corners"]["designed"]["margin"] == pytest.approx(0.772, abs=5e-4)
    assert block["corners"]["slow"]["margin"] == pytest.approx(0.528, abs=5e-4)
    made = list(margin_checks(stated, seed=1))
    assert all(check.ok for check in made) and all(check.ok for check in corner_checks(stated))
    others = [field for field in leaves(stated.certificate) if not field.startswith("margins")]
    assert list(field_checks(stated, made, others)) == []


CHANGES = [
    (*path, change)
    for path in (
        *((f"vertices.{loop}", key) for loop in INPUTS for key in ("margin", "frequency")),
        ("vertices.both", "attained"),
        *((f"{kind}.{case}", "margin") for kind in ("nominal", "corners") for case in ("designed", "slow")),
        *((f"{kind}.{case}", "frequency") for kind in ("nominal", "corners") for case in ("designed", "slow")),
    )
    for change in (1.01, 0.99)
]
CHANGES += [("nominal.slow", "place", "fault"), ("corners.slow", "place", "start"), ("corners.slow", "corner", "")]
CHANGES += [("corners.designed", "corner", "+" * 10), ("corners.slow", "unstable", 1), ("corners.slow", "count", 513)]


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_a_tampered_field_fails(stated, change):
    path, key, value = change
    certificate = copy.deepcopy(stated.certificate)
    table = certificate["margins"]
    for name in path.split("."):
        table = table[name]
    if isinstance(table[key], list):
        table[key][7] *= value
    else:
        table[key] = table[key] * value if isinstance(value, float) else value
    assert not all(check.ok for check in margin_checks(replace(stated, certificate=certificate), seed=1))


def test_an_interruption_leaves_the_corners_that_are_done():
    subject = load_subject(find_design("robust"))
    loops = design_loops(subject.design, subject.vehicle, subject.certificate["inputs"], "designed")

    def interrupt(done, total):
        if done == 5:
            raise KeyboardInterrupt

    found = loops.worst("elevator", loops.corners(), interrupt)
    assert found.count == 5 and found.margin > 0.0
    assert grid(0.02).max() < np.pi / 0.02
