"""Code that decides a flight, in Python and in C, uses only exact operations and our own elementary functions."""

import ast
import os
import re
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path

import hsv
from hsv.core import _core

SOURCES = Path(hsv.__file__).parent

HARMLESS = re.compile(r"sqrt|memcmp|memcpy|memmove|memset|_?Py\w+|__\w+|_ITM_\w+")
"""C library functions with a unique result, and functions that Python, the compiler or the linker add."""

FROM_ELSEWHERE = re.compile(r"sqrt|memcmp|memcpy|memmove|memset|_GLOBAL_OFFSET_TABLE_|__cpu_model|__stack_chk_fail")
"""Symbols that the core's own object code may leave to the linker: nothing of the compiler's run-time library that
computes, such as the complex division __divdc3, which libraries round differently."""

MATH = {"isfinite", "isnan", "inf", "nan", "pi", "ceil", "floor", "isqrt", "radians"}
"""Permitted names of :mod:`math`; radians() is a product with pi / 180."""

EXACT_NUMPY = {
    *("ndarray", "float64", "int64", "complex128", "uint64", "bool_", "intp", "inf", "nan", "finfo", "pi", "newaxis"),
    *("array", "asarray", "ascontiguousarray", "empty", "empty_like", "zeros", "zeros_like", "ones", "ones_like"),
    *("full", "eye", "arange", "broadcast_to", "stack", "concatenate", "column_stack", "reshape", "ravel", "copy"),
    *("abs", "sqrt", "floor", "clip", "minimum", "maximum", "max", "min", "argmax", "argmin", "ptp", "round", "diff"),
    *("outer", "partition", "sort", "split", "void", "iscomplexobj"),
    *("all", "any", "isfinite", "isnan", "where", "flatnonzero", "searchsorted", "array_equal", "count_nonzero"),
}
"""Permitted names of numpy: they create, move or compare arrays, or do one exact operation per element."""

INEXACT_METHODS = {"dot", "sum", "mean", "prod", "std", "var", "cumsum", "cumprod", "trace", "reduce", "accumulate"}
"""Methods of arrays and universal functions that add or multiply in an order of their own."""

INEXACT_NAMES = {"sum", "pow", "fsum"}
"""Built-in and math functions that are not exact; sum() of numbers is compensated from Python 3.12 on."""

EXEMPT = {
    "flight/metrics.py": "metrics are computed after the flight",
    "flight/fingerprint.py": "a digest",
    "flight/requirement.py": "margins are computed after the flight",
    "control/design.py": "eigenvalues decide whether a design is refused, not how it flies",
    "certificate/coverage.py": "messages about a flight; no input depends on them",
    "plugins/library.py": "the same",
    "plugins/library_answers.py": "the same",
    "plugins/library_process.py": "the same",
    "plugins/fmu.py": "the same",
    "base/files.py": "reads files",
    "base/processes.py": "signals, threads and progress",
    "base/units.py": "computes with fractions, which are exact",
    "control/nominal_law.py": "calls the core, or solvers, which are outside the rule",
}
"""Files that a flight loads but that need not be exact, with the reason."""


def problems(source: str) -> list[str]:
    """Return the inexact operations in ``source``, as "line: operation"."""
    found: list[tuple[int, str]] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            found.append((node.lineno, "@"))
        elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Pow):
            found.append((node.lineno, "**="))
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not _whole_power(node):
            found.append((node.lineno, "**"))
        elif isinstance(node, ast.Attribute):
            module = node.value.id if isinstance(node.value, ast.Name) else ""
            inexact = {"math": node.attr not in MATH, "np": node.attr not in EXACT_NUMPY}.get(
                module, node.attr in INEXACT_METHODS
            )
            if inexact:
                found.append((node.lineno, f"{module}.{node.attr}"))
        elif isinstance(node, ast.Name) and node.id in INEXACT_NAMES:
            found.append((node.lineno, node.id))
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found += [(node.lineno, name) for name in _imported(node) if _inexact_import(name)]
    return [f"{line}: {what}" for line, what in sorted(found)]


def _imported(node: ast.Import | ast.ImportFrom) -> list[str]:
    if isinstance(node, ast.ImportFrom):
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return [f"{alias.name} as {alias.asname}" if alias.asname else alias.name for alias in node.names]


def _inexact_import(name: str) -> bool:
    package, _, inside = name.partition(".")
    if package in {"scipy", "cmath", "random"} or name.startswith("math as"):
        return True
    return bool(inside) and (package == "numpy" or (package == "math" and inside not in MATH | {"factorial"}))


def _whole_power(node: ast.BinOp) -> bool:
    """Return whether this is an integer to the power of an integer or a counter, which is exact."""
    try:
        if not float(ast.literal_eval(node.left)).is_integer():
            return False
    except ValueError:
        return False
    if isinstance(node.right, ast.Name):
        return not isinstance(ast.literal_eval(node.left), float)
    try:
        exponent = ast.literal_eval(node.right)
    except ValueError:
        return False
    return float(exponent).is_integer() and exponent >= 0


FLY = """
import sys
import hsv.flight.distribution
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.governed import governed
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import FlightGroup
for name in ("case2", "case1_rmpc"):
    fly(assemble_flight(load_scenario(name).model_copy(update={"duration": 4.0})))
files = [getattr(module, "__file__", None) or "" for name, module in sys.modules.items() if name.startswith("hsv.")]
print(*[file for file in files if file.endswith(".py") and "__init__" not in file], sep="\\n")
"""


def test_sources_of_a_flight_use_exact_operations():
    done = subprocess.run([sys.executable, "-c", FLY], capture_output=True, text=True, check=True)
    loaded = {str(Path(line).resolve().relative_to(SOURCES.resolve())) for line in done.stdout.splitlines()}
    assert {"flight/closed_loop.py", "model/trim.py", "control/governor.py", *EXEMPT} <= loaded
    inexact = {file: problems((SOURCES / file).read_text(encoding="utf-8")) for file in loaded - EXEMPT.keys()}
    assert {file: found for file, found in inexact.items() if found} == {}


def inexact_symbols(library: Path) -> list[str]:
    """Return the names of inexact functions that ``library`` imports."""
    command = ["nm", "--dynamic", "--undefined-only", "--format=posix", str(library)]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    names = [line.split()[0].partition("@")[0] for line in listed.splitlines()]
    assert names
    return [name for name in names if not HARMLESS.fullmatch(name)]


def test_the_core_takes_nothing_inexact_from_elsewhere():
    assert inexact_symbols(Path(_core.__file__)) == []


def test_the_core_computes_nothing_with_the_compilers_library(tmp_path):
    compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC"))
    sources = sorted((SOURCES / "core").glob("*.c"))
    objects = ["-r", "-nostdlib", "-o", str(tmp_path / "core.o"), *map(str, sources)]
    options = ["-std=gnu99", "-O0", "-fPIC", "-fno-math-errno", "-Wno-psabi"]
    subprocess.run([*compiler, *options, *objects], check=True)
    command = ["nm", "--undefined-only", "--format=posix", str(tmp_path / "core.o")]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    names = {line.split()[0] for line in listed.splitlines()}
    assert "memcpy" in names
    assert [name for name in names if not FROM_ELSEWHERE.fullmatch(name)] == []
