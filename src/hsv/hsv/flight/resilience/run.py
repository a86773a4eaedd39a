"""Run of a resilience campaign; cases that were flown before with the same code are not repeated."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hsv.base.errors import CampaignError, reason
from hsv.base.files import parse_json, read_text
from hsv.flight.campaign.capacity import Capacity, evenly, timed
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.lock import locked
from hsv.flight.campaign.store import write_whole
from hsv.flight.resilience.campaign import Case, ResilienceCampaign
from hsv.flight.resilience.faults import SEVERITIES, Moment
from hsv.flight.resilience.flights import Boundary, FlownFault, fly_case, time_flight
from hsv.flight.sources import DIGITS, code_digest, digest_of, drop_older

_TIMED = 6
"""Flights that are timed before the start, of each controller and for each of its vehicles."""

_BYTES = 8000
"""Disk space of a case: its numbers and the scenarios of its worst flights."""

Outcome = tuple[tuple[FlownFault, ...], Boundary]
"""Flights of a case, and between which severities it is lost."""


@dataclass(frozen=True)
class Flown:
    """Cases flown in a run: their number, the time they took (s), and the expected time."""

    cases: int
    wall_time: float
    expected: float


class CaseStore:
    """Keeps what cases brought in a folder, a file each, under a digest of all that they depend on."""

    def __init__(self, out: Path) -> None:
        self.folder = out / "cases"
        # Of the code that is loaded: files may change while it flies.
        self._code = [code_digest().encode()]

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Create and lock the folder: only one process at a time may fly into it.

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
        """Store the results of a case, and remove those of other code.

        Raises:
            CampaignError: It cannot be written.
        """
        path = self._path(case)
        write_whole(path, content)
        drop_older(path)

    def read(self, case: Case) -> Outcome | None:
        """Return the results of a case, None if it was not flown or its file is damaged."""
        try:
            values = parse_json(read_text(self._path(case)))
            return tuple(FlownFault(**row) for row in values["flights"]), Boundary(**values["boundary"])
        except (ValueError, KeyError, TypeError):
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
) -> Flown:
    """Fly the missing cases of ``campaign``.

    Args:
        campaign: The campaign.
        store: Store of the cases.
        executor: The back end that flies them.
        expect: Called once, after flights that are timed, with the capacity that the run needs.
        progress: Called with the number of finished flights, those found at the start included.

    Raises:
        CampaignError, RunError: See :class:`CaseStore` and :mod:`hsv.flight.campaign.executors`.
    """
    cases = campaign.cases
    with store.opened():
        missing = [number for number, case in enumerate(cases) if store.read(case) is None]
        done = sum(case.flights for case in cases) - sum(cases[number].flights for number in missing)
        expected = 0.0
        if missing:
            needed = capacity(campaign, missing, executor)
            expect(needed)
            expected = needed.wall_time
        progress(done)
        started = time.perf_counter()
        for number, content in executor.fly(fly_case, campaign.text, missing):
            store.keep(cases[number], content)
            done += cases[number].flights
            progress(done)
    return Flown(len(missing), time.perf_counter() - started, expected)


def capacity(campaign: ResilienceCampaign, missing: Sequence[int], executor: Executor) -> Capacity:
    """Return what flying the ``missing`` cases takes."""
    cores = max(executor.cores, 1)
    cases = {number: campaign.cases[number] for number in missing}
    own: dict[str, list[int]] = {}
    for number, case in cases.items():
        own.setdefault(case.subject.name, []).append(number)
    chosen = {
        name: _sample(numbers, max(_TIMED * len(cases[numbers[0]].subject.vehicles), -(-cores // len(own))))
        for name, numbers in own.items()
    }
    spent = timed(executor, time_flight, campaign.text, [flight for flights in chosen.values() for flight in flights])
    seconds = 0.0
    for name, numbers in own.items():
        # Without a fault each core flies each vehicle but the nominal one, which it flew.
        others = len(cases[numbers[0]].subject.vehicles) - 1
        flown = sum(cases[number].flights for number in numbers) + len(Moment) * others * min(cores, len(numbers))
        seconds += flown * sum(spent[flight] for flight in chosen[name]) / len(chosen[name])
    flights = sum(case.flights for case in cases.values())
    return Capacity(flights, cores, seconds / min(cores, len(cases)), _BYTES * len(cases))


def _sample(cases: Sequence[int], count: int) -> list[int]:
    """Return at most ``count`` flights, numbered as :func:`time_flight` has them, of cases from all over ``cases``.

    The severities come in turn: a flight that is lost early is soon over.
    """
    kinds = len(SEVERITIES)
    several = [case for case in cases for _ in range(kinds)]
    return [kinds * case + index % kinds for index, case in enumerate(evenly(several, count))]
