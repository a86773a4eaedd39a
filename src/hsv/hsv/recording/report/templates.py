"""The templates of pages: what all of them are made with."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from hsv.recording.report import text


def environment_of(package: str, *, escaped: bool = True) -> Environment:
    """Return the environment of the templates in the folder ``template`` of a package.

    Args:
        package: Its dotted name.
        escaped: Whether what is put into them is text for HTML.
    """
    environment = Environment(
        loader=PackageLoader(package, "template"),
        autoescape=escaped,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": text.number, "words": text.words}
    return environment
