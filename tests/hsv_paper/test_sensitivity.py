from functools import partial

import numpy as np
import pytest

from hsv.design.inputs import find_inputs, read_inputs
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import design
from hsv_paper.linear_loop import COUPLING_SCALES, critical_coupling, largest_growth, stability_limit
from hsv_paper.sensitivity import STUDIES
from hsv_paper.sensitivity.factor import FINE, growth, is_certified
from hsv_paper.sensitivity.flown import coupling_limits
from hsv_paper.sensitivity.notch import SETS, stable_range
from hsv_paper.sensitivity.sweep import ALL, RMPC, RMPC_WITH_NOTCH, WITH_NOTCH, WITHOUT_NOTCH
from hsv_paper.study import Scope, markdown


@pytest.mark.parametrize(("controller", "near"), [(WITHOUT_NOTCH, 0.25), (RMPC, 0.68), (WITH_NOTCH, 1.10)])
def test_coupling_limits_bracket_the_change_of_sign(controller, near):
    over = Scope(8.0).over
    loop = controller.loop
    nominal, worst = critical_coupling(loop), critical_coupling(loop, over)
    assert nominal == pytest.approx(near, abs=0.01)
    assert worst < nominal
    for limit, vehicles in ((nominal, over[:1]), (worst, over)):
        below, above = (largest_growth(loop, load_vehicle().coupled(limit + step), vehicles) for step in (-1e-3, 1e-3))
        assert below < 0.0 < above
    assert list(coupling_limits(loop, over).values()) == [f"{nominal:.2f}", f"{worst:.2f}"]


def test_robust_mpc_is_lost_without_a_notch_and_would_not_be_with_one():
    derived = load_vehicle().coupled("derived")
    assert largest_growth(RMPC.loop, derived) > 0.1
    assert largest_growth(RMPC_WITH_NOTCH.loop, derived) < 0.0
    limits = coupling_limits(RMPC_WITH_NOTCH.loop, Scope(16.0).over)
    assert set(limits.values()) == {f"≥ {COUPLING_SCALES[-1]}"}


def test_limits_of_the_notch_of_the_nominal_vehicle():
    """The values printed in docs/study/notch.md."""
    centres, depths = np.array([8.0, 15.0, 26.0]), np.geomspace(0.005, 0.5, 17)
    paper_like, derived = (list(stable_range(coupled, [{}], centres, depths).values()) for coupled in SETS)
    assert paper_like == ["≤ 8", "≥ 26", "≥ 0.5"]
    assert derived == ["11.91", "15.82", "0.062"]


@pytest.mark.long
def test_a_coarse_study_has_a_page_with_its_findings():
    study = STUDIES["coupling"]
    outcome = study.run(Scope(25.0))
    assert outcome.figure.axes
    text = study.page(outcome)
    assert "coupling.png" in text
    assert "nominal vehicle and 1 of the 1024 corners" in text
    [rows] = outcome.tables
    assert [row["controller"] for row in rows] == [controller.label for controller in ALL]
    assert rows[2]["stable up to κ, nominal"] == "0.25"
    assert markdown(rows) in text


@pytest.mark.parametrize("coupling", ["paper_like", "derived"])
def test_the_loop_is_lost_between_factors_of_a_half_and_four_tenths(coupling):
    # Control study, section 7.
    at = partial(growth, design("adjustable"), coupling, [{}])
    assert all(at(tau) < 0.0 for tau in (1.0, 0.75, 0.5)) and all(at(tau) > 0.0 for tau in (0.4, 0.3))
    limit = stability_limit(at, FINE[::-1].tolist())
    assert 0.4 < limit < 0.5
    assert at(limit + 1e-3) < 0.0 < at(limit - 1e-3)


@pytest.mark.long
def test_the_certified_range_of_the_factor_ends_before_the_loop_is_lost():
    inputs = read_inputs(find_inputs("adjustable"))
    assert [is_certified(design("adjustable"), inputs, tau) for tau in (0.8, 0.5, 0.4)] == [True, True, False]
