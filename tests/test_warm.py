"""What the set-up compiles is all that commands need."""

import importlib.resources
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from marking import long

from hsv import ahead_of_time


@pytest.mark.long
def test_after_the_set_up_no_command_compiles(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "caches"), "XDG_CACHE_HOME": str(tmp_path / "kept")}

    def kept():
        return {path.name for path in (tmp_path / "caches").rglob("*") if path.is_file()}

    subprocess.run([sys.executable, "-m", "hsv.warm"], env=environment, check=True)
    before = kept()
    assert "ahead_of_time.json" in before and not any(name.endswith((".nbi", ".nbc")) for name in before)
    for words in (
        ("trim",),
        ("simulate", "case1"),
        ("simulate", "case1_realistic"),
        ("simulate", "case1_active"),
        ("montecarlo", "case1", "--samples", "40", "--workers", "1"),
    ):
        subprocess.run(["hsv", *words], env=environment, cwd=tmp_path, check=True)
        assert kept() == before, words
    # Another checkout takes the library, and compiles nothing: there is no compiler.
    another = {**environment, "NUMBA_CACHE_DIR": str(tmp_path / "another"), "CC": "/nowhere"}
    subprocess.run([sys.executable, "-m", "hsv.warm"], env=another, check=True)
    for name in before:
        assert (tmp_path / "another" / name).read_bytes() == (tmp_path / "caches" / name).read_bytes()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("moment", ["processes begin", "they are waited for", *(long(t) for t in (1, 2, 4))])
def test_interrupted_it_ends_with_its_processes(moment, number, tmp_path):
    places = {name: tmp_path / name.lower() for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "TMPDIR")}
    places["TMPDIR"].mkdir()
    environment = os.environ | {name: str(path) for name, path in places.items()}
    program = """
import os, runpy, sys
from hsv import ahead_of_time
def tell(event, function):
    def told(*arguments, **named):
        if named.get("wait", True):
            print(event, flush=True)
        return function(*arguments, **named)
    return told
if __name__ == "__main__":
    pool = ahead_of_time.ProcessPoolExecutor
    pool.submit = tell("processes begin", pool.submit)
    pool.shutdown = tell("they are waited for", pool.shutdown)
    print("imported", flush=True)
    runpy.run_module("hsv.warm", run_name="__main__")
"""
    path = tmp_path / "program.py"
    path.write_text(program)
    with subprocess.Popen(
        [sys.executable, path],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as running:
        awaited = moment if isinstance(moment, str) else "processes begin"
        assert any(line.strip() == awaited for line in running.stdout)
        if not isinstance(moment, str):
            time.sleep(moment)
        os.killpg(running.pid, signal.SIGINT) if number == signal.SIGINT else running.terminate()
        try:
            said = running.communicate(timeout=120)[1]  # until the last of its processes has ended
        finally:
            with suppress(ProcessLookupError):
                os.killpg(running.pid, signal.SIGKILL)
    assert (running.returncode, said) == (130, "python -m hsv.warm: interrupted\n")
    assert not [path for name in places for path in places[name].rglob("*") if path.is_file()]
    assert not list(places["TMPDIR"].iterdir())


@pytest.mark.parametrize("setting", ["no folder for caches", "NUMBA_DISABLE_JIT"])
def test_commands_run_where_nothing_is_kept_or_compiled(setting, tmp_path):
    environment = {**os.environ, "HOME": "/proc", "NUMBA_CACHE_DIR": "/proc"}
    if setting == "NUMBA_DISABLE_JIT":
        environment = {**os.environ, setting: "1"}
    program = "import numpy as np; from hsv.elementary import sine; print(sine(0.5), np.sin(0.5))"
    ran = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    ours, other = map(float, ran.stdout.split())
    assert ours == pytest.approx(other, rel=1e-15)


def test_sources_that_change_while_they_are_compiled_give_no_library(monkeypatch):
    monkeypatch.setattr(ahead_of_time, "install", lambda index, library: pytest.fail("it was installed"))
    monkeypatch.setattr(ahead_of_time, "state_of_sources", lambda: None)
    with pytest.raises(ahead_of_time.SourcesChangedError):
        ahead_of_time.build({})


def test_sources_that_have_changed_since_they_were_imported_are_not_compiled(tmp_path):
    package = copied(tmp_path)
    program = (
        "import runpy, hsv, hsv.elementary; from pathlib import Path\n"
        "path = Path(hsv.elementary.__file__); path.write_text(path.read_text() + '\\n')\n"
        "runpy.run_module('hsv.warm', run_name='__main__')"
    )
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "kept")}
    ran = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (1, "python -m hsv.warm: sources were changed meanwhile; run it again\n")
    assert not list(package.rglob("ahead_of_time.*.so")) and not (tmp_path / "kept").exists()


def copied(folder):
    """Return a copy of the package, of its sources only."""
    return shutil.copytree(
        importlib.resources.files("hsv"), folder / "hsv", ignore=shutil.ignore_patterns("__pycache__", "*.js")
    )


def test_numba_compiles_again_when_a_function_of_another_file_has_changed(tmp_path):
    package = copied(tmp_path)
    decorated = "from hsv.compiled import njit_in_flight\n{}\n\n@njit_in_flight()\ndef {}(x):\n    return {}\n"
    (package / "caller.py").write_text(decorated.format("from hsv.called import called", "caller", "called(x)"))
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    # Python's own byte code is told apart by size and whole second, which a fast machine does not change.
    environment |= {"PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    for factor in (2.0, 3.0, 2.0):
        (package / "called.py").write_text(decorated.format("", "called", f"{factor} * x"))
        time.sleep(0.1)  # what was changed while the process began would not be kept
        ran = subprocess.run(
            [sys.executable, "-c", "from hsv.caller import caller; print(caller(1.0))"],
            env=environment,
            capture_output=True,
            text=True,
        )
        assert ran.stdout == f"{factor}\n", ran.stderr
    kept = [path for path in (package / "__pycache__").glob("numba-*") if list(path.rglob("*.nbc"))]
    assert len(kept) == 2
