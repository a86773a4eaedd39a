"""Parameters by node: gathered, written, read back, laid over one another; disagreements are named."""

from __future__ import annotations

from hsv.bags.parameter_sections import ParameterSections, disagreements

NODES = {
    "plant": {"period": 0.02, "duration": 12.0, "controller": "tube_mpc"},
    "tube_mpc": {"period": 0.02, "design.hash": "a", "feedback.tau": [0.9], "feedback.gain": [1.0, -2e-9]},
    "nominal_trajectory": {"period": 0.02, "design.hash": "b", "feedback.tau": [1.0], "feedback.gain": [1.5, 0.0]},
}


def test_every_node_gets_back_its_own() -> None:
    sections = ParameterSections.gathered(NODES)
    again = ParameterSections.parse(sections.to_yaml(), "test")
    assert again == sections
    for node, flat in NODES.items():
        assert flat.items() <= again.of(node).items()
    assert again.shared == {"period": 0.02, "duration": 12.0, "controller": "tube_mpc"}
    assert again.own.keys() == {"tube_mpc", "nominal_trajectory"}


def test_parts_put_together_are_the_whole() -> None:
    sections = ParameterSections.gathered(NODES)
    design = {"design.hash", "feedback.tau", "feedback.gain"}
    first, second = sections.only(design), sections.only(sections.names - design)
    assert first.overlaid(second) == second.overlaid(first) == sections


def test_what_lies_over_holds_for_every_node() -> None:
    sections = ParameterSections.gathered(NODES)
    changed = sections.updated({"feedback.tau": [0.5], "period": 0.01})
    assert all(changed.of(node)["feedback.tau"] == [0.5] and changed.of(node)["period"] == 0.01 for node in NODES)
    over = sections.overlaid(ParameterSections({"design.hash": "c"}, {"tube_mpc": {"period": 0.04}}))
    assert [over.of(node)["design.hash"] for node in NODES] == ["c"] * 3
    assert [over.of(node)["period"] for node in NODES] == [0.02, 0.04, 0.02]


def test_disagreements_are_named_of_two_designs_the_digests() -> None:
    assert disagreements(NODES) == ["parameter design.hash differs: 'a' in tube_mpc, 'b' in nominal_trajectory"]
    same = {node: flat | {"design.hash": "a", "period": 0.02} for node, flat in NODES.items()}
    assert disagreements(same) == [
        "parameter feedback.gain differs: [1.0, -2e-09] in tube_mpc, [1.5, 0.0] in nominal_trajectory"
    ]
