"""The greatest level of a flight in the tube's invariant set: what TubeStatus reports step by step, at once."""

from __future__ import annotations

from types import SimpleNamespace

from hsv.control.tube_law import TubeLaw
from hsv.core import Struct, doubles, lib, vector
from hsv.flight.closed_loop import Components
from hsv.flight.metrics import FlightData


class TubeLevels:
    """Levels in the set of one design, for flights that have its filter in the loop and its tube law at the end."""

    def __init__(self, parts: Components) -> None:
        """Read the set from the tube law among the components of the flights, if it is one."""
        law, notch = parts.controller, parts.notch_filter
        tube = law.design.tube if isinstance(law, TubeLaw) and notch.sections == law.design.notch else None
        self.set: Struct | None = None
        """The set as the core takes it; None: no set holds for the flights"""
        if tube:
            self.set = Struct("hsv_tube_set", SimpleNamespace(notch=notch.data, shape=tube.shape, centre=tube.centre))

    def worst(self, flight: FlightData) -> float | None:
        """Return the greatest level (e - c)' P (e - c) of the flight, None if no set holds for it."""
        if not self.set:
            return None
        given = [doubles(vector(each)) for each in (flight.state, flight.deviation, flight.reference)]
        return float(lib.hsv_worst_level(self.set.pointer, len(flight.state), *given))
