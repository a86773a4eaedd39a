"""Running a resilience campaign to its end; a case that was flown before, with the same code, is not flown anew."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from hsv.campaign.executors import Executor
from hsv.campaign.lock import locked
from hsv.campaign.run import Capacity
from hsv.campaign.store import write_whole
from hsv.errors import CampaignError, reason
from hsv.resilience.campaign import Case, ResilienceCampaign
from hsv.resilience.faults import TRIED
from hsv.resilience.flights import Boundary, FlownFault, fly_case, runner_of
from hsv.study.sources import DIGITS, code_digest, digest_of, drop_older, measuring_code

_TIMED = 3
"""Cases of each controller of which a flight is timed before the start."""

_BYTES = 8000
"""On the disk, of a case: its numbers and the scenarios of its worst flights."""

Outcome = tuple[tuple[FlownFault, ...], Boundary]
"""Flights of a case, and between which severities it is lost."""


class CaseStore:
    """Keeps what cases brought in a folder, a file each, under a digest of all that they depend on."""

    def __init__(self, out: Path) -> None:
        self.folder = out / "cases"
        # Of the code that is loaded: files may change while it flies.
        self._code = [code_digest().encode(), *measuring_code("hsv.resilience.flights", "hsv.resilience.campaign")]

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Make the folder and hold it: one process at a time may fly into it.

        Raises:
            CampaignError: It cannot be made, or is in use.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CampaignError(f"{self.folder}: cannot be made ({reason(error)})") from error
        with locked(self.folder / ".lock", f"{self.folder}: in use, another process is flying this campaign"):
            yield

    def keep(self, case: Case, content: bytes) -> None:
        """Keep a case that was flown, and drop what it was with other code.

        Raises:
            CampaignError: It cannot be written.
        """
        path = self._path(case)
        write_whole(path, content)
        drop_older(path)

    def read(self, case: Case) -> Outcome | None:
        """Return what a case brought, None where it was not flown or its file is damaged."""
        try:
            values = json.loads(self._path(case).read_text(encoding="utf-8"))
            return tuple(FlownFault(**row) for row in values["flights"]), Boundary(**values["boundary"])
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def _path(self, case: Case) -> Path:
        digest = digest_of([case.text.encode(), *self._code])
        return self.folder / f"{case.label}_{digest[:DIGITS]}.json"


def run_resilience(
    campaign: ResilienceCampaign,
    store: CaseStore,
    executor: Executor,
    *,
    expect: Callable[[Capacity], None] = lambda capacity: None,
    progress: Callable[[int], None] = lambda flights: None,
) -> int:
    """Fly the missing cases of ``campaign``; return how many were flown.

    Args:
        campaign: The campaign.
        store: Where cases are kept.
        executor: The back end that flies them.
        expect: Called once, before the first flight, with the capacity that the run needs.
        progress: Called with the number of finished flights, those found at the start included.

    Raises:
        CampaignError, RunError: See :class:`CaseStore` and :mod:`hsv.campaign.executors`.
    """
    cases = campaign.cases
    with store.opened():
        missing = [number for number, case in enumerate(cases) if store.read(case) is None]
        done = sum(case.flights for case in cases) - sum(cases[number].flights for number in missing)
        if missing:
            expect(capacity(campaign, [cases[number] for number in missing], executor.cores))
        progress(done)
        for number, content in executor.fly(fly_case, campaign.text, missing):
            store.keep(cases[number], content)
            done += cases[number].flights
            progress(done)
    return len(missing)


def capacity(campaign: ResilienceCampaign, cases: Sequence[Case], cores: int) -> Capacity:
    """Return what flying ``cases`` takes on so many cores as fast as this one, by some flights of each controller."""
    seconds = 0.0
    for subject in campaign.subjects:
        own = [case for case in cases if case.subject.name == subject.name]
        timed = own[:: -(-len(own) // _TIMED) or 1]
        spent = 0.0
        for case in timed:
            runner, fault = runner_of(campaign.text, case), TRIED[case.fault]
            if len(subject.vehicles) > 1:
                runner.survives(fault, 0.0)  # compiled code is loaded
            started = time.perf_counter()
            runner.survives(fault, fault.severity(fault.values[1]))
            spent += time.perf_counter() - started
        seconds += sum(case.flights for case in own) * spent / max(len(timed), 1)
    flights = sum(case.flights for case in cases)
    return Capacity(flights, cores, seconds / max(min(cores, len(cases)), 1), _BYTES * len(cases))
