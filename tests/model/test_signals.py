"""The table of signals agrees with the messages, the core and the header of blocks in C."""

import re

import pytest

from hsv.bags.definitions import fields_of, installed_types
from hsv.bags.description import TOPIC_FIELDS, TOPICS, TUBE_STATUS
from hsv.control.controller import CONTROLLER_INPUTS
from hsv.core import lib
from hsv.flight import history
from hsv.model.signals import DIAGNOSED, INPUT_NAMES, N_INPUTS, N_RIGID, N_STATES, SIGNALS, STATE_NAMES, VARYING
from hsv.plugins.library import include_folder

FRONT = ["header", "step"]


def listed(store, kind, prefix=""):
    """Return the paths of the numbers in a message, of sequences too, in their order."""
    paths = []
    for field in fields_of(store.fielddefs, kind):
        nested = field.is_message and field.count == "one"
        paths += listed(store, field.type, f"{prefix}{field.name}.") if nested else [prefix + field.name]
    return paths


@pytest.mark.parametrize("topic", TOPIC_FIELDS)
def test_every_field_of_a_message_belongs_to_one_signal_of_the_table(topic):
    kind = TOPICS[topic]
    store = installed_types(kind)
    paths = [path for path in listed(store, kind) if path.split(".")[0] not in FRONT]
    sizes = DIAGNOSED | {"u_reference": N_INPUTS} if topic == TUBE_STATUS else {}
    carried = {field: 1 if s.sequence or s.name == "saturated" else s.size for s, field in TOPIC_FIELDS[topic].items()}
    for first, size in (sizes or carried).items():
        at = next(i for i, path in enumerate(paths) if path == first or path.startswith(f"{first}."))
        taken, paths = paths[at : at + (1 if size == VARYING else size)], paths[:at] + paths[at + abs(size) :]
        signal = next((s for s, field in TOPIC_FIELDS[topic].items() if field == first), None)
        if signal and signal.components and not signal.sequence:
            assert [path.rpartition(".")[2] for path in taken] == [*signal.components], signal.name
    assert paths == (["since"] if topic == "hsv/actuator" else [])


def test_the_core_and_the_history_have_the_sizes_of_the_table():
    assert (lib.STATES, lib.INPUTS, lib.RIGID) == (N_STATES, N_INPUTS, N_RIGID)
    assert (lib.HISTORY, lib.AUXILIARY, lib.ACTED) == (history.SIGNAL_COLUMNS, history.AUXILIARY_COLUMNS, history.U)
    for name, place in (("angle_of_attack", lib.ALPHA), ("pitch_angle", lib.PITCH), ("pitch_rate", lib.PITCH_RATE)):
        assert STATE_NAMES.index(name) == place
    for signal in SIGNALS.values():
        assert len(signal.components) in (0, signal.size), signal.name
        assert len(signal.unit.split(", ")) in (1, signal.size) or signal.size == VARYING, signal.name


def test_the_header_of_blocks_in_c_has_the_offsets_of_the_table():
    text = (include_folder() / "hsv_block.h").read_text(encoding="utf-8")
    names = re.findall(r"^    HSV_([A-Z_0-9]+)(?: = ([^,]+?))?,? *(?:/\*.*)?$", text, re.MULTILINE)
    values: dict[str, int] = {}
    following = 0
    for name, given in names:
        terms = re.findall(r"HSV_(\w+)|(\d+)", given)
        values[name] = sum(values[term] if term else int(number) for term, number in terms) if given else following
        following = values[name] + 1
    assert [values[name.upper()] for name in STATE_NAMES] == list(range(N_STATES)) and values["STATES"] == N_STATES
    assert [values[name.upper()] for name in INPUT_NAMES] == list(range(N_INPUTS)) and values["INPUTS"] == N_INPUTS
    start = 0
    for signal in CONTROLLER_INPUTS:
        assert values[signal.name.upper()] == start, signal.name
        start += signal.size
