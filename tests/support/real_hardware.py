"""Changes to Case 1 that shorten it and add imperfect actuators, sensors, air, links and faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tomli_w

SHORT = {"duration": "6 s", "seed": 7, "fault": []}

ACTUATORS = {"actuator": {"elevator_deflection": {"set": "elevator_50"}, "fuel_equivalence_ratio": {"set": "fuel_10"}}}
SENSORS = {"sensors": {"set": "fine"}}
ESTIMATOR = {"sensors": {"set": "ghv"}, "estimator": {"enabled": True}}
LINKS = {
    "link": {
        "computational_delay": "7 ms",
        "measurement": {"loss": 0.05, "burst": 2, "corruption": 0.02, "checksum": True},
        "command": {"jitter": 1, "loss": 0.05, "corruption": 0.02},
    }
}
AIR = {
    "turbulence": {"sigma_forward": "2 ft/s", "sigma_up": "2 ft/s"},
    "gust": {"starts": ["2 s"], "forward": ["10 ft/s"], "up": ["5 ft/s"], "lengths": ["500 m"], "stays": [0.0]},
}


def faults(*rows: dict[str, Any]) -> dict[str, Any]:
    """Return a table of these faults, which begin after one second unless a row says otherwise."""
    return {"fault": [{"start": "1 s", **row} for row in rows]}


ELEVATOR, FUEL = "elevator_deflection", "fuel_equivalence_ratio"
HARDWARE: dict[str, dict[str, Any]] = {
    "actuators": ACTUATORS,
    "sensors": SENSORS,
    "estimator": ESTIMATOR,
    "air": AIR,
    "links": LINKS,
    "computation": {"link": {"computational_delay": "27 ms"}},
    "corruption": {"link": {"measurement": {"delay": 1, "corruption": 0.02}}},
    "oscillation": faults({"channel": ELEVATOR, "type": "oscillation", "amplitude": "0.2 deg", "frequency": "1 Hz"}),
    "bandwidth": ACTUATORS | faults({"channel": ELEVATOR, "type": "bandwidth", "natural_frequency": "20 rad/s"}),
    "engine": faults(
        {"channel": "engine", "type": "thrust_loss", "share": "95 %", "stop": "4 s"},
        {"channel": "engine", "type": "inlet_unstart", "start": "3 s", "stop": "3.5 s"},
    ),
    "sensor faults": SENSORS
    | faults(
        {"channel": "pitch_angle", "type": "sensor_bias", "offset": "0.05 deg"},
        {"channel": "velocity", "type": "sensor_freeze", "start": "2 s", "stop": "4 s"},
    ),
    "delay": faults({"channel": FUEL, "type": "delay", "steps": 3}),
    "random loss": faults(
        {"channel": ELEVATOR, "type": "loss_of_effectiveness", "effectiveness": 0.8, "random_on": "0.2 s"}
        | {"random_off": "0.3 s"}
    ),
}
RANDOM = (
    "sensors",
    "estimator",
    "air",
    "links",
    "corruption",
    "sensor faults",
    "random loss",
    "everything",
    "everything estimated",
)
_FAULTS = {"fault": [row for hardware in HARDWARE.values() for row in hardware.get("fault", ())]}
HARDWARE["everything"] = ACTUATORS | SENSORS | AIR | LINKS | _FAULTS
HARDWARE["everything estimated"] = ACTUATORS | ESTIMATOR | AIR | LINKS | _FAULTS
"""Changes to Case 1, by name."""


def scenario_file(folder: Path, name: str, **changes: Any) -> Path:
    """Write a scenario file, Case 1 with this hardware, and return its path."""
    path = folder / f"{name.replace(' ', '_')}.toml"
    path.write_text(tomli_w.dumps({"extends": "case1"} | SHORT | HARDWARE[name] | changes))
    return path
