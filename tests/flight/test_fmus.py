"""FMUs: the exported controller and vehicle, alone in FMPy and in the loop; FMUs of other tools."""

import shutil
import subprocess
import zipfile
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from marking import long
from page_blocks import blocks

from hsv.base.errors import ControllerError, HsvError, ParameterError
from hsv.control.design_file import find_design, read_design
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.repeatability import findings, from_copied_state
from hsv.flight.scenario import load_scenario
from hsv.flight.vehicle_export import exported_vehicle
from hsv.plugins.c_export import exported_controller
from hsv.plugins.controllers import class_place, names_code
from hsv.plugins.fmu_export import write_fmu

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
CASE1 = "v1:0669d52ede9cf309349ec3729d9c4c7160e4c8f9d681081827ea43f18398a596"
TRIM = {"phi": 0.25, "delta": 0.2}


@pytest.fixture
def templates():
    """Return the module with FMPy's templates, which FMPy has only in versions that need numpy 2, unlike Jazzy's."""
    return pytest.importorskip("template_fmus")


@pytest.fixture(scope="session")
def exported(tmp_path_factory):
    """Return a folder with the FMUs of the design baseline and the scenario case1."""
    folder = tmp_path_factory.mktemp("exported")
    write_fmu(folder / "controller.fmu", exported_controller(read_design(find_design("baseline"))))
    write_fmu(folder / "vehicle.fmu", exported_vehicle(load_scenario("case1")))
    return folder


@pytest.fixture
def page(exported, monkeypatch):
    """Return the names that the page's co-simulation master defines, run in the folder of the FMUs."""
    monkeypatch.chdir(exported)
    [master] = blocks("docs/fmi.md", "python")
    names = {"__name__": "page"}
    exec(compile(master.text, "two_fmus.py", "exec"), names)
    return SimpleNamespace(**names, master=master.text)


@pytest.fixture
def pair(page):
    """Return the controller and the vehicle."""
    instances = [page.Fmu(f"{name}.fmu") for name in ("controller", "vehicle")]
    yield instances
    for each in instances:
        each.terminate()
        each.freeInstance()


@pytest.mark.long
@pytest.mark.parametrize("name", ["controller", "vehicle"])
def test_fmpy_finds_nothing_wrong(exported, name):
    path = exported / f"{name}.fmu"
    assert validate_fmu(str(path)) == []
    described = {v.name: v for v in read_model_description(str(path)).modelVariables}
    assert described["measurement.altitude"].unit == "m"
    assert all(variable.unit and variable.description for variable in described.values())
    assert described["command.elevator_deflection"].unit == "rad"
    with zipfile.ZipFile(path) as archive:
        assert {f"binaries/x86_64-linux/{name}.so", "sources/fmu.c", "sources/core.h"} <= {*archive.namelist()}
        archive.extractall(exported / name)
    binary = exported / name / "binaries" / "x86_64-linux" / f"{name}.so"
    listed = subprocess.run(["nm", "-D", "--undefined-only", "-P", binary], check=True, capture_output=True, text=True)
    called = {line.split()[0].partition("@")[0] for line in listed.stdout.splitlines() if line.split()[1] == "U"}
    assert called <= {"memcpy", "memset", "strcmp", "__stack_chk_fail"}


@pytest.mark.long
def test_controller_and_vehicle_fly_the_published_case_1(page, capsys):
    exec(compile(page.master, "two_fmus.py", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out == f"{CASE1}\n"


@pytest.mark.long
def test_a_state_is_restored_from_its_bytes(page, pair):
    def rows(steps):
        return [page.fly_period(*pair, k) for k in steps]

    rows(range(20))
    saved = [each.getFMUState() for each in pair]
    texts = [each.serializeFMUState(state) for each, state in zip(pair, saved, strict=True)]
    flown = rows(range(20, 40))
    for each, state, text in zip(pair, saved, texts, strict=True):
        each.freeFMUState(state)
        each.setFMUState(each.deserializeFMUState(text))
    assert rows(range(20, 40)) == flown
    with pytest.raises(Exception, match="fmi3DoStep"):
        pair[0].doStep(0.8, 0.013)


@contextmanager
def refused(match, error=HsvError):
    """Expect an error whose message is one line."""
    with pytest.raises(error, match=match) as caught:
        yield
    assert "\n" not in str(caught.value)


def flight(folder, table="", changes=None):
    """Return the components of a Case 1 flight of 2 s with the controller model.fmu."""
    (folder / "fmu.toml").write_text(f'extends = "case1"\ncontroller = "model.fmu"\nduration = "2 s"\n[fmu]\n{table}')
    return assemble_flight(load_scenario(str(folder / "fmu.toml"), {"fault": [], **(changes or {})}))


OUTPUTS = """
wanted_input.fuel_equivalence_ratio = "phi"
wanted_input.elevator_deflection = "delta"
"""
UNITS = '<UnitDefinitions><Unit name="ft"/><Unit name="m"/><Unit name="rad/s"/></UnitDefinitions>'
MAPPED = f'{OUTPUTS}measurement.altitude = "h"\n'


def test_an_fmu_of_fmpys_own_template_flies_as_controller_as_the_page_says(tmp_path, templates):
    templates.template_fmu(tmp_path / "pid.fmu", ["h", "V"], TRIM)
    assert validate_fmu(str(tmp_path / "pid.fmu")) == []
    mapped, _ = blocks("docs/fmi.md", "toml")
    (tmp_path / mapped.file).write_text(mapped.text)
    changes = {"duration": "2 s", "fault": []}
    flown = fly(assemble_flight(load_scenario(str(tmp_path / mapped.file), changes)))
    assert flown.history.command.tolist() == [[*TRIM.values()]] * 101
    assert names_code("pid.fmu") and class_place("pid.fmu") == "pid.fmu"
    (tmp_path / "model.fmu").write_text("no archive")
    with refused("model.fmu'.*cannot be loaded"):
        flight(tmp_path)


@pytest.mark.long
def test_a_container_of_fmi_2_that_fmpy_makes_flies_as_controller(tmp_path, templates):
    templates.template_fmu(tmp_path / "inner.fmu", ["h"], TRIM)
    templates.container_fmu(tmp_path / "model.fmu", tmp_path / "inner.fmu")
    assert fly(flight(tmp_path, MAPPED)).history.command.tolist() == [[*TRIM.values()]] * 101


@pytest.mark.long
def test_the_exported_controller_flies_the_published_case_1_in_the_loop(exported, tmp_path):
    (tmp_path / "own.toml").write_text(
        'extends = "case1"\ncontroller = "controller.fmu"\nfmu.unconnected = ["defect.*"]'
    )
    shutil.copy(exported / "controller.fmu", tmp_path)
    assert fly(assemble_flight(load_scenario(str(tmp_path / "own.toml")))).fingerprint == CASE1


@pytest.mark.parametrize(
    ("table", "description", "match"),
    [
        (OUTPUTS, str, "input 'h': not a signal of the bench"),
        ('measurement.altitude = "h"', str, "fmu.wanted_input.fuel_.*: no such output, expected one of phi, delta"),
        long(MAPPED + 'reference.altitude = "r"', str, "reference.altitude = 'r': no such input, expected one of h"),
        long(MAPPED + 'reference.altitude = "h"', str, "a name stands twice"),
        long(MAPPED + 'measurement.high = "h"', str, "measurement.high: unknown key"),
        (MAPPED, lambda text: text.replace('name="h"', 'name="h" unit="ft"'), "input 'h' in 'ft', expected 'm'"),
        long(MAPPED, lambda text: text.replace('name="delta"', 'name="delta" unit="rad/s"'), "'rad/s', expected 'rad'"),
        (MAPPED, lambda text: text.replace("CoSimulation", "ModelExchange"), "expected an FMU for co-simulation"),
        long(MAPPED, lambda text: text.replace('"template"', '"another"'), "cannot be loaded .*expected an FMU"),
        long(MAPPED, lambda text: text[:200], "cannot be loaded .*expected an FMU"),
    ],
)
def test_a_wrong_fmu_is_one_line(tmp_path, table, description, match, templates):
    templates.template_fmu(
        tmp_path / "model.fmu",
        ["h"],
        TRIM,
        lambda text: description(text.replace("  <ModelVariables>", f"{UNITS}<ModelVariables>")),
        lambda text: text.replace(
            "Model* instance = ", "if (strcmp(instantiationToken, INSTANTIATION_TOKEN)) return 0; Model* instance = "
        ),
    )
    with refused(match):
        flight(tmp_path, table)


@pytest.mark.parametrize(
    ("statement", "match"),
    [
        ("if (currentCommunicationPoint > 0.39) *(volatile int *)0 = 1;", r"model.fmu, step 20: crashed \(SIGSEGV\)"),
        ("if (currentCommunicationPoint > 0.39) return fmi3Error;", r"model.fmu, step 20: .*fmi3DoStep"),
        (
            'if (currentCommunicationPoint > 0.39) { ((Model *)instance)->logMessage(NULL, fmi3Error, "", "no fuel"); '
            "return fmi3Error; }",
            r"model.fmu, step 20: .*fmi3DoStep.*: no fuel$",
        ),
    ],
)
def test_a_failure_inside_the_fmu_ends_the_flight_in_one_line(tmp_path, statement, match, templates):
    templates.template_fmu(
        tmp_path / "model.fmu",
        ["h"],
        TRIM,
        model=lambda text: text.replace("    UNUSED(lastSuccessfulTime);", statement),
    )
    with refused(match, ControllerError):
        fly(flight(tmp_path, MAPPED))


CONTROLLER = 'unconnected = ["defect.*"]'


def test_an_fmu_that_declares_it_is_copied_by_its_state(exported, tmp_path):
    shutil.copy(exported / "controller.fmu", tmp_path / "model.fmu")
    flown = fly(flight(tmp_path, CONTROLLER))
    assert from_copied_state(flight(tmp_path, CONTROLLER), flown) == ""


def test_other_fmus_are_not_checked_from_a_copied_state(tmp_path, templates):
    templates.template_fmu(tmp_path / "model.fmu", ["h"], TRIM)
    flight(tmp_path, MAPPED)
    found = {each.check: each for each in findings(load_scenario(str(tmp_path / "fmu.toml"), {"fault": []}))}
    copied = found.pop("from a copied state")
    assert (copied.flights, copied.not_checked) == (0, "this FMU cannot be copied")
    assert not any(each.difference or each.not_checked for each in found.values())


def test_a_missing_fmu_is_called_an_fmu(tmp_path):
    with refused(r"model.fmu'.*No such file or directory\), expected an FMU"):
        flight(tmp_path)


def test_without_a_compiler_the_export_is_refused_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with refused("there is no C compiler cc", ParameterError):
        write_fmu(tmp_path / "vehicle.fmu", exported_vehicle(load_scenario("case1")))
