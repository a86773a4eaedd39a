import ctypes
import dataclasses
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pint
import pytest
from flights import components
from marking import long
from numpy.testing import assert_array_equal

import hsv.core
from hsv.base.units import base_units
from hsv.control.design_file import find_design, read_design
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.plugins.c_export import NUMBERS, SOURCE, controller_files, design_header, step_bounds
from hsv.plugins.library import load_block

ROOT = Path(__file__).parents[2]
DESIGNS = {name: read_design(find_design(name)) for name in ("baseline", "adjustable", "smooth")}
BLOCKS = ("notch_filter", "nominal_trajectory", "tube_law", "controller")
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
BASELINE, *OTHERS = DESIGNS.values()
each_design = pytest.mark.parametrize("design", [BASELINE, *map(long, OTHERS)], ids=DESIGNS)
each_compiler = pytest.mark.parametrize(
    "compiler",
    [pytest.param(c, marks=pytest.mark.skipif(not shutil.which(c), reason=f"no {c}")) for c in ("gcc", "clang")],
)


def write_source(design, folder):
    """Write the exported files into ``folder``; return the path of the C source."""
    for name, text in controller_files(design).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / SOURCE


def compile_library(design, folder, compiler="cc"):
    """Compile the exported ``design`` in ``folder`` and return the shared library."""
    source, library = write_source(design, folder), folder / "controller.so"
    subprocess.run([compiler, *FLAGS, "-O3", "-shared", "-fPIC", "-o", library, source], check=True)
    return library


@pytest.fixture(scope="module", params=[BASELINE, OTHERS[0], long(OTHERS[1])], ids=DESIGNS)
def built(request, tmp_path_factory):
    return request.param, compile_library(request.param, tmp_path_factory.mktemp("library"))


@each_design
@pytest.mark.parametrize("level", ["-O2", long("-O0"), long("-O3")])
@each_compiler
def test_it_is_c99_that_calls_nothing_and_keeps_nothing(design, level, compiler, tmp_path):
    code = tmp_path / "controller.o"
    stack = ("-Wstack-usage=4096",) if compiler == "gcc" and level != "-O0" else ()
    # By default Ubuntu's compiler adds calls of the stack protector.
    plain = ("-fno-pie", "-fno-stack-protector")
    command = [compiler, *FLAGS, *stack, level, *plain, "-c", "-o", str(code), str(write_source(design, tmp_path))]
    subprocess.run(command, check=True)
    listed = subprocess.run(["nm", "-P", str(code)], check=True, capture_output=True, text=True).stdout
    symbols = [tuple(line.split()[:2]) for line in listed.splitlines()]
    # No heap and no libm. Compilers may generate calls of these two for any code, even without a C library.
    assert {name for name, kind in symbols if kind == "U"} <= {"memcpy", "memset"}
    # Only functions and constants: nothing but the state is kept from step to step.
    assert {kind for _, kind in symbols} <= {"T", "t", "R", "r", "U"}
    assert {name for name, kind in symbols if kind in "TR"} == {*BLOCKS}


def test_units_of_an_fmu_are_their_exponents_in_base_units():
    registry = pint.UnitRegistry()
    for unit in ("1", "m", "s", "1/s", "m/s", "rad", "rad/s", "rad s", "N", "N m", "Pa"):
        powers = base_units(unit)
        base = math.prod((registry.Unit(name) ** power for name, power in powers.items()), start=registry.Unit(""))
        assert registry.get_base_units("" if unit == "1" else unit.replace(" ", "*")) == (1.0, base), unit


@needs_compiler
def test_the_blocks_describe_themselves(built):
    design, library = built
    blocks = {name: load_block(library, name) for name in BLOCKS}
    states = 2 * len(design.notch)
    sizes = {name: [s.size for s in (*block.inputs, *block.outputs)] for name, block in blocks.items()}
    assert sizes == {
        "notch_filter": [1, 1, states],
        "nominal_trajectory": [9, 9, 9, 9, 2, 1, 1],
        "tube_law": [9, 1, 9, 2, 9, 2, *([states] if design.filtered else []), 2],
        "controller": [9, 9, 9, 2, 2, 2, 1, states, 9, 2, 1, 1],
    }
    kept = {name: bound.state_size for name, bound in step_bounds(design).items()}
    assert {name: block.state_size for name, block in blocks.items()} == kept | {"controller": sum(kept.values())}
    tau, rate = blocks["tube_law"].parameters
    assert_array_equal(tau.default, design.tau)
    assert (tau.minimum, tau.maximum) == (design.tau_minimum.min(), 1.0)
    assert (rate.default, rate.unit) == (0.0, "1/s")


def test_its_headers_are_those_that_the_core_is_built_from():
    written = controller_files(DESIGNS["baseline"])
    core = Path(hsv.core.__file__).parent
    for name in {*written} - {"controller.c", NUMBERS, "hsv_block.h"}:
        assert written[name] == (core / name).read_text(encoding="utf-8")
    included = set(re.findall(r'^#include "(.*)"$', "".join(written.values()), re.MULTILINE))
    assert {*written} == included | {"controller.c"}


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
@each_design
def test_no_step_takes_more_than_is_stated(design, tmp_path):
    source = write_source(design, tmp_path).with_name(NUMBERS)
    program = ROOT / "tests" / "support" / "counted_steps.cpp"
    counter = tmp_path / "counted_steps"
    subprocess.run(["g++", "-std=c++20", "-w", f"-I{tmp_path}", "-o", str(counter), str(program)], check=True)
    counted = subprocess.run([str(counter)], check=True, capture_output=True, text=True).stdout
    rows = {name: tuple(map(int, numbers)) for name, *numbers in map(str.split, counted.splitlines())}
    bounds = step_bounds(design)
    assert rows == {name: dataclasses.astuple(bound)[:3] for name, bound in bounds.items()}
    stated = re.findall(r"^ \*   (\w+) +(\d+) +(\d+) +(\d+) +(\d+)$", source.read_text(encoding="utf-8"), re.MULTILINE)
    assert {name: tuple(map(int, row)) for name, *row in stated} == {
        name: dataclasses.astuple(bound) for name, bound in bounds.items()
    }


def test_a_name_does_not_end_the_comment_that_it_stands_in():
    text = design_header(dataclasses.replace(DESIGNS["baseline"], name="a */ int b;\n/*", coupling='"*/'))
    assert text.splitlines()[0].endswith('of the design "a __ int b____".')
    assert "*/ int" not in text
    assert '"___"' in text


@needs_compiler
def test_the_period_on_the_page_commands_what_the_loop_commands(tmp_path):
    page = ROOT / "docs" / "export.md"
    [period] = re.findall(r"^```c\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    (tmp_path / "period.c").write_text(period, encoding="utf-8")
    sources = [str(write_source(DESIGNS["baseline"], tmp_path)), str(tmp_path / "period.c")]
    subprocess.run(["cc", *FLAGS, "-shared", "-fPIC", "-o", str(tmp_path / "period.so"), *sources], check=True)
    control = ctypes.CDLL(str(tmp_path / "period.so")).control
    flight = fly(components("case1"))
    wanted = np.empty_like(flight.history.u_unsaturated)
    columns = (flight.history.state, flight.reference, flight.reference_input, flight.defect, wanted)
    for k in range(len(wanted)):
        control(ctypes.c_int64(k), *(ctypes.c_void_p(column[k : k + 1].ctypes.data) for column in columns))
    assert_array_equal(wanted, flight.history.u_unsaturated)


@each_compiler
@pytest.mark.parametrize("scenario", ["case1", long("case2")])
def test_a_scenario_flies_the_law_as_any_controller_in_c(scenario, compiler, tmp_path):
    compile_library(DESIGNS[load_scenario(scenario).design], tmp_path, compiler)
    own = tmp_path / "own.toml"
    own.write_text(f'extends = "{scenario}"\ncontroller = "controller.so:tube_law"\n', encoding="utf-8")
    assert fly(assemble_flight(load_scenario(str(own)))).fingerprint == fly(components(scenario)).fingerprint
