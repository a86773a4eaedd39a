"""What the launcher refuses before it starts anything."""

from __future__ import annotations

import os

import pytest

from hsv.errors import ParameterError, RunError
from hsv.graph.launcher import _domain_of_its_own


@pytest.mark.parametrize("spelling", ["{}", " 0{}"])
def test_a_domain_belongs_to_one_run_however_it_is_written(monkeypatch: pytest.MonkeyPatch, spelling: str) -> None:
    # A number that no graph can have and no other test run takes: only its name is held.
    number = 10**9 + os.getpid()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    with _domain_of_its_own():
        monkeypatch.setenv("ROS_DOMAIN_ID", spelling.format(number))
        with pytest.raises(RunError, match=f"another run has ROS_DOMAIN_ID={number}"):
            _domain_of_its_own()


def test_a_domain_is_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
    with pytest.raises(ParameterError, match="ROS_DOMAIN_ID='seven': expected a whole number"):
        _domain_of_its_own()
