"""Controllers in shared libraries."""

import ctypes
import dataclasses
import hashlib
import shutil
import subprocess
import textwrap

import pytest
from c_libraries import PROBE, WARNINGS, build_probe

from hsv.base.errors import ParameterError
from hsv.control.controller import CONTROLLER_INPUTS, CONTROLLER_OUTPUTS
from hsv.model.signals import FILTER_STATE
from hsv.plugins.controllers import library_record
from hsv.plugins.library import include_folder, library_digest, load_block


def test_a_flight_keeps_digest_and_source_of_its_library(tmp_path):
    library = build_probe(tmp_path)
    controller = f"{library}:probe"
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    assert library_digest(controller) == digest
    without = library_record(controller)
    assert (without.sha256, without.source_name, without.source) == (digest, "", b"")
    shutil.copy(PROBE, tmp_path)
    record = library_record(controller)
    assert (record.sha256, record.source_name, record.source) == (digest, "probe.c", PROBE.read_bytes())


def test_the_layout_of_the_header_is_that_of_the_bench(tmp_path):
    library = build_probe(tmp_path, "-DINPUTS=HSV_CONTROLLER_INPUTS,HSV_FILTER_STATE_INPUT(4)")
    block = load_block(library, "probe")
    assert block.inputs == (*CONTROLLER_INPUTS[:-1], dataclasses.replace(FILTER_STATE, size=4))
    assert block.outputs == CONTROLLER_OUTPUTS
    ends = [0]
    for signal in CONTROLLER_INPUTS[:-1]:
        ends.append(ends[-1] + signal.size)
    assert list((ctypes.c_int64 * len(ends)).in_dll(ctypes.CDLL(str(library)), "offsets")) == ends


def test_parameters_are_described_as_those_of_python(tmp_path):
    block = load_block(build_probe(tmp_path), "probe")
    assert (block.name, block.source, block.state_size) == ("probe", "probe.c", 1)
    weight, crash_at, *_, above = block.parameters
    assert (weight.name, weight.default, weight.unit) == ("probe.weight", [0.5, 0.02, 0.5], "1/s")
    assert (weight.minimum, weight.maximum) == (-10.0, 10.0)
    assert (crash_at.name, crash_at.default, crash_at.unit) == ("probe.crash_at", -1.0, "")
    assert (above.unit, above.description) == ("m", "altitude")
    above.check(-1e300)


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["-DABI=7"], r"^abi_version = 7, expected 1, as of hsv_block.h"),
        (['-DNAME="\\xff"'], r"^name = b'\\xff', expected text in UTF-8"),
        (["-DSTATE_SIZE=-1"], r"^state_size = -1, expected 0 to"),
        (["-DINPUT_COUNT=1LL<<40"], r"^input_count = 1099511627776, expected 0 to"),
        (['-DINPUTS={"x","m",-1}'], r"^inputs\[0\].size = -1, expected 0 to"),
        (['-DWEIGHT_UNIT="furlongz"'], r"^parameters\[0\].unit = 'furlongz', expected an SI unit"),
        (['-DWEIGHT="crash_at"'], r"^parameters probe.crash_at, probe.crash_at, .*expected names that differ"),
    ],
)
def test_a_wrong_description_is_named(tmp_path, flags, message):
    library = build_probe(tmp_path, "-Wno-error", "-w", *flags)
    with pytest.raises(ParameterError, match=message):
        load_block(library, "probe")


def test_what_is_no_library_or_has_no_such_symbol_is_named(tmp_path):
    (tmp_path / "text.so").write_text("no library")
    with pytest.raises(ParameterError, match=r"^cannot be loaded \(.*\), expected a shared library"):
        load_block(tmp_path / "text.so", "probe")
    with pytest.raises(ParameterError, match=r"^no symbol 'prob', expected a constant of the type hsv_block"):
        load_block(build_probe(tmp_path), "prob")


COMPILERS = [("cc", "-std=c99", "c"), ("c++", "-std=c++17", "cpp"), ("c++", "-std=c++20", "cpp")]
COMPILERS += [("clang", "-std=c99", "c"), ("clang++", "-std=c++20", "cpp")]


def compile_block(folder, compiler, standard, suffix, text):
    """Compile a block with every warning as an error, and return the library."""
    source, library = folder / f"trimmed.{suffix}", folder / "trimmed.so"
    source.write_text(text)
    words = [compiler, standard, *WARNINGS, "-ffp-contract=off", f"-I{include_folder()}", "-shared", "-fPIC"]
    subprocess.run([*words, "-o", library, source], check=True)
    return library


@pytest.mark.parametrize(("compiler", "standard", "suffix"), COMPILERS)
def test_the_example_of_the_header_is_c_and_c_plus_plus_without_a_warning(tmp_path, compiler, standard, suffix):
    if not shutil.which(compiler):
        pytest.skip(f"no {compiler}")
    comment = (include_folder() / "hsv_block.h").read_text().partition("*/")[0]
    example = textwrap.dedent(comment[comment.index("*     #include") :].replace("\n *", "\n").removeprefix("*"))
    library = compile_block(tmp_path, compiler, standard, suffix, example.partition("\n    cc")[0])
    block = load_block(library, "trimmed")
    assert (block.name, block.inputs) == ("trimmed", CONTROLLER_INPUTS[:-1])
    assert [(parameter.name, parameter.default) for parameter in block.parameters] == [("trimmed.share", 1.0)]


def test_a_symbol_that_c_plus_plus_has_mangled_is_named(tmp_path):
    text = '#include "hsv_block.h"\nnamespace mine { extern const hsv_block trimmed; const hsv_block trimmed{}; }\n'
    library = compile_block(tmp_path, "c++", "-std=c++17", "cpp", text)
    with pytest.raises(
        ParameterError, match=r"no symbol 'trimmed', but _ZN4mine7trimmedE as C\+\+ names it: HSV_BLOCK"
    ):
        load_block(library, "trimmed")
