"""The equation map names what exists, and every equation."""

import re
from importlib import import_module
from pathlib import Path

TEXT = (Path(__file__).parents[2] / "docs" / "equations.md").read_text()


def found(name):
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            thing = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            thing = getattr(thing, part)
        return thing
    raise AssertionError(f"{name}: no such module")


def test_every_name_on_the_page_exists():
    names = set(re.findall(r"`(hsv\.[\w.]+)`", TEXT))
    assert len(names) > 30
    for name in names:
        assert found(name) is not None


def test_every_numbered_equation_of_the_paper_is_on_the_page():
    rows = [line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| (")]
    numbers = {int(number) for row in rows for number in re.findall(r"\((\d+)\)", row)}
    assert numbers == set(range(1, 55))
