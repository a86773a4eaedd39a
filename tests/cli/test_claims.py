import pytest
from hsv.cli.claims import _print_claims, _print_ranking

from hsv.base.units import UnitSystem
from hsv.cli.output import console
from hsv_paper.claims.catalogue import GROUPS
from hsv_paper.claims.claim import Judged
from hsv_paper.claims.finding import Finding, Reading
from hsv_paper.claims.ranking import CONTROLLERS, METRICS, Rank

FINDING = Finding((Reading("first", 0.5, "1", at_most=1.0), Reading("second", 2.0, "1", at_most=1.0)), "It is so.")


@pytest.fixture
def judged(monkeypatch):
    monkeypatch.setattr(console, "width", 80)
    return {group: [Judged(claim, FINDING) for claim in claims] for group, claims in GROUPS.items()}


def test_every_claim_is_one_whole_line_of_a_terminal(judged, capsys):
    _print_claims(judged, verbose=False, units=UnitSystem.paper)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    for claims in GROUPS.values():
        for claim in claims:
            [line] = [line for line in lines if line.startswith(f"{claim.name} ")]
            assert line.endswith("holds under conditions")
    assert len(lines) == len(GROUPS) + sum(map(len, GROUPS.values())) + 2


def test_details_are_printed_when_asked_for(judged, capsys):
    _print_claims(judged, verbose=True, units=UnitSystem.paper)
    printed = " ".join(capsys.readouterr().out.split())
    assert "* yes first: 0.5 (at most 1) no second: 2 (at most 1) It is so." in printed
    assert all(claim.quote in printed for claims in GROUPS.values() for claim in claims)


def test_the_ranking_fits_a_terminal(judged, capsys):
    _print_ranking(
        {metric: {name: Rank(123456.0, 2e5, 1, 2) for name in CONTROLLERS} for metric in METRICS}, UnitSystem.paper
    )
    printed = capsys.readouterr().out
    assert "…" not in printed
    assert printed.count("nominal") == printed.count("worst") == len(METRICS) + 1
