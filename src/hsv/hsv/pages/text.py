"""Quantities as HTML in all systems of units, of which the page shows one."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping

from markupsafe import Markup, escape

from hsv.base.errors import visible
from hsv.base.units import UnitSystem, in_system

SYSTEMS = {UnitSystem.metric: "SI, degrees", UnitSystem.si: "strict SI", UnitSystem.paper: "paper (ft, deg)"}
"""Names of the systems of units in the switch of a page."""


def quantity(value: float | None, unit: str, digits: int = 5, *, signed: bool = False, share: bool = False) -> Markup:
    """Return ``value`` (in the SI ``unit``) with its unit as HTML in all systems of units; a dash for None.

    With ``signed``, a positive value has a plus sign; with ``share``, the value is in percent except in strict SI.
    """
    if value is None:
        return Markup("–")
    texts = {}
    for system in SYSTEMS:
        shown, name = in_system(value, unit, system, share=share)
        sign = "+" if signed and value > 0.0 else ""
        texts[system] = f"{sign}{number(shown, digits)}" + (f"&nbsp;{unit_html(name)}" if name not in ("1", "") else "")
    return switched(texts)


def in_brackets(unit: str, *, share: bool = False) -> Markup:
    """Return the unit in brackets as HTML in all systems of units; empty for a pure number."""
    names = {system: unit_html(in_system(1.0, unit, system, share=share)[1]) for system in SYSTEMS}
    return switched({system: f" [{name}]" if name else "" for system, name in names.items()})


def units_of(unit: str, *, share: bool = False) -> dict[str, dict[str, float | str]]:
    """Return, by system of units, the displayed unit and the factor from SI to it, for the page's script."""
    found = {system: in_system(1.0, unit, system, share=share) for system in SYSTEMS}
    return {str(system): {"unit": unit_html(name), "factor": scale} for system, (scale, name) in found.items()}


def unit_html(unit: str) -> str:
    """Return a unit as HTML with superscript exponents and dots between factors; empty for a pure number."""
    if unit == "1":
        return ""
    return str(escape(unit)).replace("^0.5", "<sup>½</sup>").replace("^2", "<sup>2</sup>").replace(" ", "·")


def number(value: float, digits: int = 5) -> str:
    """Return ``value`` with ``digits`` significant digits and a typographic minus sign."""
    return f"{value:.{digits}g}".replace("-", "−")


def shell(text: object) -> str:
    """Return a text of a file as one word of a shell, to be copied without running what it contains."""
    return shlex.quote(visible(str(text)))


def commit_id(text: str) -> str:
    """Return ``text`` if it is the id of a commit, without the mark of uncommitted changes; otherwise an empty text."""
    found = re.fullmatch("([0-9a-f]{7,64})(-dirty)?", text)
    return found[1] if found else ""


def capitalised(text: str) -> str:
    """Return a text with its first letter in upper case."""
    return text[:1].upper() + text[1:]


def switched(texts: Mapping[UnitSystem, str]) -> Markup:
    """Return HTML with a text for each system of units, of which the page shows one; equal texts are merged."""
    systems: dict[str, list[str]] = {}
    for system, text in texts.items():
        systems.setdefault(text, []).append(system)
    if len(systems) == 1:
        return Markup(next(iter(systems)))
    return Markup("".join(f'<span class="{" ".join(names)}">{text}</span>' for text, names in systems.items()))
