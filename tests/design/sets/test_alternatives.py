import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import ErrorSystem, paper_system
from hsv.design.sets.box import box, infeasibility
from hsv.design.sets.compare import compare_sets
from hsv.design.sets.invariant_set import TubeProblem
from hsv.design.sets.modal import modal_box
from hsv.design.sets.zonotope import zonotope


@pytest.fixture(scope="module")
def contracting():
    """Two vertices whose absolute values contract: here every way has a solution."""
    A = np.array([[[0.5, 0.2], [-0.1, 0.6]], [[0.4, 0.25], [-0.1, 0.55]]])
    G = np.broadcast_to(np.eye(2), (2, 2, 2))
    system = ErrorSystem(
        A, np.zeros((len(A), 2, 2)), G, np.array([[1.0, 0.0], [0.0, 1.0]]), np.zeros((2, 2)), ("a", "b")
    )
    return TubeProblem(system, DisturbanceSet(np.array([-1.0, -0.5]), np.array([1.0, 0.5])))


def test_the_papers_box_is_infeasible_with_a_proof(found, subject):
    with pytest.raises(DesignError, match=r"box: infeasible .* spectral radius of max \|A_i \+ B_i F\| 1\.3"):
        box(found.problem)
    proof = infeasibility(found.problem)
    A = np.abs(found.problem.system.A)
    w = np.abs(found.problem.columns(found.problem.centre())).sum(axis=2)
    y = proof.multipliers
    combined = sum((np.eye(len(a)) - a).T @ row for a, row in zip(A, y, strict=True))
    assert y.min() >= 0.0
    assert combined.max() <= 1e-9 * y.max()
    assert float(np.sum(w * y)) > 0.0
    assert proof.radii.min() > 1.0


def test_the_papers_nine_states_are_infeasible_too(subject):
    design, delta = subject.design, subject.certificate["tube"]["disturbance"]["boxes"]["delta"]
    system = paper_system(design.polytope.A, design.polytope.B, design.feedback_gain)
    problem = TubeProblem(system, DisturbanceSet(np.array(delta["lower"]), np.array(delta["upper"])))
    with pytest.raises(DesignError, match="infeasible"):
        box(problem)


@pytest.mark.parametrize("method", [box, modal_box, zonotope])
def test_where_a_set_exists_no_sequence_leaves_it(contracting, method):
    found = method(contracting)
    found.certify()
    rng = np.random.default_rng(1)
    e = np.zeros((300, 2))
    for _ in range(60):
        vertex = rng.integers(0, 2, len(e))
        d = rng.choice((-1.0, 1.0), e.shape) * contracting.disturbance.half_width
        e = np.einsum("kij,kj->ki", contracting.system.A[vertex], e) + d
        assert np.all(np.abs(e) <= found.half_width)
    assert found.level(e).max() <= 1.0


def test_a_box_is_exact_for_a_scalar():
    system = ErrorSystem(
        np.array([[[0.5]]]), np.zeros((1, 1, 1)), np.ones((1, 1, 1)), np.ones((1, 1)), np.zeros((1, 1)), ("a",)
    )
    problem = TubeProblem(system, DisturbanceSet(np.array([-1.0]), np.array([1.0])))
    for method in (box, modal_box, zonotope):
        assert method(problem).half_width[0] == pytest.approx(2.0, rel=1e-5)


def test_table_has_a_row_for_every_way(found, subject):
    delta = subject.certificate["tube"]["disturbance"]["boxes"]["delta"]
    inputs = subject.inputs.invariant_set.model_copy(update={"contraction": [found.contraction]})
    rows = compare_sets(subject.design, found.problem, delta, 1.1, inputs)
    sizes = {row.name: row.size for row in rows}
    assert sizes["box"] is None
    assert sizes["ellipsoid"] < sizes["zonotope"] < sizes["modal box"]
