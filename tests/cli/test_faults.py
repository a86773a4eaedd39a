import pytest

from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.table import FAULT_KINDS, read_fault


def test_every_type_of_fault_is_listed(hsv):
    listed = hsv("list", "faults", "--json").json
    assert list(listed) == list(FAULT_KINDS)
    assert {entry["side"] for entry in listed.values()} == {"command", "dynamics", "effector", "engine", "sensor"}
    out = hsv("list", "faults").out
    assert all(name in out for name in FAULT_KINDS)


@pytest.mark.parametrize("units", ["si", "paper"])
@pytest.mark.parametrize("kind", FAULT_KINDS)
def test_a_fault_at_either_end_of_the_ranges_that_are_printed_can_be_injected(hsv, kind, units):
    described = hsv("list", "faults", kind, "--json", "--units", units).json
    occurrence = ("intermittent_period", "intermittent_duty", "random_on", "random_off")
    for channel in described["channels"]:
        rows = [row for row in described["parameters"] if row["channel"] in ("", channel)]
        assert {row["parameter"] for row in rows} >= {*occurrence}
        for share in (1e-9, 1.0 - 1e-9):
            given = [
                f"{row['parameter']}={row['least'] + share * (row['largest'] - row['least'])!r} {row['unit']}"
                for row in rows
                if row["parameter"] not in (*occurrence, "steps")
            ]
            steps = [f"steps={row['least']:g}" for row in rows if row["parameter"] == "steps"]
            fault = read_fault(channel, kind, given + steps)
            injector = FaultInjector()
            injector.inject(fault)
            assert injector.parameters()["fault.types"] == [kind]


def test_parameters_are_printed_in_the_unit_of_their_channel(hsv):
    words = ("amplitude", "elevator_deflection", "30", "deg")
    out = hsv("list", "faults", "oscillation", "--units", "paper").out
    assert any(all(word in line.split() for word in words) for line in out.splitlines())
    rows = hsv("list", "faults", "sensor_runaway", "--units", "paper", "--json").json["parameters"]
    [rate] = [row for row in rows if row["parameter"] == "rate" and row["channel"] == "velocity"]
    assert (rate["unit"], rate["default"]) == ("ft/s/s", None)
    assert rate["largest"] == pytest.approx(3000.0 / 0.3048)
    # Natural frequencies are no rates of angles.
    assert "rad/s" in hsv("list", "faults", "bandwidth", "--units", "paper").out


def test_an_unknown_type_is_refused_with_the_nearest(hsv):
    ran = hsv("list", "faults", "oscilation")
    assert ran.code == 2
    assert ran.error.startswith("fault = 'oscilation': expected one of loss_of_effectiveness, ")
    assert ran.error.endswith("(did you mean 'oscillation'?)")
