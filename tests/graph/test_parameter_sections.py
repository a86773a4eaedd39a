"""Parameters by node: collected, written, read back and merged; conflicts are named."""

from hsv.bags.parameter_sections import ParameterSections, disagreements

NODES = {
    "plant": {"period": 0.02, "duration": 12.0, "controller": "tube_mpc"},
    "tube_mpc": {"period": 0.02, "design.hash": "a", "feedback.tau": [0.9], "feedback.gain": [1.0, -2e-9]},
    "nominal_trajectory": {"period": 0.02, "design.hash": "b", "feedback.tau": [1.0], "feedback.gain": [1.5, 0.0]},
}


def test_every_node_gets_back_its_own():
    sections = ParameterSections.gathered(NODES)
    again = ParameterSections.parse(sections.to_yaml(), "test")
    assert again == sections
    for node, flat in NODES.items():
        assert flat.items() <= again.of(node).items()
    assert again.shared == {"period": 0.02, "duration": 12.0, "controller": "tube_mpc"}
    assert again.own.keys() == {"tube_mpc", "nominal_trajectory"}


def test_disagreements_are_named_of_two_designs_the_digests():
    assert disagreements(NODES) == ["parameter design.hash differs: 'a' in tube_mpc, 'b' in nominal_trajectory"]
    same = {node: flat | {"design.hash": "a", "period": 0.02} for node, flat in NODES.items()}
    assert disagreements(same) == [
        "parameter feedback.gain differs: [1.0, -2e-09] in tube_mpc, [1.5, 0.0] in nominal_trajectory"
    ]
