"""The picture that pages open with."""

import re

import numpy as np
import pytest

from hsv.pages.picture import HEIGHT, WIDTH, Line, drawing, picture

TIME = np.linspace(0.0, 200.0, 10_001)


def points(path):
    return np.array(re.findall(r"[ML]([^ ]+) ([^MLZ]+)", path[1]), float)


def test_no_peak_of_a_single_step_is_lost():
    y = np.sin(TIME)
    y[4321] = 5.0
    (path,) = drawing("y", "m", 200.0, [Line("run0", TIME, y)]).paths
    drawn = points(path)
    highest = drawn[np.argmin(drawn[:, 1])]
    assert highest[0] == pytest.approx(WIDTH * TIME[4321] / 200.0, rel=1e-3)
    assert len(drawn) < 1000 and np.all(np.diff(drawn[:, 0]) >= 0.0)
    assert drawn[:, 1].min() >= 0.0 and drawn[:, 1].max() <= HEIGHT


def test_what_is_no_number_interrupts_a_curve():
    y = np.ones(100)
    y[40:50] = np.nan
    (path,) = drawing("y", "m", 200.0, [Line("run0", TIME[:100], y)]).paths
    assert path[1].count("M") == 2 and len(points(path)) == 90


def test_ticks_are_round_numbers_of_every_system_at_their_places():
    drawn = drawing("angle", "rad", 200.0, [Line("run0", TIME, np.radians(np.linspace(-1.0, 3.0, len(TIME))))])
    low, high = -1.0 - 0.24, 3.0 + 0.24
    assert [len(drawn.ticks[system]) >= 2 for system in ("metric", "si")] == [True, True]
    for text, at in drawn.ticks["metric"]:
        degrees = float(text.replace("−", "-"))
        assert at == pytest.approx(100.0 * (degrees - low) / (high - low)) and (2 * degrees).is_integer()
    assert drawn.ticks["metric"] == drawn.ticks["paper"] != drawn.ticks["si"]


def test_bands_are_closed_and_lie_within():
    band = Line("band", TIME[:300], -np.ones(300), high=np.linspace(1.0, 2.0, 300))
    path, _ = drawing("y", "1", 6.0, [band, Line("mean", TIME[:300], np.zeros(300))]).paths
    assert path[0] == "band" and path[1].endswith("Z") and len(points(path)) == 600


def test_faults_are_shaded_where_they_act():
    shown = picture([drawing("y", "1", 200.0, [Line("run0", TIME, TIME)])], 200.0, [(100.0, 150.0)])
    assert shown.shades == [(50.0, 25.0)]
    assert [text for text, _ in shown.ticks][:2] == ["0", "25"]
