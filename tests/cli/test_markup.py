"""What a user or a node wrote is printed as it stands, whatever it looks like to the library that prints it."""

import io

from hsv.base.units import UnitSystem
from hsv.cli import output
from hsv.cli.output import print_section

NAME = "run[old] [/x] :bug:"


def test_lines_of_nodes_and_titles_are_printed_as_they_are(capsys):
    output.report_line("plant", f"[WARN] {NAME}")
    output.report_error(NAME)
    output.report_line("hsv: warning", NAME)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"plant: [WARN] {NAME}", f"hsv: error: {NAME}", f"hsv: warning: {NAME}"]
    output.print_table(NAME, {"altitude": (1.0, "m")}, UnitSystem.si)
    assert capsys.readouterr().out.splitlines()[0].strip() == NAME
    print_section(NAME, {NAME: NAME})
    title, line = capsys.readouterr().out.splitlines()
    assert title == NAME and line.split("  ")[1:] == [NAME, NAME]


def test_control_characters_are_shown_and_not_sent_to_the_terminal(capsys):
    title = "\x1b[31mred\x1b]0;title\x07 \x9b2J \x08\r\x7f\u202e\u200b\u2028\u2066\tend"
    terminal = type(output.console)(file=io.StringIO(), force_terminal=True, highlight=False, width=200)
    terminal.print(title, soft_wrap=True)
    output.report_error(title)
    for shown in (terminal.file.getvalue(), capsys.readouterr().err):
        assert not set("\x1b\x07\x08\x9b\x7f\r\u202e\u200b\u2028\u2066") & set(shown)
        assert r"\x1b[31mred\x1b]0;title" in shown and r"\x9b2J" in shown
