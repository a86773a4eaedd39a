"""Commands on the model of a vehicle: trim and linear models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from hsv.base.units import UnitSystem, significant
from hsv.cli import output
from hsv.cli.options import JsonOption, UnitsOption, check_target, writing

if TYPE_CHECKING:
    from rich.table import Table

    from hsv.control.linear_model import LinearModel
    from hsv.model.lpv.linearisation import Mode

AltitudeOption = Annotated[
    str, Option(help="Altitude with unit, e.g. '85500 ft'; default: a published point, or the envelope's middle.")
]
VelocityOption = Annotated[str, Option(help="Velocity with unit, e.g. '7900 ft/s'; default likewise.")]
CouplingOption = Annotated[
    str, Option(help="Inertial coupling: a set of the vehicle, or a multiple of derived, as 0.65.")
]
VehicleOption = Annotated[str, Option(help="Vehicle, by name or path of a TOML file; default: the paper's.")]

UNIT_SYSTEMS = {
    UnitSystem.metric: "SI with degrees",
    UnitSystem.si: "SI",
    UnitSystem.paper: "ft, ft/s, deg, slug^0.5 ft",
}


def trim(
    altitude: AltitudeOption = "",
    velocity: VelocityOption = "",
    climb_rate: Annotated[str, Option(help="Climb rate with unit, e.g. '10 ft/s'.")] = "0 m/s",
    acceleration: Annotated[str, Option(help="Acceleration with unit, e.g. '4 ft/s^2'.")] = "0 m/s^2",
    vehicle: VehicleOption = "",
    coupling: CouplingOption = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute the equilibrium at an altitude and a velocity (paper eq. 5): level, or climbing and accelerating.

    Example: hsv trim --altitude "85500 ft" --velocity "7900 ft/s" --units paper
    """
    from hsv.model.dynamics import forces
    from hsv.model.trim import trim_at
    from hsv.model.vehicle import DEFAULT_VEHICLE, load_vehicle

    described = load_vehicle(vehicle or DEFAULT_VEHICLE)
    parameters = described.coupled(coupling)
    found = trim_at(parameters, *described.condition(altitude, velocity), climb_rate, acceleration)
    units_of_forces = {"lift": "N", "drag": "N", "thrust": "N", "pitching_moment": "N m", "dynamic_pressure": "Pa"}
    acting = zip(units_of_forces.items(), forces(found.state, found.input, parameters), strict=True)
    quantities = found.quantities | {name: (value, unit) for (name, unit), value in acting}
    if json:
        output.print_json(output.to_json(quantities, units) | {"largest_residual_si": found.residual})
    else:
        output.print_table("Trim", quantities, units, digits=5)


def linearise(
    altitude: AltitudeOption = "",
    velocity: VelocityOption = "",
    vehicle: VehicleOption = "",
    coupling: CouplingOption = "",
    model: Annotated[str, Option(help="Model: coupled (CM), decoupled (DM), with notch filter (ECM).")] = "CM",
    reading: Annotated[str, Option(help="Pitch rate in eq. 40 (ECM): physical (q) or printed (q').")] = "",
    out: Annotated[Path | None, Option(help="Also write the model to this .mat, .npz or .json file.")] = None,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute the linear model at a trim point, its poles and zeros (paper eq. 6 to eq. 9; ECM: eq. 40 to eq. 43).

    The zeros are those from both inputs to altitude and velocity. Files and JSON have A, B, C and D, the names and
    units of states, inputs and outputs, and the operating point.

    Example: hsv linearise --coupling derived --model ECM --out model.mat
    """
    from hsv.control.linear_model import linearise

    if out:
        check_target(out, "out", ".mat", ".npz", ".json")
    found = linearise(altitude, velocity, vehicle=vehicle, coupling=coupling, model=model, reading=reading)
    if json or out:
        units = output.json_system(units)
    shown = found.in_units(units)
    poles, zeros = found.poles, found.zeros
    described = _described(shown, units) | {"poles": [*map(_mode, poles)], "zeros": [*map(_mode, zeros)]}
    if out:
        with writing(out, "out"):
            if out.suffix == ".json":
                from hsv.base.files import json_text

                out.write_text(json_text(described, indent=2) + "\n", encoding="utf-8")
            else:
                shown.save(out)
    if json:
        output.print_json(described)
        return
    for name, matrix, columns in (("A", shown.A, shown.states), ("B", shown.B, shown.inputs)):
        cells = [[significant(entry) for entry in row] for row in matrix.tolist()]
        output.print_matrix(f"{name} ({UNIT_SYSTEMS[units]})", list(shown.states), list(columns), cells)
    output.console.print(_modes_table("Poles", poles))
    if zeros:
        output.console.print(_modes_table("Zeros from both inputs to altitude and velocity", zeros))
    if out:
        output.say(f"written {out}")


def _described(model: LinearModel, units: UnitSystem) -> dict[str, Any]:
    """Return a linear model as JSON; its numbers are in ``units``, whose name is in the keys of the matrices."""
    values = {name: value.tolist() if hasattr(value, "tolist") else value for name, value in model.as_dict().items()}
    matrices = {f"{name}_{units}": values.pop(name) for name in "ABCD"}
    points = (("state", model.states), ("input", model.inputs))
    at = {
        f"{name}{'_' * bool(output.unit_key(unit))}{output.unit_key(unit)}": value
        for kind, signals in points
        for (name, unit), value in zip(signals.items(), values.pop(f"operating_{kind}"), strict=True)
    }
    return values | matrices | {"operating_point": at}


def _damping(mode: Mode) -> float | None:
    """Return the damping ratio; None for a pole at the origin, where its sign would be that of a rounding error."""
    return mode.damping_ratio if round(mode.natural_frequency, 9) else None


def _mode(mode: Mode) -> dict[str, float | None]:
    return {
        "real_rad_per_s": mode.pole.real,
        "imag_rad_per_s": mode.pole.imag,
        "natural_frequency_rad_per_s": mode.natural_frequency,
        "damping_ratio": _damping(mode),
    }


def _modes_table(title: str, modes: list[Mode]) -> Table:
    headings = ("real rad/s", "imaginary rad/s", "frequency rad/s", "damping ratio")
    table = output.new_table(*headings, title=title, right=headings)
    for mode in modes:
        damping = _damping(mode)
        table.add_row(
            # A pole at the origin has a rounding error.
            significant(round(mode.pole.real, 9) + 0.0),
            f"±{significant(mode.pole.imag)}" if mode.pole.imag else "0",
            significant(round(mode.natural_frequency, 9)),
            "-" if damping is None else significant(damping),
        )
    return table
