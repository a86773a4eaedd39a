"""The hosted CI and its steps on one machine are one list; and other files for people who host the project."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from ci_local import CHECKOUT, SUITES, Run, Step, reason_not_to, runs

ROOT = Path(__file__).parents[2]
WORKFLOW = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8"))


def test_every_step_of_the_workflow_is_listed_in_its_order() -> None:
    expected = []
    for job in WORKFLOW["jobs"].values():
        for entry in job["strategy"]["matrix"]["include"]:
            assert set(entry) == {"system", "container"}
            name = job["name"].replace("${{ matrix.system }}", entry["system"])
            expected += [f"{name}: {step['name']}" for step in job["steps"]]
    command = [sys.executable, str(ROOT / "tools" / "ci_local.py"), "--list"]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert [": ".join(line.split(": ")[:2]) for line in listed] == expected


def test_runs_are_the_systems_that_the_bench_supports() -> None:
    found = {(run.name.partition(",")[0], run.image) for run in runs(WORKFLOW)}
    assert found == {
        ("Bench", "debian:12"),
        ("Bench", "ubuntu:24.04"),
        ("Bench", "ros:jazzy-ros-base"),
        ("Package", "debian:12"),
        ("Package", "ubuntu:24.04"),
    }
    steps = [step for run in runs(WORKFLOW) for step in run.steps]
    assert all(bool(step.script) != bool(step.action) for step in steps)
    assert {step.action.split("@")[0] for step in steps if step.action} == {CHECKOUT}
    assert any(".ci/run" in step.script for step in steps)
    assert "${{" not in str(steps), "an expression of the host in a step, which nobody fills in here"


def test_what_cannot_be_run_has_a_reason() -> None:
    run = Run("x", "debian:12", (Step("Keep", "", "actions/upload-artifact@v4"),))
    assert "actions/upload-artifact@v4" in (reason_not_to(run) or "")
    for run in runs(WORKFLOW):
        if run.image not in SUITES:
            assert run.image in (reason_not_to(run) or "")


def test_the_development_container_builds_a_stage_of_the_dockerfile() -> None:
    container = json.loads((ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    dockerfile = (ROOT / ".devcontainer" / container["build"]["dockerfile"]).resolve()
    stages = re.findall(r"^FROM \S+ AS (\w+)$", dockerfile.read_text(encoding="utf-8"), re.MULTILINE)
    assert container["build"]["target"] in stages


def test_hooks_check_what_make_lint_checks() -> None:
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    assert repository["repo"] == "local"
    hooks = {hook["name"]: re.compile(hook["files"]) for hook in repository["hooks"]}
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert set(hooks) == {"ruff check", "ruff format", "mypy"}
    assert all(f"{name} " in makefile or f"{name}\n" in makefile for name in hooks)
    sources = re.search(r"^PYTHON_SOURCES := (.*)$", makefile, re.MULTILINE)
    assert sources
    for folder in sources[1].split():
        assert all(hooks[name].match(f"{folder}/x.py") for name in ("ruff check", "ruff format"))


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("[!c]*.yml")), ids=lambda p: p.stem)
def test_a_form_for_issues_has_what_a_form_needs(path: Path) -> None:
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= set(form)
    fields = [field["id"] for field in form["body"]]
    assert len(fields) == len(set(fields))
    assert all(
        field["type"] in ("input", "textarea", "dropdown") and field["attributes"]["label"] for field in form["body"]
    )
