"""Controllers in shared libraries: where a scenario says they are, and what a recorded flight keeps of them."""

import hashlib
import shutil

import pytest
from c_libraries import PROBE, build_probe

from hsv.base.errors import ParameterError
from hsv.control.library import inside, library_digest, library_record, seen_from


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


def test_a_scenario_names_libraries_of_its_own_folder(tmp_path):
    assert inside("build/own.so:lqr", tmp_path) == f"{tmp_path}/build/own.so:lqr"
    assert seen_from(f"{tmp_path}/build/own.so:lqr", tmp_path) == "./build/own.so:lqr"
    assert seen_from("/elsewhere/own.so:lqr", tmp_path) == "/elsewhere/own.so:lqr"
    assert inside("tube_mpc", tmp_path) == seen_from("tube_mpc", tmp_path) == "tube_mpc"
    with pytest.raises(ParameterError, match="expected a path inside the scenario's folder"):
        inside("../own.so:lqr", tmp_path)


def test_a_controller_of_the_bench_is_in_no_library():
    assert library_digest("tube_mpc") == ""
    assert library_record("tube_mpc") is None


def test_what_is_no_library_is_refused(tmp_path):
    (tmp_path / "text.so").write_text("no library")
    with pytest.raises(ParameterError, match=r"controller = '.*text.so:probe': .*expected a shared library"):
        library_record(f"{tmp_path / 'text.so'}:probe")
    with pytest.raises(ParameterError, match=r"controller = '.*nowhere.so:probe': "):
        library_digest(f"{tmp_path / 'nowhere.so'}:probe")
