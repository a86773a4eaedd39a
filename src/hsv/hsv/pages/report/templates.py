"""The templates of pages: what all of them are made with."""

from __future__ import annotations

from importlib.resources import files

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from hsv.flight.metrics import in_words
from hsv.pages.report import text

SHARED = "hsv.pages.report"
"""The package whose templates, style and scripts all pages share."""

LIBRARY = files(SHARED).joinpath("plotly", "plotly-basic.min.js")
"""The plotting library of all pages; see the README beside it."""


def environment_of(package: str, *, escaped: bool = True) -> Environment:
    """Return the environment of the templates in the folder ``template`` of a package, and of the shared ones.

    Args:
        package: Its dotted name.
        escaped: Whether what is put into them is text for HTML.
    """
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package, "template"), PackageLoader(SHARED, "template")]),
        autoescape=escaped,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": text.number,
        "percent": text.percent,
        "words": in_words,
        "breakable": text.breakable,
        "counted": text.counted,
    }
    environment.globals |= {
        "asset": asset,
        "quantity": text.quantity,
        "in_brackets": text.in_brackets,
        "unit": text.unit,
        "unit_systems": text.SYSTEMS,
    }
    return environment


def asset(name: str, package: str = SHARED) -> Markup:
    """Return a style or script of the folder ``template`` of a package, as it is."""
    return Markup(files(package).joinpath("template", name).read_text(encoding="utf-8"))
