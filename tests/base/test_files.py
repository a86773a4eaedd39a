"""Files and texts with errors give a one-line message in bounded time; files can extend other files."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from hsv.base.errors import DesignError, DocumentError, ScenarioError
from hsv.base.files import MAX_BYTES, MAX_LEVELS, parse_json, parse_toml, parse_yaml, read_bytes, read_text
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.scenario import load_scenario


def test_a_text_is_read_without_its_byte_order_mark_and_the_line_ends_of_windows(tmp_path):
    path = tmp_path / "case.toml"
    path.write_bytes("\ufeffextends = 'Ünits'\r\nduration = '6 s'\r\n".encode())
    assert read_text(path) == "extends = 'Ünits'\nduration = '6 s'\n"


def test_numbers_of_yaml_are_those_of_ros():
    text = "[5665e-11, 1e5, -2E+4, .5e2, 1.5e3, 1e5x, e5, '1e5', 10]"
    assert parse_yaml(text) == [5665e-11, 1e5, -2e4, 50.0, 1500.0, "1e5x", "e5", "1e5", 10]


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(DocumentError, match=r"^cannot be read \(not a regular file\)$"):
            read_bytes(path)


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("absent", None, "No such file or directory"),
        (".", None, "Is a directory"),
        ("\0", None, "a zero byte in its name"),
        ("latin", b"\xe4", "not text"),
        ("large", b"x" * (MAX_BYTES + 1), f"more than {MAX_BYTES} bytes"),
    ],
)
def test_what_cannot_be_read_says_why(tmp_path, name, content, why):
    if content:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(DocumentError) as caught:
        read_text(tmp_path / name)
    assert str(caught.value) == f"cannot be read ({why})"


@pytest.mark.parametrize(
    ("parse", "opening", "closing"),
    [
        (parse_toml, "['a' . " + '"b". ' * 100_000, "b]"),
        (parse_toml, "a = " + "[" * (MAX_LEVELS + 1), "]" * (MAX_LEVELS + 1)),
        (parse_json, "[" * 100_000, "]" * 100_000),
        (parse_yaml, "[" * 100_000, "]" * 100_000),
    ],
)
def test_deep_nesting_is_refused(parse, opening, closing):
    with pytest.raises(DocumentError, match=f"nested more than {MAX_LEVELS} levels deep"):
        parse(opening + closing)


@pytest.mark.parametrize("text", ["a: &a [*a]", "&a {b: *a}", "a: &a {b: [1, {c: *a}]}"])
def test_an_alias_inside_its_own_value_is_refused(text):
    message = r"the alias '[ab]' refers to a value that contains it at line 1, column \d+$"
    with pytest.raises(DocumentError, match=message):
        parse_yaml(text)


def test_aliases_that_multiply_are_refused_and_others_taken():
    bomb = "x0: &x0 [1]\n" + "".join(f"x{i}: &x{i} [{', '.join([f'*x{i - 1}'] * 9)}]\n" for i in range(1, 30))
    with pytest.raises(DocumentError, match="more than 1000000 values"):
        parse_yaml(bomb)
    assert parse_yaml("a: &a {b: 1}\nc: *a\nd: {<<: *a, e: 2}") == {"a": {"b": 1}, "c": {"b": 1}, "d": {"b": 1, "e": 2}}


@pytest.mark.parametrize(
    ("parse", "text", "why"),
    [
        (parse_yaml, "period: 0.02\nperiod: 0.03", "the key 'period' occurs twice at line 2, column 1"),
        (parse_json, '[{"a": 1, "b": 2, "a": 1}]', "the key 'a' occurs twice"),
        (parse_yaml, "a: !!python/object/apply:os.system [ls]", "could not determine a constructor"),
        (parse_toml, f"a = {'9' * 5000}", "Exceeds the limit"),
        (parse_toml, f"a = 0x{'f' * 5000}", "a whole number of more than 4000 digits"),
        (parse_json, "[1, 2", "Expecting"),
        (parse_toml, " " * (MAX_BYTES + 1), f"more than {MAX_BYTES} bytes"),
    ],
)
def test_a_text_that_is_none_is_one_line_of_why(parse, text, why):
    with pytest.raises(DocumentError) as caught:
        parse(text)
    assert why in str(caught.value) and "\n" not in str(caught.value)


def test_numbers_with_many_points_on_a_line_are_no_nested_key():
    assert parse_toml(f"a = [{', '.join(['1.5'] * 500)}]") == {"a": [1.5] * 500}
    assert parse_toml(f"a = '{'A sentence of words. ' * 500}'") == {"a": "A sentence of words. " * 500}


def test_tables_are_merged_lists_replaced_and_limits_are_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    own = (
        '[vehicle.perturbation]\nmass = "+7 %"\n[[command]]\naltitude_change = "10 ft"\n[limits]\nsaturated_steps = 3\n'
    )
    path.write_text(f'extends = "case1_uncertain"\ntitle = "mine"\n{own}')
    base, mine = load_scenario("case1_uncertain"), load_scenario(str(path))
    assert mine.vehicle.perturbation == base.vehicle.perturbation | {"mass": 0.07}
    assert len(base.command) == len(mine.command) == 1 and mine.command[0].velocity_change == 0.0
    assert mine.limits == {"saturated_steps": 3.0}
    assert (mine.initial, mine.fault, mine.design) == (base.initial, base.fault, base.design)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("extends = 3\n", r"scenario 'mine': extends = 3: expected a name or the path of a file"),
        ('extends = "cas1"\n', r"scenario 'cas1': expected a path or one of"),
        ('extends = "mine.toml"\n', r"scenario 'mine': extends: .*mine.toml extends .*mine.toml, expected files that"),
        ('extends = "case1"\ndruation = "3 s"\n', r"scenario 'mine': druation: unknown key"),
    ],
)
def test_what_cannot_be_extended_is_named(tmp_path, text, message):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=message):
        load_scenario(str(path))


def test_designs_extend_designs(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('extends = "baseline"\nname = "mine"\n[nominal]\nscales = [1.0, 0.5]\n')
    base, mine = (read_inputs(each).model_dump() for each in (find_inputs("baseline"), path))
    assert mine["nominal"].pop("scales") == [1.0, 0.5] and base["nominal"].pop("scales")
    assert mine == base | {"name": "mine"}
    path.write_text('extends = "absent"\n')
    with pytest.raises(DesignError, match="design = 'absent': no such file"):
        read_inputs(path)
