"""Every number of our messages tells its unit."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from rosbags.typesys.store import Typestore

from hsv.bags.definitions import definition
from hsv.bags.typestore import fields_of
from hsv.bags.units import KNOWN, Units, parse_units, units_of


@pytest.mark.parametrize(
    ("comment", "units"),
    [
        ("m/s", Units((), ("m/s",))),
        ("rad/s, q_f(k) = C s(k) + D q(k)", Units((), ("rad/s",))),
        ("rad, rad s: s(k)", Units((), ("rad", "rad s"))),
        ("m, m/s, then rad, rad s: e", Units(("m", "m/s"), ("rad", "rad s"))),
        ("sum of the constants above", Units()),
        ("", Units()),
    ],
)
def test_comments(comment: str, units: Units) -> None:
    assert parse_units(comment) == units


def test_elements_in_turn() -> None:
    units = parse_units("m, -, then rad, rad s")
    assert [units.of(i) for i in range(6)] == ["m", "", "rad", "rad s", "rad", "rad s"]
    assert parse_units("N").of(3) == "N"


def test_nested_fields_and_times(kit: SimpleNamespace, store: Typestore) -> None:
    kind = "hsv_msgs/msg/NominalState"
    units = units_of(definition(kind), store.fielddefs, kind)
    assert units["header.stamp"].of() == "ns"
    assert units["deviation.elastic_rate_2"].of() == "kg^0.5 m/s"
    assert units["input.elevator_deflection"].of() == "rad"


def test_every_double_of_our_messages_names_its_unit(kit: SimpleNamespace, store: Typestore) -> None:
    """Except a gain, whose elements are of many units, and a fault's parameters, whose units are its type's."""
    for kind in kit.types:
        text = definition(kind)
        lines = {line.split()[1]: line for line in text.splitlines() if line.startswith("float64")}
        for field in fields_of(store.fielddefs, kind):
            if field.type == "float64" and (kind, field.name) not in {
                ("hsv_msgs/msg/NominalState", "gain"),
                ("hsv_msgs/msg/Fault", "parameter_values"),
            }:
                comment = lines[field.name].partition("#")[2].strip()
                assert parse_units(comment).others, f"{kind}.{field.name}: expected one of {', '.join(KNOWN)}"
