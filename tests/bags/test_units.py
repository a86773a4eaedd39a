"""Every number of our messages tells its unit."""

from hsv.bags.definitions import definition, fields_of
from hsv.bags.units import KNOWN, parse_units


def test_every_double_of_our_messages_names_its_unit(kit, store):
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
