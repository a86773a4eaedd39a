import sys
from pathlib import Path

import pytest

from hsv.base.errors import ScenarioError
from hsv.flight.sources import drop_older, flight_digest, kept, nodes_digest


def test_a_digest_is_of_the_scenario_flown():
    assert flight_digest("case1") != flight_digest("case1_no_notch")
    with pytest.raises(ScenarioError):
        flight_digest("case9")


def test_a_digest_of_a_run_is_of_the_workspace_s_nodes_and_messages(monkeypatch, tmp_path):
    pytest.importorskip("ament_index_python")
    index, share = tmp_path / "share/ament_index/resource_index/packages", tmp_path / "share/hsv_probe/msg"
    node, message = tmp_path / "modules/hsv_probe/node.py", share / "Probe.msg"
    for folder in (index, share, node.parent):
        folder.mkdir(parents=True)
    (index / "hsv_probe").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    monkeypatch.setattr(sys, "path", [str(tmp_path / "modules"), *sys.path])
    found = []
    for path, text in ((node, "GAIN = 1\n"), (node, "GAIN = 2\n"), (message, "float64 x\n"), (message, "float64 y\n")):
        path.write_text(text)
        nodes_digest.cache_clear()
        found.append((nodes_digest(), flight_digest("case1", graph=True)))
    nodes_digest.cache_clear()
    for digests in zip(*found, strict=True):
        assert len(set(digests)) == len(found)


def test_only_the_newest_of_a_name_is_kept(tmp_path):
    new, old = "0123456789ab", "ba9876543210"
    for name in (f"case1_{new}", f"case1_{old}", f"case1_no_notch_{old}"):
        (tmp_path / name).mkdir()
        (tmp_path / f"{name}.npz").touch()
    drop_older(tmp_path / f"case1_{new}")
    drop_older(tmp_path / f"case1_{new}.npz")
    kept = {path.name.removesuffix(".npz") for path in tmp_path.iterdir()}
    assert kept == {f"case1_{new}", f"case1_no_notch_{old}"}


def test_what_is_kept_is_made_once_for_a_digest(tmp_path):
    made = []

    def get(digest):
        def make():
            made.append(digest)
            return digest

        return kept(tmp_path / "new" / f"probe_{digest}.txt", make, Path.write_text, Path.read_text)

    first, second = "0123456789ab", "ba9876543210"
    assert [get(first), get(first), get(second)] == [first, first, second]
    assert made == [first, second]
    assert [path.name for path in (tmp_path / "new").iterdir()] == [f"probe_{second}.txt"]
