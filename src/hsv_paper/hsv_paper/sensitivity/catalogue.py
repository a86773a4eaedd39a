"""All studies by name, and the page of one."""

from __future__ import annotations

from hsv_paper.limits import study as limits
from hsv_paper.sensitivity import coupling, factor, fault, hardware, notch, parameters, ramp, sampling, weights
from hsv_paper.sensitivity.study import Outcome, Study

STUDIES: dict[str, Study] = {
    m.STUDY.name: m.STUDY
    for m in (coupling, sampling, notch, parameters, fault, weights, ramp, factor, hardware, limits)
}

_PAGE = """# {kind}: {title}
Made by `hsv-paper sensitivity {name} --out docs/study`, including all numbers.

![{title}]({name}.png)

{shows}

{findings}
"""


def page(study: Study, outcome: Outcome) -> str:
    """Return the page in Markdown."""
    findings = "\n".join(f"- {finding[0].upper()}{finding[1:]}." for finding in outcome.findings)
    return _PAGE.format(kind=study.kind, title=study.title, name=study.name, shows=outcome.shows, findings=findings)
