"""The documentation's generated reference lists every command, message and package."""

import pkgutil
import re
from pathlib import Path

from typer.main import get_command

import hsv
import site_pages
from hsv.cli.entry import COMMANDS
from hsv.cli.main import application

ROOT = Path(__file__).parents[2]


def test_every_command_has_a_section_with_all_its_options():
    page = site_pages.commands()
    found = dict(re.findall(r"^#{2,4} `(hsv.*?)`$(.*?)(?=^#{2,4} |\Z)", page, re.DOTALL | re.MULTILINE))

    def check(name, command):
        section = found.pop(name)
        for parameter in command.params:
            word = parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar or parameter.name
            assert word in section, f"{name}: {word}"
        for child, below in getattr(command, "commands", {}).items():
            check(f"{name} {child}", below)

    check("hsv", get_command(application(COMMANDS)))
    assert found == {}
    assert "...\n" not in re.sub(r"^\$ .*", "", page, flags=re.MULTILINE)


def test_every_package_and_module_of_the_library_is_on_its_page():
    page = (ROOT / "docs" / "reference" / "modules.md").read_text(encoding="utf-8")
    listed = re.findall(r"^   (hsv\.\w+)$", page, re.MULTILINE)
    # The package's own names are documented on another page.
    there = {f"hsv.{module.name}" for module in pkgutil.iter_modules(hsv.__path__)} - {"hsv.api"}
    assert {*listed} == there and len(listed) == len(there)
    assert "hsv.design.sets.invariant_set" in site_pages.modules_of("hsv.design")
    assert site_pages.modules_of("hsv.base.units") == []
