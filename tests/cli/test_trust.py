"""Bags and campaigns are data: no code that they name runs and no path leaves the folder, unless they are trusted."""

import json
import re
import shutil
import sys
from contextlib import nullcontext
from pathlib import Path

import pytest
import yaml
from changed_bags import changed_bag
from marking import long
from pyarrow import parquet
from recorded_flight import record_flight
from typer.main import get_command

import hsv as hsv_package
from hsv.base.errors import GovernorError
from hsv.cli.entry import COMMANDS
from hsv.cli.main import application
from hsv.control.design_file import find_design
from hsv.flight.campaign.sample_runner import CAMPAIGN, DIGEST
from hsv.flight.campaign.store import result_digest
from hsv.flight.governed import governed
from hsv.flight.vehicle_export import exported_vehicle
from hsv.gym import TrackEnv, TrackVectorEnv
from hsv.model.vehicle import vehicle_text
from hsv.plugins import library_process

MODULE = """
from pathlib import Path
Path(__file__).with_name("loaded").touch()

class Own:
    PARAMETERS = ()
    @classmethod
    def from_parameters(cls, values, design):
        return cls()
    def reset(self):
        pass
    def step(self, inputs):
        return inputs.reference_input
"""


@pytest.fixture
def loaded(tmp_path, monkeypatch):
    """Write a module with a controller; return a function that tells whether it was imported since the last call."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "marked.py").write_text(MODULE)
    monkeypatch.syspath_prepend(folder)

    def since_last_asked():
        sys.modules.pop("marked", None)
        found = (folder / "loaded").exists()
        (folder / "loaded").unlink(missing_ok=True)
        return found

    yield since_last_asked
    since_last_asked()


@pytest.fixture
def campaign(hsv, loaded, tmp_path):
    """Fly a campaign whose scenario names its controller's code, as a user's own scenario may."""
    text = 'extends = "case1"\ncontroller = "marked:Own"\ndesign = ""\nduration = "1 s"\nfault = []\n[limits]\n'
    (tmp_path / "own.toml").write_text(text)
    words = ("--samples", "4", "--workers", "1", "--out", "own.parquet", "--no-page")
    assert hsv("montecarlo", "own.toml", *words).code == 0
    assert loaded()
    return "own.parquet"


def test_a_campaign_is_summed_up_without_the_code_that_it_names(hsv, campaign, loaded, tmp_path):
    shown = hsv("montecarlo", "summary", campaign)
    assert shown.code == 0 and "4 of 4" in shown.out
    assert "marked:Own, which runs only with --trust" in (tmp_path / "own.html").read_text()
    assert len(hsv_package.read_campaign(tmp_path / campaign)) == 4
    assert not loaded()
    assert hsv("montecarlo", "summary", campaign, "--trust").code == 0
    assert "Solid: the scenario unchanged" in (tmp_path / "own.html").read_text()
    assert loaded()


@pytest.mark.parametrize("how", [(), ("--over-dds",)])
def test_a_flight_of_a_campaign_is_repeated_only_if_its_code_is_trusted(hsv, campaign, loaded, how):
    refused = hsv("montecarlo", "replay", campaign, "--flight", "1", *how)
    assert refused.code == 2
    assert refused.error == "own.parquet: controller = 'marked:Own': code that this file names, run only with --trust"
    assert not loaded()


def test_a_trusted_campaign_is_repeated_in_every_bit(hsv, campaign, loaded):
    assert hsv("montecarlo", "replay", campaign, "--flight", "1", "--trust", "--json").json["identical"]
    assert loaded()


@pytest.mark.parametrize("path", ["sub/../../design.yaml", long("/etc/design.yaml"), long("../design.yaml")])
def test_no_path_of_a_campaign_leads_out_of_the_folder(hsv, tmp_path, path):
    (tmp_path / "own.toml").write_text('extends = "case1"\nduration = "1 s"\nfault = []\n[limits]\n')
    words = ("--samples", "4", "--workers", "1", "--out", "own.parquet", "--no-page")
    assert hsv("montecarlo", "own.toml", *words).code == 0
    table = parquet.read_table("own.parquet")
    metadata = dict(parquet.read_metadata("own.parquet").metadata)
    kept = json.loads(metadata[CAMPAIGN])
    kept["scenario_text"] = f'design = "{path}"\n' + kept["scenario_text"].replace('design = "baseline"\n', "")
    metadata[CAMPAIGN] = json.dumps(kept).encode()
    del metadata[DIGEST], metadata[b"ARROW:schema"]
    parquet.write_table(table.replace_schema_metadata(metadata), "own.parquet")
    assert hsv("montecarlo", "summary", "own.parquet", "--no-page").error.startswith(
        "own.parquet: damaged, its digest is missing or wrong"
    )
    metadata[DIGEST] = result_digest(metadata)
    parquet.write_table(table.replace_schema_metadata(metadata), "own.parquet")
    # The result contains the design, so a flight in process needs no file.
    assert hsv("montecarlo", "replay", "own.parquet", "--flight", "1").code == 0
    refused = hsv("montecarlo", "replay", "own.parquet", "--flight", "1", "--over-dds")
    assert refused.code == 2
    assert refused.error.startswith(f"own.parquet: design = {path!r}: a path out of the folder")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("flown") / "bag", duration=12.0, fault=11.0)


@pytest.fixture
def crafted(flown, tmp_path):
    """Return a function that copies a bag whose attachments name a controller's code in one section of the nodes."""

    def make(section):
        parameters = yaml.safe_load(flown.text("scenario.yaml"))
        own = parameters.setdefault(section, {"ros__parameters": {}})
        own["ros__parameters"]["controller"] = "marked:Own"
        scenario = 'controller = "marked:Own"\n' + flown.text("scenario.toml")
        files = {"scenario.yaml": yaml.safe_dump(parameters).encode(), "scenario.toml": scenario.encode()}
        return str(changed_bag(flown.path, tmp_path / "crafted", attachments=files))

    return make


def test_no_reader_of_bags_loads_what_a_bag_names(hsv, loaded, crafted, tmp_path):
    bag = crafted("/**")
    assert hsv("info", bag, "--json").code == 0
    assert hsv("report", bag, "--out", "report.html").code == 0
    assert "marked:Own" in (tmp_path / "report.html").read_text()
    assert hsv("conclude", bag, "--no-report").code == 0
    for words in ((), ("--rerun",), ("--node", "controller"), ("--over-dds",), ("--over-dds", "--rerun")):
        refused = hsv("replay", bag, *words)
        assert refused.code == 2
        assert refused.error == f"{bag}: controller = 'marked:Own': code that this file names, run only with --trust"
    assert hsv("replay", bag, "--node", "notch_filter").code == 0
    assert not loaded()
    assert hsv("replay", bag, "--node", "controller", "--trust").code == 1  # it is not the tube law
    assert loaded()


def test_no_vehicle_of_a_bag_is_read_from_another_file(hsv, flown, tmp_path):
    (tmp_path / "secret.toml").write_text("secret = 1\n")
    named = f'[vehicle]\nname = "{tmp_path / "secret.toml"}"\n'
    scenario = flown.text("scenario.toml").replace("[vehicle]\n", named)
    assert named in scenario
    bag = str(changed_bag(flown.path, tmp_path / "bag", attachments={"scenario.toml": scenario.encode()}))
    refused = hsv("conclude", bag, "--no-report")
    assert refused.code == 2 and "secret.toml': expected a registered name, or a definition" in refused.error


def test_parameters_of_a_bag_bring_no_vehicle_from_another_file(hsv, flown, tmp_path):
    (tmp_path / "other.toml").write_text(vehicle_text("parker"))
    parameters = yaml.safe_load(flown.text("scenario.yaml"))
    everybodys = parameters["/**"]["ros__parameters"]
    everybodys["vehicle.name"] = str(tmp_path / "other.toml")
    files = {"scenario.yaml": yaml.safe_dump(parameters).encode()}
    whole = str(changed_bag(flown.path, tmp_path / "whole", attachments=files))
    assert hsv("replay", whole, "--node", "plant").code == 0
    del everybodys["vehicle.mass"]
    files = {"scenario.yaml": yaml.safe_dump(parameters).encode()}
    lacking = str(changed_bag(flown.path, tmp_path / "lacking", attachments=files))
    refused = hsv("replay", lacking, "--node", "plant")
    assert refused.code == 2 and refused.error.startswith("vehicle 'other': expected one of ")


SCENARIO = 'extends = "case1"\ncontroller = "marked:Own"\ndesign = ""\nduration = "1 s"\nfault = []\n[limits]\n'

# Words for every command that reads files. Their scenario, bag and campaign name the code of a controller.
READERS = {
    "report": "{bag} --out report.html",
    "plot": "{bag} --out plot.png",
    "info": "{bag}",
    "replay": "{bag} --scenario own.toml",
    "diff": "{bag} {bag}",
    "export": "{bag} --csv --out tables",
    "recover": "{bag} --out recovered",
    "conclude": "{bag} --no-report",
    "verify": "own.toml --quick",
    "certify": "{design} --scenario own.toml",
    "govern": "own.toml --out governed.toml",
    "export-vehicle": "own.toml --fmu vehicle.fmu",
    "export-controller": "own.toml --out exported",
    "design": "own.toml --out own.yaml",
    "trim": "--vehicle own.toml",
    "linearise": "--vehicle own.toml --out model.mat",
    "list": "scenarios own.toml; bags .",
    "margins": "own.toml",
    "compare": "{campaign} {other}",
    "bench": "--only own.toml",
    "montecarlo summary": "{campaign}",
    "montecarlo replay": "{campaign} --flight 1",
    "montecarlo scenario": "{campaign} --flight 1",
}
FLYING = {
    "run": "own.toml",
    "simulate": "own.toml",
    "resilience": "--controllers own.toml",
    "check": "own.toml",
    "prepare": "own.toml",
    "montecarlo fly": "own.toml",
    "worst": "own.toml",
    "rare": "own.toml",
}
IN_THE_GRAPH = ("set", "command", "watch", "topic", "fault inject", "fault clear", "fault list")
OTHERS = ("include", "play")  # one prints a folder, the other publishes the messages of a bag


def leaves(command, name=()):
    if not hasattr(command, "commands"):
        return [" ".join(name)]
    return [leaf for key, sub in command.commands.items() for leaf in leaves(sub, (*name, key))]


def test_every_command_is_one_that_flies_or_one_that_runs_no_code_of_files():
    commands = leaves(get_command(application(COMMANDS)))
    assert sorted([*READERS, *FLYING, *IN_THE_GRAPH, *OTHERS]) == sorted(commands)


def test_no_command_but_those_that_fly_runs_the_code_that_a_file_names(hsv, campaign, loaded, crafted, tmp_path):
    (tmp_path / "own.toml").write_text(SCENARIO)
    places = {"bag": crafted("/**"), "campaign": campaign, "design": find_design("baseline")}
    places["other"] = shutil.copy(campaign, tmp_path / "other.parquet")
    for command, words in READERS.items():
        for call in words.format(**places).split("; "):
            assert hsv(*command.split(), *call.split()).code in (0, 1, 2), command
        assert not loaded(), command
    assert (tmp_path / "vehicle.fmu").is_file() and (tmp_path / "report.html").is_file()


def test_a_command_that_flies_loads_the_controller(hsv, loaded, tmp_path):
    (tmp_path / "own.toml").write_text(SCENARIO)
    assert hsv("simulate", "own.toml").code == 0
    assert loaded()


@pytest.mark.parametrize("place", ["marked:Own", "marked.so:own", "marked.fmu"])
def test_no_python_entry_point_but_those_that_fly_loads_the_controller(loaded, tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    opened = []
    monkeypatch.setattr(library_process.LibraryProcess, "describe", lambda *words: opened.append(words) or 1 / 0)
    (tmp_path / "marked.so").touch()
    (tmp_path / "marked.fmu").touch()
    (tmp_path / "own.toml").write_text(SCENARIO.replace("marked:Own", place))
    scenario = hsv_package.load("own.toml")
    flying = {
        "fly": lambda: hsv_package.fly(scenario),
        "sweep": lambda: dict(hsv_package.sweep("own.toml", "seed", [1])),
        "montecarlo": lambda: hsv_package.montecarlo(
            "own.toml", 4, factor={"initial.altitude": ("26000 m", "26010 m")}
        ),
    }
    reading = {
        "load": lambda: hsv_package.load("own.toml"),
        "compare": None,
        "read_campaign": None,  # of a result, read above
        "linearise": lambda: hsv_package.linearise(),
        "loop": None,  # of tube_mpc only
        "trim": lambda: hsv_package.trim(),
        "plot": None,  # of flights
        "Flight": None,
        "LinearModel": None,
        "Scenario": None,
        "Trim": None,  # classes
        "gym.TrackEnv": lambda: TrackEnv("own.toml").reset(seed=1),
        "gym.TrackEnv drawn": lambda: TrackEnv("own.toml", scale=1.0).reset(seed=1),
        "gym.TrackVectorEnv": lambda: TrackVectorEnv(2, "own.toml").reset(seed=1),
        "exported_vehicle": lambda: exported_vehicle(scenario),
    }
    assert {*hsv_package.__all__} <= {*flying, *reading}
    with pytest.raises(GovernorError, match="expected tube_mpc"):
        governed("own.toml", 1.0)
    for name, call in reading.items():
        if call:
            call()
        assert not loaded() and not opened, name
    for name, call in flying.items():
        with pytest.raises(ZeroDivisionError) if place != "marked:Own" else nullcontext():
            call()
        assert loaded() or opened, name
        opened.clear()


def test_all_code_of_files_goes_through_one_gate():
    """Nothing else makes the classes that load a library, or imports a module by a name that a file may contain."""
    sources = {path: path.read_text() for path in Path(hsv_package.__file__).parent.rglob("*.py")}
    makers = {path.name for path, text in sources.items() if re.search(r"(?<!class )\b(LibraryClass|FmuClass)\(", text)}
    assert makers == {"controllers.py"}
    importers = {path.name for path, text in sources.items() if re.search(r"import_module\(", text)}
    assert importers == {"controllers.py", "blocks.py", "main.py"}  # the latter two: modules of this library
