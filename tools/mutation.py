"""Test the unit tests by seeded faults in the code: ``make mutation``.

Of all mutations that cosmic-ray knows in the packages vehicle, control and faults, a sample is drawn. Each mutant, one
change to a copy of the checkout, is tried by the tests of its module, then those of its package, without numba's
compilation, up to the first failure. What no test sees survives, and is printed with the reason that
``tests/survivors.toml`` gives, if any.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import itertools
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import clarabel  # noqa: F401
import hypothesis  # noqa: F401
import numba  # noqa: F401
import osqp  # noqa: F401
import pydantic  # noqa: F401
import pytest
import scipy.integrate
import scipy.linalg
import scipy.optimize
import scipy.signal
import scipy.sparse  # noqa: F401
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / ".mutation"
"""Holds the copy of the checkout and the outcome of every mutant."""
SOURCES = Path("src/hsv/hsv")
PACKAGES = ("vehicle", "control", "faults")
EXPLAINED = ROOT / "tests" / "survivors.toml"

MEMORY = 8 << 30
"""Bytes of address space of a test run: a mutant may allocate without end."""
SLOWER = 4.0
"""A mutant that takes so many times the processor time of all tests of its package is in an endless loop."""
LONGEST = 3600
"""Processor time (s) that the tests are given without a mutant."""
OPTIONS = ("-x", "-q", "-m", "not (compiled or long or graph)", "-p", "no:cacheprovider", "--hypothesis-seed=0")


class _Effective(ast.NodeTransformer):
    """Removes what has no effect where nothing is compiled: annotations and numba's decorators."""

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AnnAssign:
        node.annotation = ast.Constant(None)
        self.generic_visit(node)
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        node.returns = None
        node.decorator_list = [each for each in node.decorator_list if "njit" not in ast.unparse(each)]
        self.generic_visit(node)
        return node


def effective(source: str) -> str:
    """Return the syntax tree of Python code without annotations and numba's decorators.

    Raises:
        SyntaxError: It is no Python.
    """
    # What is only no statement, and no syntax, the compiler tells.
    compile(source, "", "exec")
    return ast.dump(_Effective().visit(ast.parse(source)))


@dataclass(frozen=True)
class Mutant:
    """One change: ``line`` of ``module`` (``vehicle/trim.py``) where it begins, lines before and after it, all code."""

    identifier: str
    module: str
    line: int
    before: str
    after: str
    source: str

    def where(self) -> str:
        """Return file and line."""
        return f"{SOURCES / self.module}:{self.line}"

    def tests(self) -> list[list[str]]:
        """Return which tests try it: those of its module, then the others of its package."""
        package, name = self.module.split("/")
        own = f"tests/{package}/test_{name}"
        return [[own], [f"tests/{package}", f"--ignore={own}"]] if Path(own).exists() else [[f"tests/{package}"]]


def _run(tests: list[str], seconds: int, log: Path) -> bool:
    """Return whether the tests pass, within that processor time (s); what they print is in ``log``.

    Libraries are imported before and once: a process forked from this one has them, and imports nothing but hsv.
    """
    process = os.fork()
    if not process:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        with log.open("w") as stream:
            os.dup2(stream.fileno(), 1)
            os.dup2(stream.fileno(), 2)
        os._exit(pytest.main([*OPTIONS, *tests]))
    return os.waitpid(process, 0)[1] == 0


def _copy_checkout(checkout: Path) -> None:
    """Copy what git knows or would take, except recorded runs."""
    listed = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", ":!bags"]
    names = subprocess.run(listed, capture_output=True, text=True, check=True).stdout.split("\0")
    shutil.rmtree(checkout, ignore_errors=True)
    for name in filter(None, names):
        target = checkout / name
        target.parent.mkdir(parents=True, exist_ok=True)
        # What git knows may be deleted, and links within the checkout stay links.
        if os.path.lexists(ROOT / name):
            shutil.copy2(ROOT / name, target, follow_symlinks=False)


def _baseline(log: Path) -> dict[str, int]:
    """Return the processor time (s) that a mutant of each package is given, from that of the tests without one."""
    given = {}
    for package in PACKAGES:
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        if not _run([f"tests/{package}"], LONGEST, log):
            raise SystemExit(f"make mutation: tests/{package} fails without a mutant\n{log.read_text()}")
        used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        given[package] = round(30.0 + SLOWER * used)
        print(f"tests/{package}: {used:.0f} s, {given[package]} s for a mutant", flush=True)
    return given


def _ranked(seed: int) -> list[tuple[str, Any]]:
    """Return every mutation with an identifier, in an order drawn with ``seed``.

    The place of a mutation depends on its line and what it does to it, and not on the rest of the code: while the code
    changes, the sample stays nearly the same.
    """
    from cosmic_ray.commands import init
    from cosmic_ray.work_db import use_db

    lines = {path: path.read_text().splitlines() for package in PACKAGES for path in (SOURCES / package).glob("*.py")}
    with tempfile.TemporaryDirectory() as folder, use_db(Path(folder, "all.sqlite")) as database:
        init(sorted(lines), database, {})
        mutations = [item.mutations[0] for item in database.work_items]
    ranked, known = [], Counter[str]()
    for each in sorted(mutations, key=lambda m: (m.module_path, m.operator_name, m.occurrence)):
        line = lines[each.module_path][each.start_pos[0] - 1].strip()
        what = f"{seed} {each.module_path} {each.operator_name} {line}"
        known[what] += 1
        ranked.append((hashlib.sha256(f"{what} {known[what]}".encode()).hexdigest(), each))
    return sorted(ranked, key=lambda pair: pair[0])


def _sample(seed: int) -> Iterator[Mutant]:
    """Yield mutants in the order drawn with ``seed``, without those that have no effect, or are no Python."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    for identifier, mutation in _ranked(seed):
        source = mutation.module_path.read_text()
        changed = mutate_code(source, get_operator(mutation.operator_name)(), mutation.occurrence)
        try:
            if effective(changed) == effective(source):
                continue
        except SyntaxError:
            continue
        old, new = source.splitlines(), changed.splitlines()
        [(_, start, end, new_start, new_end)] = [
            code for code in SequenceMatcher(None, old, new, False).get_opcodes() if code[0] != "equal"
        ]
        before, after = (" ".join(map(str.strip, part)) for part in (old[start:end], new[new_start:new_end]))
        module = mutation.module_path.relative_to(SOURCES).as_posix()
        yield Mutant(identifier, module, start + 1, before, after, changed)


def main() -> int:
    """Try the sample and print the score; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", type=int, default=300, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1, help="which ones")
    parser.add_argument(
        "--keep-killed",
        action="store_true",
        help="go on: try only those not killed before, with the tests as they are now",
    )
    arguments = parser.parse_args()
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        parser.error("numba compiles: set NUMBA_DISABLE_JIT=1, or say make mutation")

    _copy_checkout(FOLDER / "checkout")
    os.chdir(FOLDER / "checkout")
    copy = str(Path("src/hsv").resolve())
    sys.path.insert(0, copy)
    os.environ["PYTHONPATH"] = f"{copy}:{os.environ.get('PYTHONPATH', '')}"
    code = b"".join(path.read_bytes() for package in PACKAGES for path in sorted((SOURCES / package).glob("*.py")))
    outcomes = FOLDER / f"killed-{hashlib.sha256(code).hexdigest()[:12]}"
    if not arguments.keep_killed:
        outcomes.unlink(missing_ok=True)
    killed = set(outcomes.read_text().split()) if outcomes.exists() else set()

    log = FOLDER / "log"
    given = _baseline(log)
    # What is compiled of a mutant must not be taken for the original.
    sys.dont_write_bytecode = True
    sample = itertools.islice(_sample(arguments.seed), arguments.sample)
    survivors: list[Mutant] = []
    for number, mutant in enumerate(sample, 1):
        outcome = "killed before"
        if mutant.identifier not in killed:
            path = SOURCES / mutant.module
            source, known = path.read_text(), path.stat()
            path.write_text(mutant.source)
            seconds = given[mutant.module.split("/")[0]]
            outcome = "survived" if all(_run(tests, seconds, log) for tests in mutant.tests()) else "killed"
            path.write_text(source)
            os.utime(path, ns=(known.st_atime_ns, known.st_mtime_ns))
            if outcome == "killed":
                with outcomes.open("a") as stream:
                    stream.write(f"{mutant.identifier}\n")
            else:
                survivors.append(mutant)
        print(f"{number}/{arguments.sample} {outcome} {mutant.where()}", flush=True)
    _print_score(arguments.sample, survivors)
    return 0


def _print_score(n: int, survivors: list[Mutant]) -> None:
    reasons = {
        (entry["module"], entry["before"], entry["after"]): entry["reason"]
        for entry in tomllib.loads(EXPLAINED.read_text())["survivor"]
    }
    count = n - len(survivors)
    low, high = binomtest(count, n).proportion_ci(method="wilson")
    print(f"\n{count} of {n} mutants killed: {count / n:.1%} (95 %, Wilson: {low:.1%} to {high:.1%})")
    for mutant in sorted(survivors, key=lambda m: (m.module, m.line)):
        reason = reasons.get((mutant.module, mutant.before, mutant.after), "not explained")
        print(f"\n{mutant.where()}\n- {mutant.before}\n+ {mutant.after}\n  {reason}")


if __name__ == "__main__":
    sys.exit(main())
