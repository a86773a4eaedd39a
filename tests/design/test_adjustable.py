"""The adjustable design: certificates for every factor, and designs that cannot be adjusted."""

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.certificate.coverage import region_parameters
from hsv.design.adjustable import design_adjustable
from hsv.design.certified import load_certified
from hsv.design.error_system import error_system
from hsv.design.inputs import parse_inputs, read_inputs, with_tau
from hsv.design.region import incomplete_share
from hsv.flight.corners import corners
from hsv.flight.disturbance import ChannelModel
from hsv.model.vehicle import load_vehicle

OFFLINE_DESIGN = Path(__file__).parents[2] / "offline_design"


@pytest.fixture(scope="module")
def subject():
    return load_certified(OFFLINE_DESIGN / "adjustable.yaml")


@pytest.fixture(scope="module")
def stored(subject):
    return subject.certificate["adjustable"]


def test_incomplete_fault_and_bounds_are_scaled_by_the_factor(subject):
    assert incomplete_share(subject.inputs) == 0.8
    assert region_parameters(subject.certificate["inputs"], subject.vehicle, 0.8)["fault.parameters"] == [
        "effectiveness=0.92"
    ]
    bounds = load_vehicle().uncertainty
    assert_allclose([abs(change) for change in corners(bounds, 0.8)[1].values()], [0.8 * b for b in bounds.values()])
    assert incomplete_share(with_tau(subject.inputs, [0.8, 0.7, 1.0, 1.0, 0.9])) == 1.0


def test_set_is_invariant_under_every_factor_that_is_certified(subject):
    found = subject.invariant_set()
    design, model = subject.design, ChannelModel(subject.design, subject.vehicle)
    # The inequality is linear in vertices and multipliers, so interpolated multipliers prove it between two factors.
    least, one = np.split(found.multipliers, 2)
    for tau, multipliers in ((0.8, least), (0.87, 0.65 * least + 0.35 * one), (1.0, one)):
        gain = tau * design.feedback_gain[:, :5]
        system = error_system(design.polytope.A, design.polytope.B, gain, model.notch, model.columns)
        problem = dataclasses.replace(found.problem, system=system)
        assert dataclasses.replace(found, problem=problem, multipliers=multipliers).residuals().min() > 0.0
        # Start on the boundary; every disturbance has its worst sign for the direction of the free motion.
        factor = np.linalg.cholesky(found.Q)
        start = np.random.default_rng(3).normal(size=(500, len(factor)))
        start = start / np.linalg.norm(start, axis=1, keepdims=True)
        free = np.einsum("rij,kj->rki", np.linalg.solve(factor, system.A @ factor), start)
        columns = np.linalg.solve(factor, problem.columns(found.centre))
        signs = np.sign(np.einsum("rki,rid->rkd", free, columns))
        signs[..., -1] = 1.0  # the drift of the centre has a fixed sign
        reached = np.linalg.norm(free + np.einsum("rid,rkd->rki", columns, signs), axis=2)
        assert 0.9 < reached.max() <= 1.0
    assert len(found.problem.system.A) == 12
    assert_allclose(found.problem.system.F[:, :4], 0.8 * subject.design.feedback_gain[:, :4])


def test_full_state_feedback_rebuilds_the_pitch_rate_and_cancels_the_notch(stored):
    full = stored["full_state"]
    assert_allclose(full["elevator_on_pitch_rate"], full["structured_elevator_on_pitch_rate"], rtol=0.02)
    parts = full["largest_real_part"]
    assert max(full["spectral_radii"]) < 1.0  # stable on the model for which it was found
    assert parts["full_state"]["derived"] > 0.5 and parts["structured"]["derived"] < -0.1
    assert parts["full_state"]["paper_like"] > parts["structured"]["paper_like"] + 0.2


@pytest.mark.parametrize(
    ("table", "choice", "message"),
    [
        ("model", {"system": "DM"}, r"model\.system = 'DM': expected 'ECM' in an adjustable design"),
        ("invariant_set", {"method": "star_norms"}, r"invariant_set\.method = 'star_norms': expected 'ellipsoid'"),
        ("tightening", {"chain": "literal"}, r"tightening\.chain = 'literal': expected 'design_bounds'"),
    ],
)
def test_what_an_adjustable_design_cannot_be_is_refused_at_once(table, choice, message):
    inputs = read_inputs(OFFLINE_DESIGN / "adjustable.toml")
    changed = inputs.model_copy(update={table: getattr(inputs, table).model_copy(update=choice)})
    with pytest.raises(DesignError, match=message):
        design_adjustable(changed)


@pytest.mark.parametrize(
    ("name", "table", "message"),
    [
        ("adjustable", {"elevator_deflection": "elevator_50"}, r"^actuator: given, expected none in an adjustable"),
        ("baseline", {"elevator_deflection": "fuel_10"}, r"actuator\.elevator_deflection = 'fuel_10': expected one of"),
        ("baseline", {"rudder": "elevator_50"}, r"actuator\.rudder: unknown field"),
    ],
)
def test_wrong_actuators_are_named(name, table, message):
    inputs = tomllib.loads((OFFLINE_DESIGN / f"{name}.toml").read_text(encoding="utf-8"))
    with pytest.raises(DesignError, match=message):
        parse_inputs(inputs | {"actuator": table})
