"""Seed small faults one at a time and report which test detects each; half of the faults are in C.

The tests of the parameter page belong to every module that declares parameters.

python3 tests/seeded_faults.py REPORT.jsonl [COUNT] continues a report that exists.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIBRARY = ROOT / "src" / "hsv"
GROUPS = {
    "vehicle": ("vehicle atmosphere actuators sensors", "model/*.py model/lpv/*.py", "model"),
    "control": ("notch_filter estimator nominal tube_law effectiveness", "control/*.py", "control"),
    "faults": ("faults", "model/faults/*.py", "model/faults"),
    "flight": ("loop links metrics", "flight/*.py", "flight"),
}
"""Headers of the core, Python sources, folder of their tests; C faults also run tests/core and golden flights."""
OPERATORS = {"+": "-", "*": "/", "<": "<=", ">": ">=", "==": "!=", "&&": "||", "and": "or"}
OPERATORS |= {new: old for old, new in OPERATORS.items()}
TOKEN = re.compile(r"(?<= )(?:[-+*/<>]|[<>=!]=|&&|\|\||and|or)(?= )|(?<![\w.])\d+(?:\.\d*(?:e[-+]?\d+)?)?(?![\w.])")

HIDDEN = {
    ".h": r'(?ms)/\*.*?\*/|"[^"\n]*"|^#[^\n]*',
    ".py": r'''(?s)""".*?"""|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|#[^\n]*''',
}
"""Comments, strings and directives, found alike in every Python version, whose tokens of f-strings differ."""


@cache
def places(path: Path) -> list[tuple[Path, int, str]]:
    """Return every token of a file that a fault may change."""
    text = path.read_text()
    hidden = [match.span() for match in re.finditer(HIDDEN[path.suffix], text)]
    found = [(path, match.start(), match[0]) for match in TOKEN.finditer(text)]
    return [entry for entry in found if not any(begin <= entry[1] < end for begin, end in hidden)]


def changed(token: str) -> str:
    """Return the opposite operator, the next integer, or a number that is off by 1 %."""
    if token in OPERATORS:
        return OPERATORS[token]
    return str(int(token) + 1) if token.isdigit() else repr(float(token) * 1.01 or 0.01)


def faults(count: int) -> list[tuple[str, Path, int, str]]:
    """Draw the faults: group, file, position in its text, and the token there."""
    draw, found = random.Random(1), []
    for number in range(count):
        group = [*GROUPS][number // 2 % len(GROUPS)]
        headers, modules, _ = GROUPS[group]
        patterns = modules.split() if number % 2 else [f"core/{name}.h" for name in headers.split()]
        files = sorted(path for pattern in patterns for path in (LIBRARY / "hsv").glob(pattern))
        left = [entry for path in files for place in places(path) if (entry := (group, *place)) not in found]
        found.append(draw.choice(left))
    return found


def detected(group: str, path: Path, place: int, token: str) -> str:
    """Seed one fault in a copy of the library; return the first test that fails, or "" if all pass."""
    with tempfile.TemporaryDirectory(prefix="hsv_fault_") as folder:
        copy = Path(folder, "hsv")
        shutil.copytree(LIBRARY, copy, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
        file, text = copy / path.relative_to(LIBRARY), path.read_text()
        file.write_text(text[:place] + changed(token) + text[place + len(token) :])
        environment = os.environ | {"PYTHONPATH": f"{copy}:{os.environ.get('PYTHONPATH', '')}", "HSV_CFLAGS": "-O0"}
        room = Path("tests", GROUPS[group][2])
        tests = [*map(str, (ROOT / room).glob(f"test_{path.stem}.py")), str(room)]
        if re.search(r"\b(?:Parameter|FaultParameter|Field)\(", text):
            tests.insert(-1, "tests/graph/test_documentation.py")
        if path.suffix == ".h":
            tests = ["tests/flight/test_golden_flights.py", *tests, "tests/core"]
            build = [sys.executable, "setup.py", "-q", "build_ext", "--inplace", "--force"]
            if subprocess.run(build, cwd=copy, env=environment, capture_output=True).returncode:
                return "it does not compile"
        words = ["timeout", "3600", sys.executable, "-m", "pytest", "-qx", "-m", "not (long or graph or fuzz)", *tests]
        ran = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True)
        failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - |$)", ran.stdout, re.MULTILINE)
        return failed[1] if failed else f"exit code {ran.returncode}" if ran.returncode else ""


if __name__ == "__main__":
    with Path(sys.argv[1]).open("a+") as stream:
        stream.seek(0)
        for group, path, place, token in faults(int((sys.argv[2:] or ["100"])[0]))[len(stream.readlines()) :]:
            line = path.read_text()[:place].count("\n") + 1
            where = f"{path.relative_to(ROOT)}:{line}: {token} -> {changed(token)}"
            result = {"fault": where, "detected_by": detected(group, path, place, token)}
            print(json.dumps(result), file=stream, flush=True)
