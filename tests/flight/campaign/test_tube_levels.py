from flights import components

from hsv.control.controller import ControllerInput
from hsv.flight.closed_loop import fly
from hsv.flight.side_by_side import TubeLevels


def published_levels(parts, flight):
    """Return what the controller says of each step."""
    h, notch, law = flight.history, parts.notch_filter, parts.controller
    for part in (notch, law):
        part.reset()
    levels = []
    references = zip(flight.reference, flight.reference_input, strict=True)
    rows = zip(h.state, h.deviation, h.nominal_input, references, strict=True)
    for k, (x, x_n, u_n, (x_r, u_r)) in enumerate(rows):
        filtered = notch.step(float(x[4]))
        q_f, s = filtered.filtered_pitch_rate, filtered.filter_state
        result = law.step(ControllerInput(k, x, q_f, x_r, u_r, x_n, u_n, s))
        levels.append(result.level)
    return levels


def test_the_worst_level_is_the_largest_that_the_controller_publishes_in_every_bit():
    parts = components("case1_heavy", duration=110.0)
    flight = fly(parts)
    worst = TubeLevels(parts).worst(flight.data())
    assert worst == max(published_levels(parts, flight))
