"""Every number in our messages has a unit."""

from hsv.bags.definitions import definition, fields_of
from hsv.bags.units import KNOWN, parse_units


def test_every_double_of_our_messages_names_its_unit(kit, store):
    """Except gains, whose elements have many units, and parameters of faults, whose units depend on the type."""
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
