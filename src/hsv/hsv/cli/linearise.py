"""The command ``hsv linearise``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from hsv.base.units import UnitSystem, in_system, significant
from hsv.cli.options import (
    AltitudeOption,
    CouplingOption,
    JsonOption,
    UnitsOption,
    VehicleOption,
    VelocityOption,
)
from hsv.cli.output import console, json_system, new_table, print_json, print_matrix

if TYPE_CHECKING:
    from rich.table import Table

    from hsv.model.modes import Mode

READINGS = ("physical", "printed")

FILTER_UNITS = ("rad", "rad s")
UNIT_SYSTEMS = {
    UnitSystem.metric: "SI with degrees",
    UnitSystem.si: "SI",
    UnitSystem.paper: "ft, ft/s, deg, slug^0.5 ft",
}


def linearise(
    altitude: AltitudeOption = "85000 ft",
    velocity: VelocityOption = "7702.0808 ft/s",
    vehicle: VehicleOption = "",
    coupling: CouplingOption = "",
    model: Annotated[
        str, typer.Option(help="Coupled (CM) or decoupled (DM) model, or CM with the notch filter in it (ECM).")
    ] = "CM",
    reading: Annotated[
        str,
        typer.Option(
            help="Of eq. 40 (ECM): pitch rate that moves the vehicle, physical (q) or printed (q'); default: physical."
        ),
    ] = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute the Jacobians A, B and the poles at a trim point (paper eq. 6 to eq. 9; for the ECM eq. 40 to eq. 43).

    Example: hsv linearise --coupling derived --model ECM
    """
    import numpy as np

    from hsv.base.errors import QuantityError
    from hsv.cli.flight_point import trim_at
    from hsv.control.notch_filter import continuous, default_sections, series
    from hsv.model.dynamics import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS, jacobian
    from hsv.model.extended import Filter, extended_jacobian, extended_state
    from hsv.model.modes import modes
    from hsv.model.vehicle import DEFAULT_VEHICLE, load_vehicle
    from hsv.model.vehicle_parameters import MODELS

    if model not in (*MODELS, "ECM"):
        raise QuantityError(f"model = {model!r}: expected one of {', '.join((*MODELS, 'ECM'))}")
    if reading and model != "ECM":
        raise QuantityError(f"reading = {reading!r}: expected with model ECM only")
    reading = reading or READINGS[0]
    if reading not in READINGS:
        raise QuantityError(f"reading = {reading!r}: expected one of {', '.join(READINGS)}")
    parameters = load_vehicle(vehicle or DEFAULT_VEHICLE).coupled(coupling)
    if model == "DM":
        parameters = parameters.decoupled()
    point = trim_at(parameters, altitude, velocity)
    names: tuple[str, ...] = STATE_NAMES
    state_units: tuple[str, ...] = STATE_UNITS
    difference: list[Mode] = []
    if model == "ECM":
        notch = Filter(*series(continuous(default_sections())))
        state = extended_state(point.state, notch)
        made = {name: extended_jacobian(state, point.input, parameters, notch, name == "printed") for name in READINGS}
        A, B = made[reading]
        difference = modes(next(made[name][0] for name in READINGS if name != reading))
        names = tuple("filtered_pitch_rate" if name == "pitch_rate" else name for name in STATE_NAMES)
        names += tuple(f"filter_{i + 1}" for i in range(len(notch.B)))
        state_units += FILTER_UNITS * (len(notch.B) // 2)
    else:
        A, B = jacobian(point.state, point.input, parameters)
    poles = modes(A)
    if json:
        units = json_system(units)
    state, inputs = (np.array([in_system(1.0, unit, units)[0] for unit in row]) for row in (state_units, INPUT_UNITS))
    A = A * state[:, None] / state
    B = B * state[:, None] / inputs
    if json:
        print_json(
            {
                "states": names,
                "inputs": INPUT_NAMES,
                f"A_{units}": A.tolist(),
                f"B_{units}": B.tolist(),
                "poles": [_pole(mode) for mode in poles],
            }
            | ({"poles_of_the_other_reading": [_pole(mode) for mode in difference]} if difference else {})
        )
        return
    for name, matrix, columns in (("A", A, names), ("B", B, INPUT_NAMES)):
        cells = [[significant(entry) for entry in row] for row in matrix.tolist()]
        print_matrix(f"{name} ({UNIT_SYSTEMS[units]})", names, columns, cells)
    console.print(_poles("Poles", poles))
    if difference:
        console.print(_poles("Poles for the other reading of eq. 40", difference))


def _pole(mode: Mode) -> dict[str, float]:
    return {
        "real_rad_per_s": mode.pole.real,
        "imag_rad_per_s": mode.pole.imag,
        "natural_frequency_rad_per_s": mode.natural_frequency,
        "damping_ratio": mode.damping_ratio,
    }


def _poles(title: str, poles: list[Mode]) -> Table:
    headings = ("real rad/s", "imaginary rad/s", "frequency rad/s", "damping ratio")
    table = new_table(*headings, title=title, right=headings)
    for mode in poles:
        table.add_row(
            # What rounding leaves of a pole at zero is no number.
            significant(round(mode.pole.real, 9) + 0.0),
            f"±{significant(mode.pole.imag)}" if mode.pole.imag else "0",
            significant(round(mode.natural_frequency, 9)),
            significant(mode.damping_ratio),
        )
    return table
