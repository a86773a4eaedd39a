"""Options, settings and fixtures of all tests."""

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

# A shell that starts pytest in the background, and nohup, have signals ignored by all child processes. Undo that.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# No time limit on examples or on the search for them: other load on the machine must not fail a test.
settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")

# Assertions in this helper explain their failures like those of test modules.
pytest.register_assert_rewrite("page_checks")

PICTURES = Path(__file__).parents[1] / "docs" / "images"
"""Folder of the documentation's pictures."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that renew the documentation's pictures and set the number of fuzzed files."""
    parser.addoption("--pictures", action="store_true", help="write what the browser shows to docs/images")
    parser.addoption("--fuzz-inputs", type=int, default=10_000, help="mutated files a reader, with -m fuzz")


@pytest.fixture
def pictures(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return the folder for pictures: that of the documentation with ``--pictures``, otherwise a temporary one."""
    return PICTURES if request.config.getoption("--pictures") else tmp_path


MOST_WORKERS = 8
"""Limit on test processes: each may run a graph of six processes of 0.1 GB each."""


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return the number of test processes (``-n auto``): one per core, and 1.5 per core for graph tests.

    The nodes of a graph spend much of their time waiting for one another.
    """
    cores = min(len(os.sched_getaffinity(0)), MOST_WORKERS)
    return cores + cores // 2 if config.getoption("markexpr").startswith("graph") else cores


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a browser for HTML pages, one for the whole session."""
    from browser import Browser

    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.driver.quit()


@pytest.fixture
def screen(browser: Browser) -> Iterator[Callable[..., None]]:
    """Return the function that emulates a screen; the emulation ends with the test."""
    yield browser.screen
    browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
