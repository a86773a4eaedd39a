"""Definition of a figure: the paper's number and caption, what it needs, how it is drawn, and the remarks on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

from matplotlib.figure import Figure

from hsv.control.design import ControlDesign, certificate_path, find_design, read_certificate, read_design
from hsv.flight.metrics import FlightData


class Design:
    """A shipped design with its certificate."""

    def __init__(self, name: str) -> None:
        self._path = find_design(name)

    @cached_property
    def flown(self) -> ControlDesign:
        """The numbers that fly."""
        return read_design(self._path)

    @cached_property
    def certificate(self) -> dict[str, Any]:
        """The evidence for them."""
        return read_certificate(certificate_path(self._path))


class FlightSource(Protocol):
    """Gives flights by the names of their scenarios."""

    def __getitem__(self, scenario: str, /) -> FlightData:
        """Return the flight of a shipped scenario."""


@dataclass
class Material:
    """Data from which figures are drawn."""

    flights: FlightSource
    """Flights by scenario."""
    _designs: dict[str, Design] = field(default_factory=dict)

    def design(self, name: str) -> Design:
        """Return a shipped design, read once."""
        return self._designs.setdefault(name, Design(name))


@dataclass(frozen=True)
class Drawing:
    """A drawn figure and three remarks on it, with the numbers of this drawing."""

    figure: Figure
    shows: str
    agrees: str
    differs: str


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper."""

    number: int
    caption: str
    """The paper's."""
    draw: Callable[[Material], Drawing]
    scenarios: tuple[str, ...] = ()
    """The flights it shows."""

    @property
    def stem(self) -> str:
        """Name of its files without their endings."""
        return f"figure_{self.number:02}"
