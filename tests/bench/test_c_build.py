import shutil

import pytest
from flights import components

from hsv.base.errors import RunError
from hsv.bench.c_build import c_flight, compiled
from hsv.bench.controllers import laws_in_c
from hsv.bench.in_process import against_c
from hsv.flight.closed_loop import fly
from hsv.flight.fingerprint import fingerprint

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@needs_compiler
@pytest.mark.parametrize("scenario", ["case1", "case2"])
def test_the_loop_in_c_alone_flies_the_same_bits_every_time(scenario):
    parts = components(scenario, duration=110.0)
    in_c = c_flight(parts)
    for _ in range(2):
        assert fingerprint(in_c().flown) == fly(parts).fingerprint


@needs_compiler
def test_flights_from_python_and_laws_in_c_are_compared_with_the_same_bits():
    figures = [*against_c(1), *laws_in_c(1)]
    assert [figure.name for figure in figures] == ["in_process", "c_function", "c_library"]
    assert {figure.note for figure in figures} == {"the same bits"}


@needs_compiler
def test_a_failed_build_is_reported(tmp_path):
    source = tmp_path / "wrong.c"
    source.write_text("int f(void) { return }\n", encoding="utf-8")
    with pytest.raises(RunError, match=r"C build: .* failed"):
        compiled(tmp_path / "wrong.so", [source])


def test_a_missing_compiler_is_reported(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RunError, match="no C compiler cc on PATH"):
        compiled(tmp_path / "none.so", [])
