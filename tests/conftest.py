"""For all tests."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from browser import Browser

# Started in the background, a shell's child ignores SIGINT, and so would every process that a test interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Neither an example nor the search for one has a time limit: other work on the machine must not fail a test.
settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")

# Its assertions say what they found, as those of test modules do.
pytest.register_assert_rewrite("page_checks")

PICTURES = Path(__file__).parents[1] / "docs" / "images"
"""The pictures of the documentation."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options to make the documentation's pictures anew, and to say how much is fuzzed."""
    parser.addoption("--pictures", action="store_true", help="write what the browser shows to docs/images")
    parser.addoption("--fuzz-inputs", type=int, default=10_000, help="mutated files a reader, with -m fuzz")


@pytest.fixture
def pictures(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return the folder for pictures of the documentation: its own if they are asked for."""
    return PICTURES if request.config.getoption("--pictures") else tmp_path


MOST_WORKERS = 8
"""Each may have a graph of six processes, of a tenth of a gigabyte each."""


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return how many processes test (``-n auto``): one for every core, and half as many again for graphs.

    The nodes of a graph start one after the other and wait for one another.
    """
    cores = min(len(os.sched_getaffinity(0)), MOST_WORKERS)
    return cores + cores // 2 if config.getoption("markexpr").startswith("graph") else cores


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a browser that shows pages."""
    from browser import Browser

    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.driver.quit()


@pytest.fixture
def screen(browser: Browser) -> Iterator[Callable[..., None]]:
    """Emulate a screen for one test."""
    yield browser.screen
    browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
