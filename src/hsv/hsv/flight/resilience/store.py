"""Storage of a resilience campaign: a file per case, under a digest of everything that its flights depend on."""

from __future__ import annotations

from pathlib import Path

from hsv.base.files import parse_json, read_text
from hsv.flight.campaign.run import Store, write_whole
from hsv.flight.resilience.campaign import Case, ResilienceCampaign
from hsv.flight.resilience.flights import Boundary, FlownFault, fly_case
from hsv.flight.sources import DIGITS, code_digest, digest_of, drop_older

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
        return {n for n, case in enumerate(self._cases) if not restart and self.read(case) is not None}

    def keep(self, batch: int, content: bytes) -> None:
        """Store the results of a case, and remove those of other code."""
        path = self._path(self._cases[batch])
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
        digest = digest_of([case.text.encode(), self._code])
        return self.folder / f"{case.label}_{digest[:DIGITS]}.json"
