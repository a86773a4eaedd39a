"""C controllers in the loop have the same bits as in Python; their errors end only their own process."""

import platform
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from c_libraries import PROBE, build_probe

from hsv.base.errors import ControllerError, ScenarioError
from hsv.base.parameters import Parameter
from hsv.control.controller import ControllerInput
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.repeatability import findings, from_copied_state
from hsv.flight.scenario import load_scenario, scenario_text
from hsv.graph.preparation import prepare
from hsv.plugins.controllers import library_record
from hsv.plugins.library import include_folder, library_digest
from hsv.plugins.library_child import LoadedLibrary
from hsv.plugins.library_process import SharedMemory

SCENARIO = """
title = "Case 1 by a library"
design = "{design}"
controller = "{controller}"
duration = "4 s"
[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"
[[command]]
altitude_change = "60 ft"
[probe]
{settings}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the library and its source."""
    folder = tmp_path_factory.mktemp("probe")
    build_probe(folder)
    shutil.copy(PROBE, folder)
    return folder


def written(folder, settings="", controller="probe.so:probe", design=""):
    """Write a scenario to a folder and return its path."""
    path = folder / "mine.toml"
    path.write_text(SCENARIO.format(settings=settings, controller=controller, design=design))
    return str(path)


@pytest.fixture
def flight(folder):
    """Return a function that assembles the flight of a scenario next to the library."""
    return lambda *settings, **named: assemble_flight(load_scenario(written(folder, *settings, **named)))


class Probe:
    """The Python counterpart of ``probe.c``."""

    PARAMETERS = (Parameter("probe.weight", [0.5, 0.02, 0.5], "of the integral", "1/s"),)

    @classmethod
    def from_parameters(cls, values, design):
        made = cls()
        made.weight = values.get("probe.weight", cls.PARAMETERS[0].default)
        return made

    def reset(self):
        self.integral = 0.0

    def step(self, inputs):
        fuel, elevator = inputs.reference_input
        elevator += self.weight[0] * self.integral
        error = inputs.estimate[3] - inputs.reference[3]
        self.integral += self.weight[1] * (error - self.weight[2] * self.integral)
        return fuel, elevator


@pytest.mark.parametrize(("design", "settings"), [("", ""), ("baseline", 'weight = ["0.6 1/s", "1 1/s", "0 1/s"]')])
def test_c_and_python_fly_the_same_bits(flight, folder, design, settings):
    ours, other = flight(settings, design=design), flight(settings, f"{__name__}:Probe", design)
    one = fly(ours)
    assert one.fingerprint == fly(other).fingerprint == fly(ours).fingerprint
    assert len(one.time) == 201 and one.history.command[:, 1].std() > 0.0
    # This process never loads the library.
    assert str(folder) not in Path("/proc/self/maps").read_text()


def test_a_copy_goes_on_from_the_state_of_the_first(flight):
    assert from_copied_state(flight(), fly(flight())) == ""


def test_what_a_library_keeps_beside_its_state_is_found(tmp_path):
    build_probe(tmp_path, "-DSTATIC")
    found = next(findings(load_scenario(written(tmp_path))))
    assert found.check == "flown twice" and found.difference.startswith("u_unsaturated from step 0 on")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("crash_at = 33", r"probe.so:probe, step 33: crashed \(SIGSEGV\)$"),
        ("exit_at = 200", r"probe.so:probe, step 200: ended its process with exit code 3$"),
        ("hang_at = 7", r"probe.so:probe, step 7: no answer for 1 s$"),
        ("fail_at = 20", r"probe.so:probe, step 20: returned 7, expected 0$"),
        ("silent_at = 20", r"probe.so:probe, step 20: answered \[nan, nan\]"),
    ],
)
def test_what_goes_wrong_is_named_with_its_step_and_the_next_flight_flies(flight, settings, message, monkeypatch):
    monkeypatch.setattr("hsv.plugins.library_process.NO_PROGRESS", 1.0)
    with pytest.raises(ControllerError, match=message):
        fly(flight(settings))
    assert len(fly(flight()).time) == 201


EVERY_DESCRIPTOR = "if (k == 33) for (int i = 3; i < 60; i++) write(i, {words})"


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (
            EVERY_DESCRIPTOR.format(words=r'"\0\0\0\5hello, this is no answer", 30'),
            "wrote to a descriptor that is not its own",
        ),
        (
            EVERY_DESCRIPTOR.format(words=r'"hsv1n\377\0\0\0\0\0\0\0", 13'),
            "wrote (an answer of its own|a part of an answer)",
        ),
        (EVERY_DESCRIPTOR.format(words=r'"hsv1\1\0\0\0\0\0\0\0000", 13'), "wrote an answer of its own"),
        (EVERY_DESCRIPTOR.format(words=r'"hsv1\2\0\0\0\0\0\0\0{}", 14'), "wrote to a descriptor that is not its own"),
        ("state[1] = k", "wrote behind the end of its state, expected at most 1 numbers there"),
        ("out[HSV_INPUTS + 1] = k", "wrote behind the end of its outputs, expected 2 numbers"),
    ],
)
def test_a_library_that_writes_to_what_is_not_its_own_is_named(tmp_path, extra, message, monkeypatch):
    monkeypatch.setattr("hsv.plugins.library_process.NO_PROGRESS", 1.0)
    build_probe(tmp_path, "-w", f"-DEXTRA={extra}")
    with pytest.raises(ControllerError, match=rf"probe.so:probe(, step \d+)?: {message}$"):
        fly(assemble_flight(load_scenario(written(tmp_path))))
    controller, two = assemble_flight(load_scenario(written(tmp_path))).controller, np.array([0.4, 0.2])
    given = ControllerInput(33, np.zeros(9), 0.0, np.zeros(9), two, np.zeros(9), two, two)
    with pytest.raises(ControllerError, match=r"probe.so:probe, step 33: (RunError: )?wrote "):
        for _ in range(3):  # a message that comes after the answer is found at the next request
            controller.step(given)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the register of this processor")
@pytest.mark.parametrize("mode", ["0xff80", "0x7f80"])  # with subnormal numbers flushed to zero, and without
def test_a_library_that_changes_the_arithmetic_flies_the_same_bits(tmp_path, mode):
    folders = {"(void)0": tmp_path / "plain", f"__builtin_ia32_ldmxcsr({mode})": tmp_path / "changing"}
    flights = []
    for extra, folder in folders.items():
        folder.mkdir()
        build_probe(folder, "-w", f"-DEXTRA={extra}")
        flights.append(fly(assemble_flight(load_scenario(written(folder, design="baseline")))))
    assert flights[0].fingerprint == flights[1].fingerprint


def test_what_goes_wrong_stepwise_is_named_with_its_step(flight):
    controller, two = flight("crash_at = 3").controller, np.array([0.4, 0.2])
    given = ControllerInput(3, np.zeros(9), 0.0, np.zeros(9), two, np.zeros(9), two, two)
    with pytest.raises(ControllerError, match=r"probe.so:probe, step 3: crashed \(SIGSEGV\)$"):
        controller.step(given)
    controller.step(given._replace(step=4))


def test_a_library_that_is_built_anew_is_loaded_anew(tmp_path):
    path = written(tmp_path)
    build_probe(tmp_path)
    assert fly(assemble_flight(load_scenario(path))).history.command.std() > 0.0
    build_probe(tmp_path, "-DSTATE_SIZE=2", '-DWEIGHT="weights"')
    with pytest.raises(ScenarioError, match=r"probe.weight: unknown key, expected one of weights, crash"):
        assemble_flight(load_scenario(path, {"probe.weight": [0.1, 0.1, 0.1]}))


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["-DABI=2"], r"^scenario 'mine': controller = '.*/probe.so:probe': abi_version = 2, expected 1"),
        (['-DOUTPUTS={"u","1",2}'], r": outputs\[0\] = u, 2 in '1', expected wanted_input, 2 in '1, rad'$"),
        (['-DINPUTS={"estimate","m",9}'], r": inputs\[0\] = estimate, 9 in 'm', expected estimate, 9 in 'm, m/s,"),
        (["-DINPUTS=HSV_CONTROLLER_INPUTS,HSV_FILTER_STATE_INPUT(4)"], r": inputs\[6\] = filter_state, 4 in 'rad, rad"),
    ],
)
def test_a_library_that_is_no_controller_is_refused(tmp_path, flags, message, monkeypatch):
    build_probe(tmp_path, "-w", *flags)
    # Load the library here, as its own process would; starting a process for each case takes longer.
    library = LoadedLibrary(tmp_path / "probe.so", SharedMemory(-1))
    monkeypatch.setattr("hsv.plugins.library_process._in_this_process", library)
    with pytest.raises(ScenarioError, match=message):
        assemble_flight(load_scenario(written(tmp_path, design="baseline")))


def test_a_library_that_crashes_while_it_is_loaded_is_refused(tmp_path):
    build_probe(tmp_path, "-DCRASHES_ON_LOADING")
    with pytest.raises(ScenarioError, match=r"': crashed \(SIGSEGV\) while it was loaded$"):
        assemble_flight(load_scenario(written(tmp_path)))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("weight = ['1 1/s', '2 1/s']", r"probe.weight: 2 numbers, expected 3"),
        ("weight = ['1 1/s', '2 1/s', '11 1/s']", r"probe.weight\[2\] = '11 1/s': expected from -10 to 10"),
    ],
)
def test_a_wrong_setting_is_named(flight, settings, message):
    with pytest.raises(ScenarioError, match=message):
        flight(settings)


def test_settings_reach_the_library_in_si_units(flight):
    parameters = flight('crash_above = "1000 ft"\nweight = ["0.005 1/ms", "2 1/s", "0 1/s"]').controller.parameters
    assert parameters.tolist() == [5.0, 2.0, 0.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 304.8]


@pytest.mark.parametrize("climbing", ["../probe.so", "sub/../../probe.so", "/usr/lib/probe.so", "link/probe.so"])
def test_a_path_out_of_the_folder_is_refused(tmp_path, climbing):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "link").symlink_to(tmp_path)
    with pytest.raises(ScenarioError, match=r"controller = '.*probe.so:probe': expected a path inside the scenario's"):
        load_scenario(written(tmp_path / "mine", controller=f"{climbing}:probe"))


def test_a_path_is_from_the_folder_of_the_file_that_says_it(folder, tmp_path):
    base, own = written(folder, controller="./probe.so:probe"), tmp_path / "own.toml"
    own.write_text(f'extends = "{base}"\nduration = "1 s"\n')
    assert load_scenario(str(own)).controller == f"{folder}/probe.so:probe"
    assert f'controller = "{folder}/probe.so:probe"' in scenario_text(base)


def test_a_library_without_its_source_is_prepared_for_a_run(tmp_path):
    build_probe(tmp_path)
    files = tmp_path / "files"
    prepare(written(tmp_path), bag=tmp_path / "bag", folder=files)
    assert {file.name for file in files.iterdir()} == {"scenario.toml", "scenario.yaml", "design.yaml", "run.yaml"}
    assert f"controller_sha256={library_digest(f'{tmp_path}/probe.so:probe')}" in (files / "run.yaml").read_text()


def test_the_controller_in_the_header_s_comment_is_built_and_flies(tmp_path):
    comment = (include_folder() / "hsv_block.h").read_text().partition("*/")[0]
    lines = re.findall(r"^ \*     (.*)$|^ \*()$", comment, re.MULTILINE)
    code = [line for line, _ in lines]
    [command] = [line for line in code if line.startswith("cc ")]
    (tmp_path / "trimmed.c").write_text("\n".join(code[: code.index(command)]))
    subprocess.run(command, shell=True, check=True, cwd=tmp_path)
    path = Path(written(tmp_path, "share = 0.5", "trimmed.so:trimmed"))
    path.write_text(path.read_text().replace("[probe]", "[trimmed]"))
    flown = fly(assemble_flight(load_scenario(str(path))))
    assert np.allclose(flown.history.command, flown.reference_input * [1.0, 0.5], rtol=1e-15, atol=0.0)
    assert library_record(load_scenario(str(path)).controller).source_name == "trimmed.c"
