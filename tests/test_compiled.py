"""Functions compiled ahead of time do what numba's do, and are used where they are current."""

import json
import multiprocessing
import os
import pickle
import subprocess
import sys
import time
from collections import namedtuple
from concurrent.futures import BrokenExecutor

import numpy as np
import pytest

from hsv import ahead_of_time, compiled, kept_library, precompiled
from hsv.compiled import CompiledFunction, bound, njit
from hsv.elementary import arcsine, exponential, tangent
from hsv.lane_types import WIDTH
from hsv.lanes import LaneArray, LaneRecord
from hsv.precompiled import NotAheadOfTimeError, types_of
from hsv.simulation.assembly import assemble_flight
from hsv.simulation.closed_loop import fly, fly_loop
from hsv.simulation.scenario import load_scenario
from hsv.vehicle.envelope import in_model_range

Pair, Plain = namedtuple("Pair", "first second"), namedtuple("Plain", "one other")
SYSTEM = (
    "malloc",
    "free",
    "memcpy",
    "memset",
    "memmove",
    "fmod",
    "strcmp",
    "Py",
    "_Py",
    "__cxa_finalize",
    "__gmon_start__",
    "_ITM_",
)
"""Beginnings of the names that the library may take from the system; none is of an elementary function."""


@njit()
def mixed(numbers, pair, flag, count, nothing):
    made = np.empty((2, len(numbers)))
    for i in range(len(numbers)):
        made[0, i] = numbers[i] * pair.first if flag else numbers[i]
        made[1, i] = pair.second[i] + count
        numbers[i] = -1.0
    return made, made[1], (count + 1, flag, nothing), 1j * pair.first


@njit(_nrt=False)
def weighted(rows, pair, total):
    for i in range(len(rows)):
        total[i] = rows[i] * pair.first + pair.second


@njit(inline="always")
def remainder(a, b):
    return a // b


@njit()
def text(number):
    return str(number)


def scaling(factor):
    return njit()(lambda x: factor * x)


@pytest.fixture
def index(tmp_path, monkeypatch):
    """Return an index of what a test compiles ahead of time, in place of that of the package."""
    path = tmp_path / "ahead_of_time.json"
    monkeypatch.setattr(precompiled, "INDEX", path)
    monkeypatch.setattr(ahead_of_time, "INDEX", path)
    monkeypatch.setattr(kept_library, "INDEX", path)
    precompiled._entries.cache_clear()
    yield path
    precompiled._entries.cache_clear()


def built(*calls):
    """Compile ahead of time what the ``calls`` call, a function and its arguments each; return for how many it was."""
    with ahead_of_time.recording() as recorded:
        for function, *arguments in calls:
            function(*arguments)
    number = ahead_of_time.build(recorded)
    for function, *_ in calls:
        function._dispatcher = None
    return number


def arguments():
    return np.array([1.5, -2.0, 3.25]), Pair(0.1, np.array([1, 2, 3])), True, 7, None


def test_arguments_and_results_of_all_kinds_are_those_of_numba(index):
    expected, changed = None, arguments()
    expected = mixed.dispatcher(*changed)
    assert built((mixed, *arguments())) == 1
    given = arguments()
    found = mixed(*given)
    assert mixed._dispatcher is None  # not numba's
    for ours, theirs in zip(found[:2], expected[:2], strict=True):
        assert ours.dtype == theirs.dtype and np.array_equal(ours, theirs)
    assert found[2:] == expected[2:] and found[2][1] is True
    assert np.array_equal(given[0], changed[0])  # written in place


def test_lanes_are_taken_and_nothing_is_done_with_them_while_recorded(index):
    def given():
        pairs = [Pair(i + 1.0, -0.5 * i) for i in range(WIDTH)]
        rows = np.arange(3.0 * WIDTH).reshape(3, WIDTH)
        return LaneArray(rows), LaneRecord(pairs), LaneArray.zeros(3)

    arguments = given()
    assert built((weighted, *arguments)) == 1
    assert not arguments[2].array.any()
    rows, pair, total = given()
    call = bound(weighted)
    call(rows, pair, total)
    assert np.array_equal(total.array, rows.array * pair.array[0] + pair.array[1])
    weighted(rows, pair, total)
    assert weighted._dispatcher is None
    history = LaneArray(np.zeros((WIDTH, 3)), split=True)
    for other in (history, LaneArray.zeros((3, 2)), LaneArray(np.zeros((3, WIDTH + 1))), pair, rows.array, None):
        with pytest.raises(TypeError, match=r"expected a LaneArray\(1, "):
            call(rows, pair, other)
    for other in (LaneRecord([Plain(1.0, 2.0)] * WIDTH), LaneRecord([Pair(1.0, 2.0)]), rows, None):
        with pytest.raises(TypeError, match=r"expected a LaneRecord\(\('first', 'second'\), "):
            call(rows, other, total)
    call(rows, pair, total)


class Claimed:
    """Says that it is an array of lanes, and lacks an attribute of one."""

    def __init__(self, **attributes):
        vars(self).update(attributes)


@pytest.mark.parametrize(
    "change",
    [{"address": None}, {"address": "1"}, {"stride": 0.5}, {"shape": None}, {"shape": [3]}, {"shape": ()}, {"kind": 1}],
    ids=str,
)
@pytest.mark.parametrize("missing", [False, True])
def test_what_only_claims_to_be_lanes_is_refused(index, change, missing):
    given = LaneArray.zeros(3)
    rest = LaneRecord([Pair(1.0, 2.0)] * WIDTH), LaneArray.zeros(3)
    built((weighted, given, *rest))
    call = bound(weighted)
    call(given, *rest)
    attributes = {name: getattr(given, name) for name in ("kind", "address", "stride", "shape")} | change
    if missing:
        attributes = {name: value for name, value in attributes.items() if name not in change}
    with pytest.raises(TypeError, match="expected a LaneArray"):
        call(Claimed(**attributes), *rest)


def test_a_process_that_was_killed_is_told_after_the_block(index):
    with ahead_of_time.recording(1) as calls:
        assert exponential(0.0) == 1.0
        [process] = multiprocessing.active_children()
        process.kill()
        process.join()
        assert tangent(0.0) == 0.0
    with pytest.raises(BrokenExecutor):
        ahead_of_time.build(calls)


def test_what_is_recorded_is_not_compiled_meanwhile(index):
    text._dispatcher = remainder._dispatcher = None
    with ahead_of_time.recording() as calls:
        assert remainder(7, 2) == 3 and text(5) == "5" and remainder(7, b=2) == 3
    assert [name.rpartition(".")[2] for name, _ in calls] == ["remainder", "text"]
    assert text._dispatcher is None and remainder._dispatcher is not None  # a named argument is numba's
    remainder._dispatcher = None


def test_entries_of_several_processes_are_those_of_one(index):
    def entries(processes):
        with ahead_of_time.recording(processes) as calls:
            assert exponential(0.0) == 1.0 and tangent(0.0) == arcsine(0.0) == 0.0
        return {key: compile_entry()[1] for key, compile_entry in calls.items()}

    alone = entries(0)
    assert [name for name, _ in alone] == [f"hsv.elementary.{each}" for each in ("exponential", "tangent", "arcsine")]
    assert list(entries(1).items()) == list(entries(2).items()) == list(alone.items())


def test_an_error_meanwhile_ends_what_compiles(index):
    with pytest.raises(ValueError, match="stop"), ahead_of_time.recording(2) as calls:
        exponential(0.0)
        raise ValueError("stop")
    assert multiprocessing.active_children() == [] and compiled.instead is None and len(calls) == 1


def test_an_error_of_python_is_raised_and_inlined_functions_are_called(index):
    built((remainder, 7, 2))
    assert remainder(-7, 2) == -4
    with pytest.raises(RuntimeError, match="remainder raised an error"):
        remainder(7, 0)
    assert remainder._dispatcher is None


def test_what_is_not_compiled_ahead_of_time_is_numbas(index):
    assert built((text, 3), (remainder, 7, 2)) == 1
    assert text(3) == "3"
    assert remainder(7.5, 2.0) == 3.0
    assert remainder._dispatcher is not None
    assert remainder(7, b=2) == 3


def test_functions_that_share_a_name_are_numbas(index):
    double, treble = scaling(2.0), scaling(3.0)
    assert built((double, 1.0), (treble, 1.0)) == 0
    assert double(1.0) == 2.0 and treble(1.0) == 3.0


def test_a_number_that_fits_into_no_word_is_refused(index):
    built((remainder, 7, 2))
    with pytest.raises(OverflowError):
        remainder(2**70, 2)


def test_arrays_of_any_order_are_taken(index):
    built((scaled, np.zeros((4, 2))[:, 1], 1.0, None), (scaled, np.zeros((2, 4)).T[1], 1.0, None))
    numbers = np.arange(24.0).reshape(8, 3)
    assert scaled(numbers[:, 1], 1.0, None) == numbers[:, 1].sum()
    assert scaled(numbers[::-2, 1], 1.0, None) == numbers[::2, 1].sum() + 4 * 3.0
    assert scaled._dispatcher is None


@pytest.mark.parametrize(
    "change",
    [
        {"processor": "other"},
        {"digest": "other"},
        {"contents": "other"},
        {"functions": {"a": [[["int64"], "b", ["", []]]]}},
    ],
    ids=lambda change: next(iter(change)),
)
def test_a_library_that_is_another_one_is_not_used(index, change):
    built((remainder, 7, 2))
    assert precompiled._entries()
    index.write_text(json.dumps(json.loads(index.read_text()) | change))
    precompiled._entries.cache_clear()
    assert not precompiled._entries() and remainder(7, 2) == 3


@pytest.mark.parametrize("damaged", ["", "{}", "[]", '{"processor": 1}'])
def test_an_index_that_cannot_be_read_is_as_none(index, damaged):
    index.write_text(damaged)
    assert precompiled._entries() == {}


def test_a_library_that_was_cut_is_not_used(index):
    built((remainder, 7, 2))
    [library] = index.parent.glob("*.so")
    os.truncate(library, library.stat().st_size // 2)
    precompiled._entries.cache_clear()
    assert not precompiled._entries() and remainder(7, 2) == 3


def test_what_says_how_functions_are_compiled_and_called_is_a_source_of_the_library():
    sources = set(json.loads(precompiled.INDEX.read_text())["sources"])
    assert sources >= {"ahead_of_time.py", "compiled.py", "precompiled.py", "run_time.c", "elementary.py"}


def test_a_library_is_not_used_where_numba_is_to_compile_otherwise(index, monkeypatch):
    built((remainder, 7, 2))
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert precompiled._entries()
    precompiled._entries.cache_clear()
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    assert not precompiled._entries()


@pytest.mark.parametrize("name", ["case1", "case1_realistic"])
def test_a_flight_has_the_bits_that_it_has_by_numba(name, monkeypatch):
    components = assemble_flight(load_scenario(name).model_copy(update={"duration": 10.0}))
    fly_loop._dispatcher = None
    ours = fly(components).history.flown
    assert fly_loop._dispatcher is None
    monkeypatch.setattr(precompiled, "_entries", dict)
    assert np.array_equal(fly(components).history.flown, ours)
    assert fly_loop._dispatcher is not None
    fly_loop._dispatcher = None


def test_an_older_library_is_removed(index):
    built((remainder, 7, 2))
    built((remainder, 7.0, 2.0))
    assert len([*index.parent.glob("*.so")]) == 1


@pytest.mark.parametrize("argument", ["text", np.zeros(3, np.float32), 1j, np.zeros(2, ">f8"), {}, (1, "text")])
def test_other_arguments_have_no_types_here(argument):
    with pytest.raises(NotAheadOfTimeError):
        types_of((argument,))


def test_types_are_told_apart():
    constant = np.zeros(3)
    constant.flags.writeable = False
    values = [
        1.0,
        1,
        True,
        None,
        (1,),
        Pair(1, 1),
        (1, (1,)),
        np.zeros(3),
        np.zeros((3, 2)),
        np.zeros((3, 2)).T,
        np.zeros((3, 2))[:, 1],
        np.zeros((3, 2, 2))[:, :, 1],
        np.zeros(3, int),
        constant,
    ]
    assert len({types_of((value,))[0] for value in values}) == len(values)
    assert types_of((np.float64(1.0), np.int64(2), np.bool_(True))) == types_of((1.0, 2, True))


@njit()
def scaled(x, factor, offset=None):
    total = 0.0
    for value in x:
        total += factor * value
    return total if offset is None else total + offset


@pytest.fixture(params=["ahead of time", "numba"])
def source(request, index):
    """Have :func:`scaled` compiled ahead of time, or not."""
    if request.param == "ahead of time":
        assert built((scaled, np.ones(2), 1.0, None), (scaled, np.ones(2), 1.0, 1.0)) == 2
    yield request.param
    assert (scaled._dispatcher is None) == (request.param == "ahead of time")
    scaled._dispatcher = None


def test_a_bound_function_gives_what_the_function_gives(source):
    x = np.array([1.0, 2.0, 4.0])
    without, sum_of = bound(scaled), bound(scaled)
    assert without(x, 0.5, None) == scaled(x, 0.5, None) == 3.5
    assert sum_of(x, 0.5, 1.0) == 4.5 and sum_of(x, 0.5, 2.0) == 5.5
    x[0] = 3.0  # the same array with another number, another array, another length
    assert (sum_of(x, 0.5, 2.0), sum_of(x.copy(), 0.5, 2.0), sum_of(np.ones(9), 0.5, 2.0)) == (6.5, 6.5, 6.5)


def test_a_bound_function_refuses_arguments_of_other_types(index):
    built((scaled, np.ones(2), 1.0, None))
    sum_of = bound(scaled)
    assert sum_of(np.ones(2), 1.0, None) == sum_of(np.ones(2), 1, None) == 2.0
    for other in (np.ones(2, int), np.ones((2, 2))[:, 0], [1.0, 1.0], 1.0):
        with pytest.raises(TypeError):
            sum_of(other, 1.0, None)
    with pytest.raises(TypeError):
        sum_of(np.ones(2), "1", None)
    assert sum_of(np.ones(3), 2.0, None) == 6.0
    for others in ((1.0, 1.0), (1.0,), (1.0, None, None)):
        with pytest.raises(TypeError):
            sum_of(np.ones(2), *others)
    constant = np.ones(2)
    constant.flags.writeable = False
    assert sum_of(constant, 1.0, None) == 2.0


def test_an_argument_as_by_default_is_compiled_as_if_left_out():
    x = np.ones(2)
    assert scaled(x, 1.0) == 2.0
    before = len(scaled.dispatcher.overloads)
    assert bound(scaled)(x, 1.0, None) == 2.0
    assert len(scaled.dispatcher.overloads) == before
    scaled._dispatcher = None


def test_what_is_not_compiled_is_bound_as_it_is():
    assert bound(scaled.py_func) is scaled.py_func


def test_a_bound_function_travels_to_another_process():
    state = np.arange(9.0)
    sent = pickle.loads(pickle.dumps(bound(in_model_range)))
    assert sent(state, 0.5) == in_model_range(state, 0.5)


def test_a_compiled_function_is_pickled_by_its_name():
    from hsv.elementary import sine

    assert isinstance(sine, CompiledFunction) and pickle.loads(pickle.dumps(sine)) is sine
    assert sine.__doc__ and sine.__name__ == "sine"


def test_the_library_of_the_set_up_takes_no_elementary_function_from_the_system():
    index = json.loads(precompiled.INDEX.read_text())
    library = precompiled.INDEX.with_name(index["library"])
    listed = subprocess.run(["nm", "-D", "--undefined-only", library], capture_output=True, text=True, check=True)
    names = [line.split()[-1] for line in listed.stdout.splitlines()]
    assert names and not [name for name in names if not name.startswith(SYSTEM)]


@pytest.mark.parametrize("words", [("trim",), ("simulate", "case1")])
def test_commands_do_not_import_numba(words):
    assert imported(words).isdisjoint({"numba", "llvmlite", "scipy"})


@pytest.mark.parametrize("words", [("--help",), ("trim", "--help"), ("simulate", "--help")])
def test_help_imports_neither_numpy_nor_numba(words):
    assert imported(words).isdisjoint({"numpy", "numba", "llvmlite", "yaml"})


def imported(words):
    """Return the names of the packages that a command imports."""
    program = (
        "import sys; from hsv.cli.main import main\n"
        "try: main()\n"
        "finally: print(*{name.partition('.')[0] for name in sys.modules}, file=sys.stderr)"
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    ran = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, env=environment)
    assert ran.returncode == 0, ran.stderr
    return {*ran.stderr.split()}


@pytest.mark.parametrize("change", ["content", "another module", "name", "a table"])
def test_the_state_of_the_sources_tells_all_their_changes(change, tmp_path, monkeypatch):
    monkeypatch.setattr(precompiled, "PACKAGE", tmp_path)
    monkeypatch.setattr(precompiled, "IMPORTED_AT", time.time_ns() + 10**12)
    source = tmp_path / "source.py"
    source.write_text("a = 1\n")
    before = precompiled.state_of_sources()
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "source.pyc").touch()
    (tmp_path / ".source.py.swp").touch()
    (tmp_path / ".#source.py").symlink_to("somebody@here:1")  # Emacs
    assert before and precompiled.state_of_sources() == before
    if change == "content":
        source.write_text("a = 2\n")
    elif change == "name":
        source.rename(source.with_name("other.py"))
    else:
        (tmp_path / "more").mkdir()
        (tmp_path / "more" / ("more.toml" if change == "a table" else "more.py")).touch()
    assert precompiled.state_of_sources() != before


def test_sources_that_were_changed_after_the_import_have_no_state(tmp_path, monkeypatch):
    monkeypatch.setattr(precompiled, "PACKAGE", tmp_path)
    source = tmp_path / "source.py"
    source.write_text("a = 1\n")
    changed = source.stat().st_ctime_ns
    os.utime(source, (0, 0))  # as what is unpacked
    monkeypatch.setattr(precompiled, "IMPORTED_AT", changed + 10**12)
    assert precompiled.state_of_sources()
    monkeypatch.setattr(precompiled, "IMPORTED_AT", changed - 10**9)
    assert precompiled.state_of_sources() is None
