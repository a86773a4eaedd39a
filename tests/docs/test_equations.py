"""The equation map names what exists, and every equation."""

import re
from importlib import import_module
from pathlib import Path

import pytest

import hsv
from hsv.core import lib

SOURCES = Path(hsv.__file__).parent
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
    for name in re.findall(r"`(hsv_\w+)`", TEXT):
        assert hasattr(lib, name)
    for name, header in re.findall(r"`(\w+)` of `(core/\w+\.h)`", TEXT):
        assert f"{name}(" in (SOURCES / header).read_text(encoding="utf-8")


def test_every_numbered_equation_of_the_paper_is_on_the_page():
    rows = [line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| (")]
    numbers = {int(number) for row in rows for number in re.findall(r"\((\d+)\)", row)}
    assert numbers == set(range(1, 55))


@pytest.mark.parametrize("number", range(1, 55))
def test_one_search_finds_every_equation_where_it_is_computed(number):
    [*rows] = [line for line in TEXT.splitlines() if line.startswith("| (") and f"({number})" in line.split("|")[1]]
    named = {name.rpartition(".")[0] for row in rows for name in re.findall(r"`(hsv\.[\w.]+)`", row)}
    modules = {
        name if Path(SOURCES, *name.split(".")[1:]).with_suffix(".py").is_file() else name.rpartition(".")[0]
        for name in named
    }
    headers = [SOURCES / header for row in rows for header in re.findall(r"`(core/\w+\.h)`", row)]
    paths = [*headers, *(Path(SOURCES, *name.split(".")[1:]).with_suffix(".py") for name in modules)]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    assert any(re.search(rf"eq\. {number}\b", text) for text in texts), sorted(modules)
