"""The tables of a scenario's file, each with its fields, their units and what they may be."""

from __future__ import annotations

import json
from functools import cached_property, lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, StrictInt

from hsv.flight.fields import Coupling, Frequencies, Numbers, Table, Time, enveloped, quantity, relative_change
from hsv.model.vehicle import DEFAULT_VEHICLE, Vehicle, load_vehicle, parse_vehicle

Change = Annotated[float, relative_change(-0.9, 10.0, shown="-90 % to +1000 %")]


class VehicleTable(Table):
    """The simulated vehicle; ``vehicle = "glider"`` in place of the table gives the name alone."""

    name: str = DEFAULT_VEHICLE
    """Registered, or the path of a file; what ``definition`` is called where there is one"""
    definition: dict[str, Any] = Field(default_factory=dict)
    """The contents of the vehicle's file, which a scenario takes along wherever it goes; none of a shipped one"""
    model: Literal["CM", "DM"] = "CM"
    coupling: Coupling = ""
    perturbation: dict[str, Change] = Field(default_factory=dict)

    @cached_property
    def described(self) -> Vehicle:
        """The vehicle itself."""
        return _defined(self.name, json.dumps(self.definition)) if self.definition else load_vehicle(self.name)


@lru_cache(maxsize=8)
def _defined(name: str, text: str) -> Vehicle:
    # Every flight of a campaign reads its scenario anew.
    return parse_vehicle(json.loads(text), name)


class InitialTable(Table):
    """Start of the flight, in trim."""

    altitude: Annotated[float, enveloped("altitude", "m")]
    velocity: Annotated[float, enveloped("velocity", "m/s")]


class ReferenceTable(Table):
    """The equilibrium of a ramp, that of the climb or as if its point stood; half the time of a blended corner."""

    trim: Literal["climbing", "static"] = "climbing"
    blend: Time = 0.0


class NotchTable(Table):
    """The notch filter in flight: the design's, but for what is given here, one value or one a section."""

    enabled: StrictBool = True
    zero_frequency: Frequencies = ()
    zero_damping: Numbers = ()
    pole_frequency: Frequencies = ()
    pole_damping: Numbers = ()


class NominalTable(Table):
    """Law for the nominal input."""

    law: Literal["family", "kothare_online", "qp"] = "family"


class TauChangeTable(Table):
    """A change of the tube's factor in flight."""

    start: Time
    tau: Numbers


class TubeTable(Table):
    """The tube's feedback: its factor, the design's where none is given, and its changes; one value, or five."""

    tau: Numbers = ()
    change: tuple[TauChangeTable, ...] = ()


class IntegralTable(Table):
    """Integral action on altitude and velocity errors, a named extension of the tube law."""

    rate: Annotated[float, quantity("1/s", 0.0, 1.0, shown="0 / s to 1 / s")] = 0.0


class RobustMpcTable(Table):
    """The robust MPC controller."""

    gain_index: StrictInt = 0


class FaultTable(Table):
    """A scheduled fault; in a file its parameters stand beside the rest."""

    channel: str
    type: str
    start: Time
    stop: Time | None = None
    parameters: dict[str, float] = Field(default_factory=dict)
    """Parameters of the fault type, SI."""
