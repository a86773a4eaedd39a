"""Quantities as pages print them: all systems of units are there, the page shows one."""

from __future__ import annotations

from collections.abc import Mapping

from markupsafe import Markup, escape

from hsv.base.units import UnitSystem, in_system

SYSTEMS = {UnitSystem.metric: "SI, degrees", UnitSystem.si: "strict SI", UnitSystem.paper: "paper (ft, deg)"}
"""Names of the systems of units in the switch of a page."""


def unit_html(unit: str) -> str:
    """Return a unit as HTML: roots and powers raised, factors joined; nothing for a pure number."""
    if unit == "1":
        return ""
    raised = str(escape(unit)).replace("^0.5", "<sup>½</sup>").replace("^2", "<sup>2</sup>")
    return raised.replace(" ", "·")


def quantity(value: float, unit: str, digits: int = 5, *, signed: bool = False, share: bool = False) -> Markup:
    """Return ``value``, given in the SI ``unit``, in all systems of units.

    Args:
        value: The number.
        unit: Its SI unit.
        digits: Significant digits.
        signed: Whether a positive number has a sign too.
        share: Whether it is a share of something.
    """
    plus = "+" if signed and value > 0.0 else ""
    shown = {system: in_system(value, unit, system, share=share) for system in SYSTEMS}
    return switched({system: plus + _with_unit(*pair, digits) for system, pair in shown.items()})


def decimals(value: float | None, unit: str, places: Mapping[str, int]) -> Markup:
    """Return ``value``, given in the SI ``unit``, with so many decimals in each system of units; a dash for none."""
    if value is None:
        return Markup("–")
    shown = {system: in_system(value, unit, system)[0] for system in SYSTEMS}
    return switched({system: f"{number:.{places[system]}f}".replace("-", "−") for system, number in shown.items()})


def unit(unit: str, *, share: bool = False) -> Markup:
    """Return the unit in all systems; nothing for a pure number."""
    return switched({system: unit_html(in_system(1.0, unit, system, share=share)[1]) for system in SYSTEMS})


def in_brackets(unit: str, *, share: bool = False) -> Markup:
    """Return the unit in all systems as printed after a heading; nothing for a dimensionless number."""
    names = {system: unit_html(in_system(1.0, unit, system, share=share)[1]) for system in SYSTEMS}
    return switched({system: f" [{name}]" if name else "" for system, name in names.items()})


def units_of(unit: str, *, share: bool = False) -> dict[str, dict[str, float | str]]:
    """Return the data with which a page's script draws a quantity of an SI ``unit``: by system, factor and unit."""
    found = {system: in_system(1.0, unit, system, share=share) for system in SYSTEMS}
    return {str(system): {"unit": unit_html(name), "factor": scale} for system, (scale, name) in found.items()}


def number(value: float, digits: int = 5) -> str:
    """Return ``value`` with so many significant digits, a true minus sign and no empty decimals."""
    return f"{value:.{digits}g}".replace("-", "−")


def percent(share: float) -> str:
    """Return a share in percent, with two significant digits and no power of ten but of a small one."""
    return f"{number(float(f'{100.0 * share:.2g}'), 15)} %"


def counted(count: int, name: str) -> str:
    """Return how many there are of what has a regular plural."""
    return f"{count} {name}" if count == 1 else f"{count} {name}s"


def capitalised(text: str) -> str:
    """Return a text as a sentence begins."""
    return text[:1].upper() + text[1:]


def breakable(name: str) -> Markup:
    """Return a name of the program that may go on in a next line where it has underscores."""
    return Markup("_<wbr>").join(name.split("_"))


def _with_unit(value: float, unit: str, digits: int) -> str:
    return f"{number(value, digits)}&nbsp;{unit_html(unit)}" if unit not in ("1", "") else number(value, digits)


def switched(texts: Mapping[UnitSystem, str]) -> Markup:
    """Return the text of the system of units that the page shows, of HTML by system; equal ones are there once."""
    systems: dict[str, list[str]] = {}
    for system, text in texts.items():
        systems.setdefault(text, []).append(system)
    if len(systems) == 1:
        return Markup(next(iter(systems)))
    return Markup("".join(f'<span class="{" ".join(names)}">{text}</span>' for text, names in systems.items()))
