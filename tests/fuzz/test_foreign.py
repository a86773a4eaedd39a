"""Code of others and calls of an agent: mutated libraries and FMUs, and actions and seeds of any kind."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_libraries import build_probe
from fuzzing import Fuzz
from hypothesis import strategies as st
from mutations import Mutated, mutated

from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.gym import TrackEnv, TrackVectorEnv
from hsv.plugins.library_process import library_user

_NAMES = """[fmu]
wanted_input.fuel_equivalence_ratio = "phi"
wanted_input.elevator_deflection = "delta"
measurement.altitude = "h"
"""
_PROCESSES = 300
"""Largest number of inputs of a test that starts a process for each"""

SCENARIO = """extends = "case1"
controller = "{controller}"
design = ""
duration = "0.4 s"
fault = []
[limits]
{more}
"""


def _flown(folder: Path, controller: str, more: str = "") -> None:
    path = folder / "mine.toml"
    path.write_text(SCENARIO.format(controller=controller, more=more))
    try:
        fly(assemble_flight(load_scenario(str(path))))
    finally:
        library_user(folder / controller.partition(":")[0]).end()


def test_a_library(fuzz: Fuzz, tmp_path: Path) -> None:
    library = build_probe(tmp_path)
    shutil.move(library, tmp_path / "whole.so")

    def read(given: Mutated) -> None:
        library.write_bytes(given.data)
        _flown(tmp_path, "probe.so:probe")

    fuzz(mutated((tmp_path / "whole.so").read_bytes()), read, _PROCESSES)


@pytest.mark.parametrize("part", ["modelDescription.xml", "binaries/x86_64-linux/model.so", ""])
def test_an_fmu(fuzz: Fuzz, part: str, tmp_path: Path) -> None:
    whole, path = tmp_path / "whole.fmu", tmp_path / "mine.fmu"
    pytest.importorskip("template_fmus").template_fmu(whole, ["h"], {"phi": 0.3, "delta": 0.2})
    with zipfile.ZipFile(whole) as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}

    def read(given: Mutated) -> None:
        if part:
            with zipfile.ZipFile(path, "w") as archive:
                for name, content in (contents | {part: given.data}).items():
                    archive.writestr(name, content)
        else:
            path.write_bytes(given.data)
        _flown(tmp_path, "mine.fmu", _NAMES)

    fuzz(mutated(contents[part] if part else whole.read_bytes()), read, _PROCESSES)


_VALUES = st.one_of(
    st.floats(-1.0, 1.0),
    st.floats(),
    st.integers(),
    st.none(),
    st.text(max_size=5),
    st.complex_numbers(),
    st.booleans(),
)
_ACTIONS = st.one_of(_VALUES, st.lists(_VALUES, max_size=3), st.lists(st.lists(_VALUES, max_size=3), max_size=3))
_SEEDS = st.one_of(st.none(), st.integers(-3, 10), st.lists(st.integers(0, 10), max_size=3))


def test_an_environment(fuzz: Fuzz) -> None:
    single, vector = TrackEnv(scale=1.0), TrackVectorEnv(2, scale=1.0)
    single.reset(seed=1)
    vector.reset(seed=1)

    def step(given: Any) -> None:
        seed, action = given
        env = vector if isinstance(seed, list) else single
        if seed is not None:
            env.reset(seed=seed)
        observation = env.step(action)[0]
        assert np.shape(observation) == env.observation_space.shape and np.isfinite(observation).all()

    fuzz(st.tuples(_SEEDS, _ACTIONS), step)
