"""The fuzz: it passes inputs to a reader and measures what each of them costs."""

from __future__ import annotations

import re
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from gymnasium.error import Error
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from hsv.base.errors import HsvError

MAX_MEMORY, MAX_TIME = 512.0, 10.0
"""Memory (MiB) that this process or a child takes, and processor time (s) of both, for one input"""

Fuzz = Callable[..., None]


@pytest.fixture(params=[pytest.param(True, id="short"), pytest.param(False, id="long", marks=[pytest.mark.fuzz])])
def fuzz(request: pytest.FixtureRequest) -> Fuzz:
    """Return a function that passes up to ``limit`` inputs to a reader; in the short form few, always the same ones."""
    quick = request.param

    def run(inputs: st.SearchStrategy[Any], read: Callable[[Any], object], limit: int = 10_000) -> None:
        @settings(
            max_examples=max(limit // 2000, 1) if quick else min(limit, request.config.getoption("--fuzz-inputs")),
            derandomize=quick,
            database=None,
            phases=[Phase.generate, Phase.shrink],
            suppress_health_check=list(HealthCheck),
        )
        @hypothesis.given(inputs)
        def each(given: Any) -> None:
            with measured():
                try:
                    read(given)
                except (HsvError, Error) as error:
                    assert str(error) and "\n" not in str(error)

        each()

    return run


@contextmanager
def measured() -> Iterator[None]:
    """Fail if the work in this context takes more memory or processor time than one input may."""
    Path("/proc/self/clear_refs").write_text("5")  # the peak is that of this input
    before, resident, child = _time(), _memory("VmRSS"), _largest_child()
    yield
    # The largest child of earlier inputs, or of other tests in this process, is not one of this input.
    used = max(_memory("VmHWM") - resident, _largest_child() if _largest_child() > child else 0) / 1024
    assert used <= MAX_MEMORY, f"{used:.0f} MiB"
    assert _time() - before <= MAX_TIME, f"{_time() - before:.1f} s"


def _memory(name: str) -> int:
    found = re.search(rf"{name}:\s*(\d+)", Path("/proc/self/status").read_text())
    assert found is not None
    return int(found[1])


def _largest_child() -> int:
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss


def _time() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)
