"""Results of a resilience campaign: one file per case, one square of the map per pair of fault and controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

from hsv.base.errors import CampaignError
from hsv.base.files import parse_json, read_text
from hsv.flight.campaign.run import Store
from hsv.flight.fingerprint import DIGITS, code_digest, digest_of, drop_older
from hsv.flight.resilience.campaign import Case, ResilienceCampaign
from hsv.flight.resilience.faults import SEVERITIES, Moment, TriedFault
from hsv.flight.resilience.flights import Boundary, FlownFault, fly_case

Outcome = tuple[tuple[FlownFault, ...], Boundary]
"""Results of the flights of a case, and the severities between which the controller is lost."""


class CaseStore(Store):
    """Stores the results of a campaign, one file per case; several campaigns can share a folder."""

    def __init__(self, out: Path, campaign: ResilienceCampaign) -> None:
        self.folder = out / "cases"
        super().__init__(self.folder, self.folder / ".lock", fly_case)
        self._cases = campaign.cases
        # Computed now, because source files may change during the flights.
        self._code = code_digest().encode()

    def finished(self, restart: bool) -> set[int]:
        """Return the numbers of the finished cases, none with ``restart``."""
        return {number for number in range(len(self._cases)) if not restart and self.read(number) is not None}

    def path(self, batch: int) -> Path:
        """Return the path of the result file of a case, whose number is ``batch``."""
        case = self._cases[batch]
        digest = digest_of([case.text.encode(), self._code])
        return self.folder / f"{case.label}_{digest[:DIGITS]}.json"

    def keep(self, batch: int, content: bytes) -> None:
        """Store the results of a case, and remove those of another version of the code or the case."""
        super().keep(batch, content)
        drop_older(self.path(batch))

    def read(self, number: int) -> Outcome | None:
        """Return the results of the case with this number; None if it was not flown or its file is damaged."""
        try:
            values = parse_json(read_text(self.path(number)))
            return tuple(FlownFault(**row) for row in values["flights"]), Boundary(**values["boundary"])
        except (ValueError, KeyError, TypeError):
            return None


@dataclass(frozen=True)
class Cell:
    """The flights of one controller with one fault, severity and time of occurrence, one per vehicle."""

    case: Case
    severity: str
    flights: list[FlownFault]

    @property
    def survived(self) -> int:
        """Number of flights that reached their end."""
        return sum(flight.survived for flight in self.flights)

    @property
    def share(self) -> float:
        """Share, from 0 to 1, of the flights that reached their end."""
        return self.survived / len(self.flights)

    @property
    def worst(self) -> FlownFault:
        """The worst flight: one that crashed, else the first one lost, else that of the largest attitude deviation."""
        return min(self.flights, key=_rank)

    @property
    def attitude(self) -> float | None:
        """Largest deviation of attitude in the flights without a crash, rad; None if all crashed."""
        return max((f.attitude for f in self.flights if f.attitude is not None), default=None)

    @property
    def altitude(self) -> float | None:
        """Largest deviation of altitude in the flights without a crash, m; None if all crashed."""
        return max((f.altitude for f in self.flights if f.altitude is not None), default=None)

    @property
    def recovery_time(self) -> float | None:
        """Longest recovery time, s; None if any flight is lost or does not recover."""
        times = [flight.recovery_time if flight.survived else None for flight in self.flights]
        known = [time for time in times if time is not None]
        return max(known) if len(known) == len(times) else None

    @property
    def time_to_loss(self) -> float | None:
        """Shortest time from fault to loss, s, of flights without a crash of the controller; None if none is lost."""
        return min((f.time_to_loss for f in self.flights if f.time_to_loss is not None), default=None)


def _rank(flight: FlownFault) -> tuple[float, float]:
    """Return a sort key: crashed flights, then lost (earliest first), then survived (largest deviation first)."""
    return (1.0, -(flight.attitude or 0.0)) if flight.survived else (0.0, flight.time_to_loss or 0.0)


@dataclass(frozen=True)
class Square:
    """Results of one controller with one fault: cells (ordered by severity) and boundary by time of occurrence."""

    cells: dict[Moment, list[Cell]] = field(default_factory=dict)
    boundaries: dict[Moment, Boundary] = field(default_factory=dict)

    @property
    def every(self) -> list[Cell]:
        """The cells of all times of occurrence."""
        return [cell for row in self.cells.values() for cell in row]

    @property
    def worst(self) -> Cell:
        """The cell with the worst flight of all cells."""
        return min(self.every, key=lambda cell: _rank(cell.worst))


@dataclass(frozen=True)
class ResilienceResults:
    """The results of a whole campaign."""

    campaign: ResilienceCampaign
    squares: dict[tuple[str, str], Square]
    """Results by (fault, controller)"""

    @classmethod
    def read(cls, campaign: ResilienceCampaign, store: CaseStore) -> ResilienceResults:
        """Return the results in ``store``; a ``CampaignError`` if a case is missing or its file is damaged."""
        names = [subject.name for subject in campaign.subjects]
        squares = {pair: Square() for pair in product(campaign.faults, names)}
        for number, case in enumerate(campaign.cases):
            if (outcome := store.read(number)) is None:
                raise CampaignError(f"{store.folder}: {case.label} is missing; run the same command again to fly it")
            square, (flights, boundary) = squares[case.fault, case.subject.name], outcome
            square.boundaries[case.moment] = boundary
            square.cells[case.moment] = [
                Cell(case, severity, [f for f in flights if f.severity == severity]) for severity in SEVERITIES
            ]
        return cls(campaign, squares)

    @property
    def cells(self) -> list[Cell]:
        """All cells, ordered by fault, controller, time of occurrence and severity."""
        return [cell for square in self.squares.values() for cell in square.every]


def survived(cells: Sequence[Cell]) -> tuple[int, int]:
    """Return the numbers of flights in ``cells`` that reached their end, and of all their flights."""
    return sum(cell.survived for cell in cells), sum(len(cell.flights) for cell in cells)


def boundaries_in_words(fault: TriedFault, boundaries: Mapping[Moment, Boundary]) -> list[str]:
    """Return texts on the severities that the nominal vehicle survives: one per moment, or one if they are equal."""
    texts = {}
    for moment in Moment:
        boundary = boundaries[moment]
        if boundary.survived is None:
            texts[moment] = f"lost at {fault.values_text(fault.harmless)}"
        elif boundary.lost is None:
            texts[moment] = f"survives all, to {fault.values_text(fault.worst)}"
        else:
            texts[moment] = f"survives to {fault.values_text(fault.value(boundary.survived))}"
    if len({*texts.values()}) == 1:
        return list(texts.values())[:1]
    return [f"{text} ({moment.name})" for moment, text in texts.items()]
