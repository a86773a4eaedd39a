"""The page engine: renders templates with style and scripts inline, and packs all curves into one compressed block.

All HTML pages share ``template/base.html.j2``, one stylesheet and the script that draws each :class:`Plot` with Plotly.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from hsv.base.errors import HsvError, reason, visible
from hsv.flight.metrics import spaced
from hsv.pages import text
from hsv.pages.text import units_of

LIBRARY = files("hsv.pages").joinpath("plotly", "plotly-basic.min.js")
"""The plotting library of all pages; see the README next to it."""


@dataclass
class Plot:
    """A plot of a page.

    A curve is a dictionary with ``kind`` (how the script draws it), ``label``, ``run`` (index of the flight with which
    it is hidden, or None), and ``x`` and ``y`` (indices of its arrays in :class:`Numbers`). A shade is a coloured time
    interval with ``kind``, ``from`` and ``to`` (s) and ``runs`` (indices of its flights).
    """

    name: str
    title: str
    unit: str
    """SI unit of y."""
    group: str
    curves: list[dict[str, Any]]
    share: bool = False
    """Whether y is a share, which is given in percent except in strict SI."""
    limits: Sequence[float] = ()
    """Limits, drawn as lines, in SI."""
    shades: Sequence[dict[str, Any]] = ()
    notes: Sequence[Markup] = ()
    """Remarks below the title."""
    x_unit: str | None = None
    """SI unit of x, or None if x is the time; all plots over time show the same interval."""
    x_share: bool = False
    limits_on: str = "y"
    """The axis that the limits belong to."""

    def described(self) -> dict[str, Any]:
        """Return the plot as plain data for JSON, from which the page's script draws it."""
        return {
            "name": self.name,
            "units": units_of(self.unit, share=self.share),
            "across": None if self.x_unit is None else units_of(self.x_unit, share=self.x_share),
            "curves": self.curves,
            "limits": list(self.limits),
            "limitsOn": self.limits_on,
            "shades": list(self.shades),
        }


@dataclass
class Numbers:
    """The arrays of all curves of a page, one after the other in single precision, which has seven digits."""

    lengths: list[int] = field(default_factory=list)
    blocks: dict[bytes, int] = field(default_factory=dict)

    def add(self, values: np.ndarray) -> int:
        """Store an array and return its index; equal arrays are stored once."""
        with np.errstate(over="ignore"):
            block = np.asarray(values, "<f4").tobytes()
        if block not in self.blocks:
            self.blocks[block] = len(self.lengths)
            self.lengths.append(len(values))
        return self.blocks[block]

    def array(self, index: int) -> np.ndarray:
        """Return the stored array with this ``index``, in double precision."""
        return np.frombuffer(list(self.blocks)[index], "<f4").astype(float)

    def packed(self) -> Markup:
        """Return all arrays as one block, gzipped and base64-encoded."""
        return compressed(b"".join(self.blocks))


def compressed(data: bytes) -> Markup:
    """Return ``data`` gzipped and base64-encoded; equal data give equal text."""
    return Markup(base64.b64encode(gzip.compress(data, 9, mtime=0)).decode())


def render(template: str, *, plots: Sequence[Plot] = (), numbers: Numbers | None = None, **values: Any) -> str:
    """Return the page that ``template`` makes; its script gets ``plots`` and ``values["described"]`` as JSON."""
    environment = Environment(
        loader=PackageLoader("hsv.pages", "template"),
        autoescape=template.endswith(".html.j2"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {}  # do not sort the keys
    environment.filters |= {"number": text.number, "words": spaced, "shell": text.shell, "commit_id": text.commit_id}
    environment.globals |= {
        "asset": _asset,
        "library": lambda: compressed(LIBRARY.read_bytes()),
        "quantity": text.quantity,
        "in_brackets": text.in_brackets,
        "unit_systems": text.SYSTEMS,
    }
    described = {"panels": [plot.described() for plot in plots], **values.pop("described", {})}
    packed = None
    if numbers is not None:
        described["lengths"] = numbers.lengths
        packed = numbers.packed()
    page = environment.get_template(template).render(plots=plots, described=described, numbers=packed, **values)
    return visible(page)


def _asset(name: str) -> Markup:
    """Return the text of a style sheet or script of the template folder."""
    return Markup(files("hsv.pages").joinpath("template", name).read_text(encoding="utf-8"))


def write_page(page: str, out: Path, error: type[HsvError]) -> None:
    """Write a page to the HTML file ``out``; if that fails, raise an exception of type ``error``."""
    try:
        out.write_text(page, encoding="utf-8")
    except OSError as refused:
        if out.is_file():
            out.unlink()  # incomplete
        why = f"{out}: cannot be written ({reason(refused)}), expected an HTML file to write"
        raise error(why) from None
