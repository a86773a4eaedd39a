"""Requirements: margins of signal temporal logic over windows, and the text of scenario files."""

import math
import tomllib

import numpy as np
import pytest
import tomli_w
from flights import components
from hypothesis import given, settings
from hypothesis import strategies as st

from hsv.base.errors import HsvError
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.history import History
from hsv.flight.metrics import FlightData
from hsv.flight.requirement import MODES, SIGNALS, Predicate, Requirement, decided, margins
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_text
from hsv.flight.side_by_side import TubeLevels

PERIOD = 0.02
ROW = {"name": "r", "signal": "altitude_error", "at_most": "5 ft", "always": True}


def flight(altitude, velocity=0.0, fault=None, reference=None):
    """Return a flight with these altitudes (m) and velocities (m/s), all else zero."""
    n = len(altitude)
    state = np.zeros((n, 9))
    state[:, 0], state[:, 1] = altitude, velocity
    zero = np.zeros((n, 2))
    history = History.of(state=state, deviation=np.zeros((n, 9)), command=zero, u_unsaturated=zero)
    return FlightData(np.arange(n) * PERIOD, history, np.zeros((n, 9)) if reference is None else reference, fault)


def required(mode="always", bound=1.0, upper=True, begin=0.0, within=math.inf, target=None, signal="altitude"):
    return Requirement("r", "", Predicate(signal, bound, upper), mode, target, begin, within)


def margin_of(requirement, data, **others):
    return margins([requirement], data, **({"ended": True} | others))[requirement.metric]


def read(*rows, **fields):
    """Return the requirements of case1 with these rows, read from a file's text."""
    table = tomllib.loads(scenario_text("case1"))
    return parse_scenario(tomli_w.dumps(table | {"requirement": list(rows)} | fields), "case1").requirement


def oracle(text):
    """Return the specification ``text`` of rtamt over the signals x, y and the bounds c, d."""
    rtamt = pytest.importorskip("rtamt")  # its parser does not run with Python 3.13
    spec = rtamt.StlDiscreteTimeSpecification()
    for name in ("x", "y", "c", "d", "out"):
        spec.declare_var(name, "float")
    spec.spec = f"out = {text}"
    spec.parse()
    return lambda **signals: [value for _, value in spec.evaluate({"time": list(range(len(signals["x"]))), **signals})]


@pytest.mark.parametrize("traces", [1_500, pytest.param(10_000, marks=pytest.mark.long)])
def test_margins_of_random_traces_are_those_of_rtamt(traces):
    random = np.random.default_rng(66)
    forms = dict(zip(MODES, ("always{} (x {} c)", "eventually{} (x {} c)", "(x {1} c) until{0} (y <= d)"), strict=True))
    cases = [(mode, upper, width) for mode in MODES for upper in (True, False) for width in (0, 1, 4, 9, None)]
    kept = 0
    for mode, upper, width in cases:
        spec = oracle(forms[mode].format("" if width is None else f"[0:{width}]", "<=" if upper else ">="))
        for _ in range(-(-traces // len(cases))):
            n = int(random.integers(2, 15))  # rtamt fails for a single step
            x, y = random.integers(-8, 9, (2, n)) / 4.0
            bound, other = random.choice([-1.5, -0.25, 0.25, 1.0, 1.75], 2)
            expected = spec(x=x.tolist(), y=y.tolist(), c=[float(bound)] * n, d=[float(other)] * n)
            start = int(random.integers(n))
            within = math.inf if width is None else width * PERIOD or PERIOD / 2.0
            target = Predicate("velocity", 1.0, True) if mode == "until" else None
            # Margins are shares of each bound; rtamt compares differences, so the target's bound is 1 and moves y.
            scale = abs(bound)
            moved = 1.0 - (other - y) / scale
            found = margin_of(required(mode, bound, upper, start * PERIOD, within, target), flight(x, moved))
            assert found.margin * scale == pytest.approx(expected[start], abs=1e-12)
            assert found.kept == (expected[start] >= -1e-12)
            assert start <= found.step < n
            kept += found.kept
    assert 0.2 * traces < kept < 0.8 * traces


def test_windows_beyond_the_end_of_a_trace_are_empty_as_in_rtamt():
    for mode in ("always", "eventually"):
        [beyond, *_] = oracle(f"{mode}[5:6] (x <= c)")(x=[0.0] * 3, y=[0.0] * 3, c=[1.0] * 3, d=[0.0] * 3)
        assert decided(mode, np.empty(0))[0] == beyond
    assert decided("until", np.empty(0), np.empty(0))[0] == -math.inf
    # A flight that does not reach the window does not keep the requirement.
    assert margin_of(required(begin=1.0), flight([0.0] * 3)).margin == -math.inf


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=30), st.integers(0, 29))
@settings(max_examples=100, deadline=None)
def test_always_and_eventually_are_dual_and_the_deciding_step_has_the_margin(values, start):
    upper, lower = required("always", begin=start * PERIOD), required("eventually", upper=False, begin=start * PERIOD)
    a, b = (margin_of(each, flight(values)) for each in (upper, lower))
    if start >= len(values):
        assert a.margin == b.margin == -math.inf
    else:
        assert a.margin == -b.margin
        assert a.value == values[a.step] and a.margin == (1.0 - a.value) / 1.0


def test_nan_and_a_lost_flight_keep_nothing():
    assert margin_of(required(), flight([0.0, math.nan, 0.0])).margin == -math.inf
    assert margin_of(required("eventually"), flight([math.nan, 0.5])).margin == 0.5
    assert not margin_of(required("eventually"), flight([math.nan])).kept
    lost = margin_of(required(), flight([0.0]), ended=False)
    assert lost.margin == -math.inf and lost.step is None
    assert margin_of(required(signal="level"), flight([0.0])).margin == -math.inf  # no invariant set
    assert margin_of(required(signal="level", bound=2.0), flight([0.0]), levels=lambda: np.ones(1)).margin == 0.5


def test_windows_from_the_fault_and_from_the_end_of_the_manoeuvre():
    values, reference = np.zeros(10), np.zeros((10, 9))
    values[2], values[6], values[9] = 0.9, 0.5, 0.8
    reference[4:, 0] = 1.0
    data = flight(values, fault=5 * PERIOD, reference=reference)
    assert margin_of(required(begin="start"), data).value == 0.9
    assert margin_of(required(begin="fault"), data).value == 0.8
    assert margin_of(required(begin="fault", within=2 * PERIOD), data).value == 0.5
    assert margin_of(required(begin="manoeuvre end"), data).window == slice(4, 10)
    assert margin_of(required(begin="fault"), flight(values)).margin == -math.inf  # no fault was flown


def test_margins_agree_with_the_metrics_of_a_flight():
    parts = components("case1", duration=120.0)
    flown, levels = fly(parts), TubeLevels(parts)
    rows = [
        {"name": "a", "signal": "attitude_from_nominal", "at_most": "0.5 deg", "always": True, "from": "fault"},
        {"name": "b", "signal": "level", "at_most": 1, "always": True},
        {"name": "c", "signal": "elevator_deflection", "at_least": "5 deg", "always": True},
        {"name": "d", "signal": "altitude_error", "at_most": "30 ft", "always": True},
    ]
    a, b, c, d = (m.value for m in margins(read(*rows), flown, ended=True, levels=lambda: levels.along(flown)).values())
    assert a == flown.metrics["post_fault_attitude_from_nominal"]
    assert b == levels.worst(flown)
    exact = margin_of(read(*rows)[1], flown, levels=lambda: levels.along(flown)).margin
    assert margin_of(read(*rows)[1], flown, largest_level=levels.worst(flown)).margin == exact
    assert c == flown.metrics["elevator_deflection_minimum"]
    assert d == flown.metrics["altitude_error_maximum"]


def test_every_signal_has_a_value_at_every_step():
    data = flight(np.zeros(4))
    assert all(signal.along(data).shape == (4,) for signal in SIGNALS.values())


def test_a_requirement_is_read_with_units_and_in_words():
    [one] = read({**ROW, "id": "FCS-1", "from": "fault", "within": "3 s"})
    assert one.predicate == Predicate("altitude_error", pytest.approx(1.524), True)
    assert (one.id, one.begin, one.within, one.metric) == ("FCS-1", "fault", 3.0, "margin_r")
    assert one.words() == "altitude error at most 1.52 m, always, from fault, within 3 s"
    [other] = read({"name": "u", "signal": "pitch_rate", "at_least": "-3 deg/s", "until": "altitude_error at_most 9 m"})
    assert other.target == Predicate("altitude_error", 9.0, True)
    assert load_scenario("case1").requirement == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"signal": "altitud"}, r"requirement\[0\].signal = 'altitud': expected .*altitude"),
        ({"signal": ["altitude"]}, "requirement"),
        ({"at_most": "5 deg"}, r"requirement\[0\].at_most = '5 deg': wrong unit"),
        ({"at_most": "0 ft"}, r"at_most = '0 ft': expected a bound other than 0"),
        ({"at_most": {"uniform": ["1 ft", "2 ft"]}}, r"requirement\[0\].at_most"),
        ({"at_least": "1 ft"}, "either at_most or at_least"),
        ({"eventually": True}, "expected one of always = true"),
        ({"always": False}, "expected one of always = true"),
        ({"until": "altitude"}, "expected one of always"),
        ({"within": "0 s"}, "an empty window"),
        ({"from": "200 s"}, "an empty window"),
        ({"from": "later"}, "from = 'later': expected"),
        ({"from": ["fault"]}, "from"),
        ({"name": ""}, r"requirement\[0\].name = '': expected a text"),
        ({"name": "two\nlines"}, r"requirement\[0\].name = 'two\\nlines': expected a text in one line"),
        ({"id": 3}, "id = 3"),
        ({"boud": 1}, r"requirement\[0\].boud: unknown key"),
    ],
)
def test_a_wrong_requirement_is_refused_in_one_line(changes, words):
    with pytest.raises(HsvError, match=words) as refused:
        read({**ROW, **changes})
    assert "\n" not in str(refused.value) and "case1" in str(refused.value)


def test_a_window_shorter_than_a_period_is_refused_before_the_flight():
    scenario = load_scenario("case1").model_copy(update={"requirement": (required(begin=0.01, within=1e-9),)})
    with pytest.raises(HsvError, match=r"requirement 'r': within = 1e-09 s: an empty window, .* a period, 0.02 s"):
        assemble_flight(scenario)


def test_duplicate_names_windows_without_fault_and_other_types_are_refused():
    with pytest.raises(HsvError, match=r"requirement\[1\].name = 'R': a requirement has this name already"):
        read(ROW, {**ROW, "name": "R"})
    with pytest.raises(HsvError, match="an empty window, expected a scenario with a fault"):
        read({**ROW, "from": "fault"}, fault=[])
    with pytest.raises(HsvError, match="expected a list of tables"):
        read(3)
    with pytest.raises(HsvError, match="'SIGNAL at_most BOUND'"):
        read({"name": "r", "signal": "altitude_error", "at_most": "5 ft", "until": "altitude below 3 m"})
