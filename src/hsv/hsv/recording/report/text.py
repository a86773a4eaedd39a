"""Quantities as the page prints them: both systems of units are there, the page shows one."""

from __future__ import annotations

from markupsafe import Markup, escape

from hsv.units import to_paper


def unit_html(unit: str) -> str:
    """Return a unit as HTML: roots and powers raised, factors joined; nothing for a pure number."""
    if unit == "1":
        return ""
    raised = str(escape(unit)).replace("^0.5", "<sup>½</sup>").replace("^2", "<sup>2</sup>")
    return raised.replace(" ", "·")


def quantity(value: float, unit: str, digits: int = 5) -> Markup:
    """Return ``value``, given in the SI ``unit``, in both systems of units."""
    other, paper = to_paper(value, unit)
    text = _with_unit(value, unit, digits)
    if paper == unit:
        return Markup(text)
    return Markup(f'<span class="si">{text}</span><span class="paper">{_with_unit(other, paper, digits)}</span>')


def unit(unit: str) -> Markup:
    """Return the unit in both systems."""
    paper = to_paper(1.0, unit)[1]
    if paper == unit:
        return Markup(unit_html(unit))
    return Markup(f'<span class="si">{unit_html(unit)}</span><span class="paper">{unit_html(paper)}</span>')


def number(value: float, digits: int = 5) -> str:
    """Return ``value`` with so many significant digits, a true minus sign and no empty decimals."""
    return f"{value:.{digits}g}".replace("-", "−")


def words(name: str) -> str:
    """Return a name of the program in words."""
    return name.replace("_", " ")


def _with_unit(value: float, unit: str, digits: int) -> str:
    return f"{number(value, digits)}&nbsp;{unit_html(unit)}" if unit not in ("1", "") else number(value, digits)
