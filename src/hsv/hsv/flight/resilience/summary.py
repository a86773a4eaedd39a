"""Results of a resilience campaign: a file per case, cells of severity, time and fault, and their worst flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hsv.base.errors import CampaignError
from hsv.base.files import parse_json, read_text
from hsv.flight.campaign.run import Store
from hsv.flight.fingerprint import DIGITS, code_digest, digest_of, drop_older
from hsv.flight.resilience.campaign import Case, ResilienceCampaign, Subject
from hsv.flight.resilience.faults import SEVERITIES, TRIED, Moment, TriedFault
from hsv.flight.resilience.flights import Boundary, FlownFault, fly_case

Outcome = tuple[tuple[FlownFault, ...], Boundary]
"""Flights of a case, and the severities between which the controller is lost."""


class CaseStore(Store):
    """The store of the results of a campaign's cases; several campaigns can share a folder."""

    def __init__(self, out: Path, campaign: ResilienceCampaign) -> None:
        self.folder = out / "cases"
        super().__init__(self.folder, self.folder / ".lock", fly_case)
        self._cases = campaign.cases
        # The digest is of the code that is loaded: files may change during the flights.
        self._code = code_digest().encode()

    def finished(self, restart: bool) -> set[int]:
        """Return the numbers of the finished cases."""
        return {number for number in range(len(self._cases)) if not restart and self.read(number) is not None}

    def path(self, batch: int) -> Path:
        """Return the file of a case."""
        case = self._cases[batch]
        digest = digest_of([case.text.encode(), self._code])
        return self.folder / f"{case.label}_{digest[:DIGITS]}.json"

    def keep(self, batch: int, content: bytes) -> None:
        """Store the results of a case, and remove those of other code."""
        super().keep(batch, content)
        drop_older(self.path(batch))

    def read(self, number: int) -> Outcome | None:
        """Return the results of a case, None if it was not flown or its file is damaged."""
        try:
            values = parse_json(read_text(self.path(number)))
            return tuple(FlownFault(**row) for row in values["flights"]), Boundary(**values["boundary"])
        except (ValueError, KeyError, TypeError):
            return None


@dataclass(frozen=True)
class Cell:
    """The flights of one controller with one fault, severity and time of occurrence, over the vehicles."""

    case: Case
    severity: str
    flights: tuple[FlownFault, ...]

    @property
    def survived(self) -> int:
        """Flights that came to their end."""
        return sum(flight.survived for flight in self.flights)

    @property
    def share(self) -> float:
        """Share of flights that came to their end."""
        return self.survived / len(self.flights)

    @property
    def worst(self) -> FlownFault:
        """The flight that was lost first, or went farthest from that without the fault."""
        return min(self.flights, key=_rank)

    @property
    def attitude(self) -> float | None:
        """Largest distance of attitude, rad."""
        return max((f.attitude for f in self.flights if f.attitude is not None), default=None)

    @property
    def altitude(self) -> float | None:
        """Largest distance of altitude, m."""
        return max((f.altitude for f in self.flights if f.altitude is not None), default=None)

    @property
    def recovery_time(self) -> float | None:
        """Longest time to recovery, s; None if a flight does not recover."""
        times = [flight.recovery_time if flight.survived else None for flight in self.flights]
        known = [time for time in times if time is not None]
        return max(known) if len(known) == len(times) else None

    @property
    def time_to_loss(self) -> float | None:
        """Shortest time to the loss of a flight, s; None if no flight was lost."""
        return min((f.time_to_loss for f in self.flights if f.time_to_loss is not None), default=None)


def _rank(flight: FlownFault) -> tuple[float, float]:
    """Return the rank of a flight, the worst first: crashed, else lost first, else farthest off in attitude."""
    return (1.0, -(flight.attitude or 0.0)) if flight.survived else (0.0, flight.time_to_loss or 0.0)


@dataclass(frozen=True)
class Square:
    """A fault and a controller on the map: cells by time and severity, and the boundary at each time."""

    fault: str
    subject: Subject
    cells: dict[Moment, tuple[Cell, ...]]
    boundaries: dict[Moment, Boundary]

    @property
    def worst(self) -> tuple[Cell, FlownFault]:
        """The worst flight of all, and its cell."""
        cell = min((cell for row in self.cells.values() for cell in row), key=lambda cell: _rank(cell.worst))
        return cell, cell.worst

    @property
    def survived(self) -> tuple[int, int]:
        """Flights that came to their end, and all."""
        cells = [cell for row in self.cells.values() for cell in row]
        return sum(cell.survived for cell in cells), sum(len(cell.flights) for cell in cells)


@dataclass(frozen=True)
class ResilienceResults:
    """A campaign with all of its squares."""

    campaign: ResilienceCampaign
    squares: dict[tuple[str, str], Square]
    """Squares by fault and controller."""

    @classmethod
    def read(cls, campaign: ResilienceCampaign, store: CaseStore) -> ResilienceResults:
        """Return the results in ``store``, which must have every case."""
        squares = {
            (fault, subject.name): Square(fault, subject, {}, {})
            for fault in campaign.faults
            for subject in campaign.subjects
        }
        for number, case in enumerate(campaign.cases):
            if (outcome := store.read(number)) is None:
                raise CampaignError(f"{store.folder}: {case.label} is missing; the same command flies it")
            square, (flights, boundary) = squares[case.fault, case.subject.name], outcome
            square.boundaries[case.moment] = boundary
            square.cells[case.moment] = tuple(
                Cell(case, severity, tuple(f for f in flights if f.severity == severity)) for severity in SEVERITIES
            )
        return cls(campaign, squares)

    @property
    def cells(self) -> list[Cell]:
        """All cells, in a fixed order."""
        return [cell for square in self.squares.values() for row in square.cells.values() for cell in row]

    @property
    def flights(self) -> Sequence[FlownFault]:
        """All flights but those of the bisections."""
        return [flight for cell in self.cells for flight in cell.flights]


def boundaries_in_words(fault: TriedFault, boundaries: Mapping[Moment, Boundary]) -> list[str]:
    """Return the survived range of the nominal vehicle at each time as texts; equal texts are given once."""

    def in_words(boundary: Boundary) -> str:
        if boundary.survived is None:
            return f"lost at {fault.in_words(fault.harmless)}"
        if boundary.lost is None:
            return f"all, to {fault.in_words(fault.worst)}"
        return f"to {fault.in_words(fault.value(boundary.survived))}"

    return list(dict.fromkeys(in_words(boundaries[moment]) for moment in Moment))


def parameter_words(name: str) -> str:
    """Return the description of a fault's severity: mild, medium and severe values, range, and fixed parameters."""
    fault = TRIED[name]
    fixed = "".join(f", {key.replace('_', ' ')} {value}" for key, value in fault.fixed.items())
    tried = f"{fault.in_words(*fault.values)} ({fault.harmless:g} to {fault.in_words(fault.worst)}){fixed}"
    return f"{fault.parameter.replace('_', ' ')} {tried}"
