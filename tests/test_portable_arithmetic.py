"""What decides a flight is made of exact operations and of our own elementary functions, compiled or not."""

import ast
import inspect
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from compiled_symbols import undefined_symbols
from numba import njit

import hsv

SOURCES = Path(hsv.__file__).parent

EXACT = {"floor", "ceil", "rint", "trunc", "fabs", "sqrt", "memcpy", "memmove", "memset"}
"""Functions of the C library whose result IEEE 754 or their purpose leaves no choice about."""

PYTHON = ("NRT_", "Py", "_Py", "numba_gil_", "numba_unpickle", "numba_do_raise", "numba_runtime_", "numba_complex_")
"""Beginnings of the names by which compiled functions take arguments from Python, raise its errors, get memory."""

ON_THE_PATH = (
    "elementary.py",
    "elimination.py",
    "units.py",
    "vehicle/dynamics.py",
    "vehicle/envelope.py",
    "vehicle/integration.py",
    "vehicle/parameters.py",
    "vehicle/plant.py",
    "vehicle/trim.py",
    "lpv/polytope.py",
    "control/adjustable.py",
    "control/control_law.py",
    "control/controllers.py",
    "control/integral_action.py",
    "control/nominal_law.py",
    "control/nominal_trajectory.py",
    "control/notch_filter.py",
    "control/planned_filter.py",
    "control/reference_trajectory.py",
    "control/robust_mpc.py",
    "control/tube_law.py",
    "control/tube_set.py",
    "faults/actuator.py",
    "simulation/assembly.py",
    "simulation/closed_loop.py",
    "simulation/commands.py",
    "simulation/fields.py",
    "simulation/scenario.py",
)
"""Files that decide a flight, from the scenario's text to the last step."""

MATH = {"isfinite", "isnan", "inf", "nan", "pi", "ceil", "floor", "isqrt", "radians"}
"""Of :mod:`math`; radians() is a product with pi / 180."""

INEXACT_NUMPY = {
    *("linalg", "fft", "matmul", "dot", "vdot", "inner", "einsum", "tensordot", "kron", "cross"),
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "hypot", "sinc", "angle", "unwrap"),
    *("sinh", "cosh", "tanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "power", "float_power", "cbrt"),
    *("sum", "mean", "std", "var", "prod", "cumsum", "cumprod", "average", "trapezoid", "interp", "polyfit", "polyval"),
    *("linspace", "logspace", "geomspace"),
}
"""Of numpy: what goes through BLAS, LAPACK or libm, or adds in an order of its own."""


def problems(source: str) -> list[str]:
    """Return what in ``source`` is not exact, as "line: what"."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            found.append((node.lineno, "@"))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not _whole(node.left):
            found.append((node.lineno, "**"))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module, name = node.value.id, node.attr
            if (module == "math" and name not in MATH) or (module == "np" and name in INEXACT_NUMPY):
                found.append((node.lineno, f"{module}.{name}"))
        if isinstance(node, ast.Attribute) and node.attr in {"dot", "sum", "mean", "prod"}:
            found.append((node.lineno, f".{node.attr}"))
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{name}" for name in names]
        found += [
            (node.lineno, name)
            for name in names
            if name.split(".")[0] in {"scipy", "cmath", "random"}
            or (name.startswith("math.") and name.split(".")[1] not in MATH | {"factorial"})
            or name.startswith("numpy.")
        ]
        if isinstance(node, ast.keyword) and node.arg == "fastmath":
            found.append((node.value.lineno, "fastmath"))
    return [f"{line}: {what}" for line, what in sorted(found)]


def _whole(node: ast.expr) -> bool:
    """Tell whether ``node`` is a whole number written out, or its negative; their powers are exact."""
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return False
    return float(value).is_integer()


@pytest.mark.parametrize("file", ON_THE_PATH)
def test_sources_of_a_flight_use_exact_operations(file):
    assert problems((SOURCES / file).read_text(encoding="utf-8")) == []


def test_no_function_of_the_library_is_compiled_with_fast_math():
    for file in SOURCES.rglob("*.py"):
        assert not [line for line in problems(file.read_text(encoding="utf-8")) if line.endswith("fastmath")], file


@pytest.mark.parametrize(
    "line",
    [
        "import scipy.linalg",
        "from math import sin",
        "from numpy.linalg import solve",
        "x = np.linalg.solve(A, b)",
        "x = A @ b",
        "A @= b",
        "x = A.dot(b)",
        "x = np.exp(y)",
        "x = math.tan(y)",
        "x = y.sum()",
        "x = y**2",
        "x = y**0.5",
        "@njit(fastmath=True)\ndef f(): pass",
    ],
)
def test_what_is_not_exact_is_found_in_a_source(line):
    assert problems(line)


def test_compiled_loop_and_set_up_take_nothing_inexact_from_elsewhere(tmp_path):
    program = Path(inspect.getfile(undefined_symbols))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    listed = subprocess.run([sys.executable, program], env=environment, capture_output=True, text=True, check=True)
    lines = [line.split(": ") for line in listed.stdout.splitlines()]
    functions = {function for function, _ in lines}
    assert {
        "hsv.simulation.closed_loop._fly",
        "hsv.vehicle.trim.balance",
        "hsv.control.reference_trajectory._trimmed",
        "hsv.control.notch_filter.filter_step",
        "hsv.elimination.solve",
        "hsv.elementary.tangent",
        "hsv.faults.actuator.apply_faults",
    } <= functions
    assert [line for line in lines if not _harmless(line[1])] == []


def _harmless(symbol: str) -> bool:
    return symbol == "-" or symbol in EXACT or symbol.startswith(PYTHON)


def test_what_is_not_exact_is_found_in_compiled_code():
    @njit
    def planted(A: np.ndarray, b: np.ndarray) -> float:
        return float(np.linalg.solve(A, b)[0]) + math.sin(b[0])

    planted(np.eye(2), np.ones(2))
    inexact = {symbol for symbol in undefined_symbols(planted) if not _harmless(symbol)}
    assert "sin" in inexact
    assert any("gesv" in symbol for symbol in inexact)
