"""What make mutation takes for a change, and the list of the changes that no test is meant to see."""

import tomllib
from pathlib import Path

import pytest

from mutation import EXPLAINED, PACKAGES, ROOT, SOURCES, effective

CODE = """
@njit(cache=True)
def twice(x: float | None) -> float | None:
    y: float | None = 2.0
    return x * y
"""


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("(x: float | None)", "(x: float / None)"),
        ("-> float | None", "-> float - None"),
        ("y: float | None", "y: float * None"),
        ("cache=True", "cache=False"),
        ("@njit(cache=True)", ""),
    ],
)
def test_annotations_and_compilation_have_no_effect(before, after):
    assert effective(CODE.replace(before, after)) == effective(CODE)


@pytest.mark.parametrize(
    ("before", "after"), [("x * y", "x / y"), ("2.0", "3.0"), ("return x", "x"), ("njit", "cached")]
)
def test_what_is_computed_has(before, after):
    assert effective(CODE.replace(before, after)) != effective(CODE)


def test_what_is_no_python_is_refused():
    with pytest.raises(SyntaxError):
        effective(CODE.replace("return", "return *"))


def test_every_explained_survivor_is_a_line_of_the_code():
    entries = tomllib.loads(EXPLAINED.read_text(encoding="utf-8"))["survivor"]
    for entry in entries:
        assert entry.keys() == {"module", "before", "after", "reason"}
        assert Path(entry["module"]).parent.name in PACKAGES
        source = (ROOT / SOURCES / entry["module"]).read_text(encoding="utf-8")
        assert entry["before"] in " ".join(line.strip() for line in source.splitlines()), entry
        assert len(entry["reason"]) > 20
