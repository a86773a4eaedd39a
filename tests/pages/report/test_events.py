from hsv.bags.info import describe
from hsv.pages.events import Event, flight_events


def of_kind(bag, kind):
    return [event for event in flight_events(bag, describe(bag)) if event.kind == kind]


def test_a_quiet_flight_has_its_fault_and_nothing_else(quiet):
    assert flight_events(quiet, describe(quiet)) == [
        Event(8.0, None, "fault", "elevator deflection: loss of effectiveness 0.9", "elevator_deflection")
    ]


def test_limited_commands_are_the_saturated_steps(loud):
    saturated = loud.columns("/hsv/command")["saturated"]
    assert saturated[:, 0].any() and not saturated[:, 1].any()
    events = of_kind(loud, "saturation")
    assert {event.subject for event in events} == {"fuel_equivalence_ratio"}
    time = loud.columns("/hsv/command")["header.stamp"] * 1e-9
    assert events[0].start == time[saturated[:, 0]][0]
    for moment in time[saturated[:, 0]]:
        assert any(event.start <= moment <= (20.0 if event.end is None else event.end) for event in events)


def test_leaving_the_tube_is_an_event(loud):
    excursions = describe(loud)["tube"]["excursions"]
    events = of_kind(loud, "tube")
    assert excursions and 0 < len(events) <= len(excursions)
    assert events[0].start == excursions[0]["start_s"]


def test_what_log_and_diagnostics_both_say_is_one_event_and_repetition_is_joined(loud):
    assert of_kind(loud, "warning") == [Event(3.0, 4.0, "warning", "tube_mpc: <b>unusual</b>", "tube_mpc")]
    assert of_kind(loud, "error") == [Event(9.0, 9.0, "error", "tube_mpc: worse", "tube_mpc")]
