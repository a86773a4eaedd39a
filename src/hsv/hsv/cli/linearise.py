"""hsv linearise"""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.options import AltitudeOption, CouplingOption, JsonOption, VelocityOption
from hsv.cli.output import console, print_json


def linearise(
    altitude: AltitudeOption = "85000 ft",
    velocity: VelocityOption = "7702.0808 ft/s",
    coupling: CouplingOption = "paper_like",
    model: Annotated[str, typer.Option(help="Coupled (CM) or decoupled (DM) model.")] = "CM",
    json: JsonOption = False,
) -> None:
    """Jacobians A, B and poles at a trim point (paper eq. 6-9), SI.

    Example: hsv linearise --coupling derived
    """
    from hsv.errors import QuantityError
    from hsv.units import parse_quantity
    from hsv.vehicle.dynamics import INPUT_NAMES, STATE_NAMES, jacobian
    from hsv.vehicle.modes import modes
    from hsv.vehicle.parameters import MODELS, vehicle_parameters
    from hsv.vehicle.trim import trim

    if model not in MODELS:
        raise QuantityError(f"model = {model!r}: expected one of {', '.join(MODELS)}")
    vehicle = vehicle_parameters(coupling)
    if model == "DM":
        vehicle = vehicle.decoupled()
    point = trim(vehicle, parse_quantity(altitude, "m", "altitude"), parse_quantity(velocity, "m/s", "velocity"))
    A, B = jacobian(point.state, point.input, vehicle)
    poles = modes(A)
    if json:
        print_json(
            {
                "states": STATE_NAMES,
                "inputs": INPUT_NAMES,
                "A_si": A.tolist(),
                "B_si": B.tolist(),
                "poles": [
                    {
                        "real_rad_per_s": mode.pole.real,
                        "imag_rad_per_s": mode.pole.imag,
                        "natural_frequency_rad_per_s": mode.natural_frequency,
                        "damping_ratio": mode.damping_ratio,
                    }
                    for mode in poles
                ],
            }
        )
        return
    from rich.table import Table

    for name, matrix, columns in (("A", A, STATE_NAMES), ("B", B, INPUT_NAMES)):
        table = Table(title=f"{name} (SI)", title_justify="left", box=None, pad_edge=False, header_style="bold")
        table.add_column("")
        for column in columns:
            table.add_column(column.replace("_", "\n"), justify="right")
        for row, label in zip(matrix, STATE_NAMES, strict=True):
            table.add_row(label, *(f"{value:.4g}" for value in row))
        console.print(table)
    table = Table(title="Poles", title_justify="left", box=None, pad_edge=False, header_style="bold")
    for column in ("real rad/s", "imaginary rad/s", "frequency rad/s", "damping ratio"):
        table.add_column(column, justify="right")
    for mode in poles:
        table.add_row(
            f"{mode.pole.real:.4f}", f"±{mode.pole.imag:.4f}", f"{mode.natural_frequency:.4f}", f"{mode.damping_ratio:.4f}"
        )
    console.print(table)
