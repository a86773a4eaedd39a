"""Run the steps of the hosted CI, .github/workflows/ci.yml, on this machine: what "make ci-local" does.

    python3 tools/ci_local.py                      # every job, every entry of its matrix
    python3 tools/ci_local.py --only "debian 12"   # those whose name contains this
    python3 tools/ci_local.py --tests "-k trim"    # where tests are run, these instead of all
    python3 tools/ci_local.py --list               # the steps, and where each is run

Every entry of a matrix gets a root of its own: a fresh system of its distribution in a folder below .ci-local, made by
mmdebstrap, without anything of this machine but its network. Its steps run there one by one, as root, in namespaces for
mounts and processes, on a clone of the last commit. The steps are read from the workflow, so there is no second list.
What cannot be run here is named, with the reason.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from hsv_setup.paths import ROOT

WORKFLOW = ROOT / ".github" / "workflows" / "ci.yml"
FOLDER = ROOT / ".ci-local"
SUITES = {"debian:12": "bookworm", "ubuntu:24.04": "noble"}
"""By image of the workflow: the suite of which mmdebstrap makes the same system."""

COMPONENTS = {"bookworm": "main", "noble": "main,universe"}
"""By suite: the components of its archive that the image has, as far as the steps need them."""

CHECKOUT = "actions/checkout"
_PLACE = "checkout"
"""Folder of the clone, below the root."""

_HANDED_ON = re.compile(r"PIP_((EXTRA_)?INDEX_URL|CERT)|(?i:https?_proxy|no_proxy)")
"""Variables that say how this machine reaches a package index."""

_CERTIFICATES = "usr/local/share/ca-certificates"
"""What this machine trusts beside its distribution's authorities; the package ca-certificates takes it from there."""

# /dev/shm is a new one, so that DDS meets no other graph's segments.
_ENTER = """
root=$1; shift
mount -t proc proc "$root/proc" && mount --rbind /sys "$root/sys" && mount --rbind /dev "$root/dev" \
    && mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm" || exit 125
exec chroot "$root" /usr/bin/env -i "$@"
"""


class CannotRunError(Exception):
    """A run is not possible on this machine; one line says why."""


@dataclass(frozen=True)
class Step:
    """A step of a job: what a shell runs, or the action that is used."""

    name: str
    script: str
    action: str


@dataclass(frozen=True)
class Run:
    """A job with one entry of its matrix."""

    name: str
    image: str
    steps: tuple[Step, ...]

    @property
    def folder(self) -> Path:
        """The root of the run."""
        return FOLDER / re.sub(r"[^a-z0-9]+", "-", self.name.lower())


def runs(workflow: dict[str, Any]) -> Iterator[Run]:
    """Return every job of a workflow with every entry of its matrix, in its order."""
    for job in workflow["jobs"].values():
        for entry in job["strategy"]["matrix"]["include"]:
            steps = tuple(Step(step["name"], step.get("run", ""), step.get("uses", "")) for step in job["steps"])
            yield Run(_filled(job["name"], entry), _filled(job["container"], entry), steps)


def _filled(text: str, entry: dict[str, str]) -> str:
    return re.sub(r"\$\{\{ matrix\.(\w+) \}\}", lambda found: entry[found[1]], text)


def reason_not_to(run: Run) -> str | None:
    """Return why ``run`` cannot be run on this machine, as far as that is known beforehand; None if it can."""
    if run.image not in SUITES:
        return f"no root like the image {run.image} can be made without a container engine"
    if unknown := [step.action for step in run.steps if step.action and step.action.split("@")[0] != CHECKOUT]:
        return f"the actions {', '.join(unknown)} run on the host of the CI only"
    if os.geteuid() != 0:
        return "needs root, for namespaces and mounts"
    if absent := [program for program in ("mmdebstrap", "unshare", "chroot") if shutil.which(program) is None]:
        return f"needs {', '.join(absent)}: sudo apt-get install mmdebstrap util-linux coreutils"
    return None


def make_root(run: Run, log: Path) -> None:
    """Make the root of a run anew.

    Raises:
        CannotRunError: mmdebstrap failed, as without an archive or key of the distribution.
    """
    shutil.rmtree(run.folder, ignore_errors=True)
    with log.open("w") as stream:
        suite = SUITES[run.image]
        command = [
            "mmdebstrap",
            "--variant=minbase",
            "--include=apt",
            f"--components={COMPONENTS[suite]}",
            suite,
            str(run.folder),
        ]
        done = subprocess.run(command, stdout=stream, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
    if done.returncode:
        said = [line for line in log.read_text(errors="replace").splitlines() if line.startswith("E:")]
        raise CannotRunError(f"mmdebstrap {suite}: {said[-1] if said else f'exit code {done.returncode}'}")
    shutil.copyfile("/etc/resolv.conf", run.folder / "etc" / "resolv.conf")
    if (certificates := Path("/") / _CERTIFICATES).is_dir():
        shutil.copytree(certificates, run.folder / _CERTIFICATES, dirs_exist_ok=True)


def run_step(run: Run, step: Step, tests: str, log: Path) -> int:
    """Run a step in the root of its run, with ``tests`` for "make test" to choose by; return its exit code."""
    with log.open("a") as stream:
        stream.write(f"\n==> {step.name}\n")
        stream.flush()
        if step.action:
            command = ["git", "clone", "--quiet", "--no-hardlinks", str(ROOT), str(run.folder / _PLACE)]
        else:
            variables = {name: value for name, value in os.environ.items() if _HANDED_ON.fullmatch(name)}
            variables |= {"CI": "true", "HOME": "/root", "LANG": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
            variables |= {"ARGS": tests} if tests else {}
            variables["PATH"] = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
            command = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", _ENTER, "sh"]
            command += [str(run.folder), *(f"{name}={value}" for name, value in variables.items())]
            place = f"mkdir -p /{_PLACE} && cd /{_PLACE} && exec bash --noprofile --norc -eo pipefail -c "
            command += ["bash", "-c", f'{place} "$1"', "bash", step.script]
        return subprocess.run(command, stdout=stream, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL).returncode


def run_steps(run: Run, tests: str) -> bool:
    """Run the steps of a run, with the tests chosen by ``tests``, until one fails; return whether none has.

    Raises:
        CannotRunError: The root cannot be made.
    """
    log = run.folder.with_suffix(".log")
    make_root(run, log)
    try:
        for step in run.steps:
            start = time.monotonic()
            code = run_step(run, step, tests, log)
            outcome = f"failed with exit code {code}, see {log.relative_to(ROOT)}" if code else "passed"
            print(f"{run.name}: {step.name}: {outcome} ({time.monotonic() - start:.0f} s)", flush=True)
            if code:
                return False
    finally:
        shutil.rmtree(run.folder, ignore_errors=True)
    return True


def main() -> int:
    """Run what is asked for; return 0 if something ran and nothing failed, else 1."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="TEXT", help="only the runs whose name contains this")
    parser.add_argument("--tests", default="", metavar="ARGS", help="what make test gives to pytest (all tests)")
    parser.add_argument("--list", action="store_true", help="print the steps, and why a run cannot be run here")
    arguments = parser.parse_args()
    workflow = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))
    chosen = [run for run in runs(workflow) if arguments.only.lower() in run.name.lower()]
    if arguments.list:
        for run in chosen:
            where = reason_not_to(run) or f"a root of {SUITES[run.image]}"
            for step in run.steps:
                print(f"{run.name}: {step.name}: {where}")
        return 0
    FOLDER.mkdir(exist_ok=True)
    passed = {}
    for run in chosen:
        try:
            if reason := reason_not_to(run):
                raise CannotRunError(reason)
            passed[run.name] = run_steps(run, arguments.tests)
        except CannotRunError as error:
            print(f"{run.name}: not run here: {error}", flush=True)
    tests = f", of make test only {arguments.tests}" if arguments.tests else ""
    print(f"{sum(passed.values())} of {len(chosen)} runs passed{tests}, {len(chosen) - len(passed)} not run here")
    return 0 if passed and all(passed.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
