"""Campaigns of short flights."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from node_processes import short_scenario

from hsv.flight.campaign.campaign import Campaign, plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results


@pytest.fixture(scope="session")
def short(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the path of a scenario of 3 s with a fault at 2 s."""
    return str(short_scenario(tmp_path_factory.mktemp("scenario"), duration=3, fault=2))


@pytest.fixture(scope="session")
def planned(short: str) -> Callable[..., Campaign]:
    """Plan a campaign of short flights."""

    def make(**settings: Any) -> Campaign:
        return plan(
            short,
            **{"samples": 44, "seed": 3, "factors": {"fault[0].start": ("1 s", "2.5 s")}, "commit": "test"} | settings,
        )

    return make


@pytest.fixture(scope="session")
def results(planned: Callable[..., Campaign], tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Return the results of a campaign that nothing disturbed."""
    out = tmp_path_factory.mktemp("campaign") / "short.parquet"
    run_campaign(planned(), ResultStore(out, planned()), Executor())
    return Results(out)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Return where results may go."""
    return tmp_path / "result.parquet"
