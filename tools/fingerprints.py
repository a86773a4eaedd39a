"""Recreate the table of published fingerprints. Usage, after "source env.sh": python3 tools/fingerprints.py."""

from __future__ import annotations

from pathlib import Path

import tomli_w

import hsv
from hsv.control.design_file import find_design, read_design
from hsv.flight import fingerprint
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario, scenario_names

HEADER = """# Fingerprints of the shipped scenarios with the shipped designs. Made by tools/fingerprints.py.
"""


def main() -> None:
    """Simulate every shipped scenario whose nominal law calls no solver in flight, and write the fingerprints."""
    table = {}
    for name in scenario_names():
        scenario = load_scenario(name)
        if scenario.settings.get("nominal.law", "family") == "family":
            design = read_design(find_design(scenario.design))
            flight = fly(assemble_flight(scenario, design))
            table[name] = {"design_hash": design.digest, "fingerprint": flight.fingerprint}
    path = Path(hsv.__file__).parent / "flight" / fingerprint.TABLE
    path.write_text(HEADER + tomli_w.dumps(table), encoding="utf-8")
    print(f"{path.name}: {len(table)} scenarios")


if __name__ == "__main__":
    main()
