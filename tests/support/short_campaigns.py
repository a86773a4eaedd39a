"""Fixtures with campaigns of short flights."""

import pytest
from node_processes import short_scenario

from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results


@pytest.fixture(scope="session")
def short(tmp_path_factory):
    """Return the path of a scenario of 3 s with a fault at 2 s."""
    return str(short_scenario(tmp_path_factory.mktemp("scenario"), duration=3, fault=2))


@pytest.fixture(scope="session")
def planned(short):
    """Return a function that plans a campaign of short flights."""

    def make(**settings):
        return plan(
            short,
            **{"samples": 44, "seed": 3, "factors": {"fault[0].start": ("1 s", "2.5 s")}} | settings,
        )

    return make


@pytest.fixture(scope="session")
def results(planned, tmp_path_factory):
    """Return the results of an undisturbed campaign."""
    out = tmp_path_factory.mktemp("campaign") / "short.parquet"
    run_campaign(planned(), ResultStore(out, planned()), Executor())
    return Results(out)


@pytest.fixture
def out(tmp_path):
    """Return the path for new results."""
    return tmp_path / "result.parquet"
