from pathlib import Path

import numpy as np
import pytest

from hsv.control.design_file import find_design, read_design
from hsv.study.linear_loop import critical_coupling, stability_limit
from hsv.study.sensitivity.controllers import WITHOUT_NOTCH, growth
from hsv.vehicle.vehicle import load_vehicle


def test_the_limit_of_stability_is_the_first_zero_on_the_way():
    points = np.linspace(0.0, 3.0, 13)
    assert stability_limit(lambda x: x - 1.1, points) == pytest.approx(1.1, abs=1e-6)
    assert stability_limit(lambda x: (x - 1.1) * (2.4 - x), points) == pytest.approx(1.1, abs=1e-6)
    assert stability_limit(lambda x: (1.1 - x) * (2.4 - x), points[6::-1]) == pytest.approx(1.1, abs=1e-6)


def test_a_loop_lost_at_once_or_never_has_no_crossing():
    assert stability_limit(lambda x: x + 1.0, [0.5, 1.0]) == 0.5
    assert stability_limit(lambda x: -1.0, [0.5, 1.0]) is None


def test_the_loop_changes_its_stability_at_the_limit():
    def over_coupling(kappa: float) -> float:
        return growth(WITHOUT_NOTCH, load_vehicle().coupled(kappa))

    limit = stability_limit(over_coupling, np.arange(0.0, 1.0, 0.1))
    assert 0.2 < limit < 0.3
    assert over_coupling(limit - 1e-3) < 0.0 < over_coupling(limit + 1e-3)


def test_the_paper_like_coupling_is_just_short_of_the_critical_one():
    baseline = read_design(find_design("baseline"))
    without, with_notch = (critical_coupling(baseline.feedback_gain, n, baseline.period) for n in ((), baseline.notch))
    assert without == pytest.approx(0.2524, abs=5e-5)
    said = (Path(__file__).parents[2] / "docs" / "assumptions.md").read_text(encoding="utf-8")
    assert f"{without:.4f} times the derived set, {100.0 * (without / 0.25 - 1.0):.1f} % above" in said
    assert f"stable up to {with_notch:.2f} times the derived set" in said
