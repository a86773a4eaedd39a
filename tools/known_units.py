"""Writes the table of known units, as the units library has them: ``python3 tools/known_units.py``."""

from __future__ import annotations

import json
from pathlib import Path

from hsv.base.units import square_by_pint

TABLE = Path(__file__).parents[1] / "src" / "hsv" / "hsv" / "base" / "known_units.json"

LENGTHS = ("m", "km", "mm", "ft", "kft")
TIMES = ("s", "ms", "min", "h")
ANGLES = ("rad", "mrad", "deg", "arcsec")
UNITS = (
    *("", "1", "percent", "kg", "slug", "kg m^2", "slug ft^2", "slug/ft", "kg/m", "Hz", "rpm", "km/h", "kn"),
    *(f"1/{time}" for time in TIMES),
    *(f"percent/{time}" for time in TIMES),
    *LENGTHS,
    *TIMES,
    *ANGLES,
    *(f"{angle}/{time}{power}" for angle in ANGLES for time in ("s", "min") for power in ("", "^2")),
    *(f"{angle} s" for angle in ANGLES),
    *(f"{length}/s{power}" for length in LENGTHS for power in ("", "^2")),
    *(f"{length} s" for length in ("m", "ft")),
    *(f"{length}^2" for length in ("m", "ft")),
    *("N", "kN", "lbf", "N m", "lbf ft", "Pa", "kPa", "lbf/ft^2", "kg/m^3", "slug/ft^3"),
    *(f"{mass}^0.5 {length}{rate}" for mass, length in (("kg", "m"), ("slug", "ft")) for rate in ("", "/s", "/s^2")),
    *("N/kg^0.5", "lbf/slug^0.5"),
)
"""Units used in scenarios, vehicles and designs."""

if __name__ == "__main__":
    rows = {}
    for unit in dict.fromkeys(UNITS):
        factor, base = square_by_pint(unit)
        rows[unit] = [str(factor), base]
    lines = ",\n".join(f"  {json.dumps(unit)}: {json.dumps(row)}" for unit, row in rows.items())
    TABLE.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
