"""The documentation of the graph agrees with the graph."""

from pathlib import Path

from hsv.bags.description import RECORDER, TOPICS, graph

ROOT = Path(__file__).parents[2]


def test_page_names_every_topic_with_its_type_and_ends():
    page = (ROOT / "docs" / "graph.md").read_text(encoding="utf-8").partition("| topic | type | from | to |")[2]
    rows = page.lstrip("\n").split("\n\n")[0].splitlines()[1:]
    assert len(rows) == len(TOPICS)
    for row, (topic, kind) in zip(rows, TOPICS.items(), strict=True):
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        publisher = next(node.name for node in graph() if topic in node.publishes)
        subscribers = [node.name for node in graph() if topic in node.subscribes and node is not RECORDER]
        assert cells[0] == topic and kind in cells[1], row
        assert cells[2] == publisher and cells[3] == ", ".join(subscribers), row
