"""The picture at the top of the pages."""

import re

import numpy as np
import pytest

from hsv.pages.engine import Numbers, Plot
from hsv.pages.picture import HEIGHT, WIDTH, picture

TIME = np.linspace(0.0, 200.0, 10_001)


def pictured(y, shades=()):
    numbers = Numbers()
    curve = {"kind": "actual", "run": 0, "x": numbers.add(TIME), "y": numbers.add(y)}
    return picture([Plot("y", "y", "m", "", [curve])], numbers, 200.0, shades)


def points(path):
    return np.array(re.findall(r"[ML]([^ ]+) ([^MLZ]+)", path[1]), float)


def test_no_peak_of_a_single_step_is_lost():
    y = np.sin(TIME)
    y[4321] = 5.0
    ((_, [path], _),) = pictured(y).drawings
    drawn = points(path)
    highest = drawn[np.argmin(drawn[:, 1])]
    assert highest[0] == pytest.approx(WIDTH * TIME[4321] / 200.0, rel=1e-3)
    assert len(drawn) < 1000 and np.all(np.diff(drawn[:, 0]) >= 0.0)
    assert drawn[:, 1].min() >= 0.0 and drawn[:, 1].max() <= HEIGHT


def test_faults_are_shaded_where_they_act():
    shown = pictured(TIME, [(100.0, 150.0)])
    assert shown.shades == [(50.0, 25.0)]
    assert [text for text, _ in shown.ticks][:2] == ["0", "25"]
