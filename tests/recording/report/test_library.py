"""The plotting library in the page is the one that others publish."""

import pytest
from bag_readers import NPM
from plotly.offline import get_plotlyjs_version

from hsv.recording.report.page import LIBRARY


def test_it_has_the_version_of_the_full_bundle():
    head = LIBRARY.read_text(encoding="utf-8")[:200]
    assert f"plotly.js (basic - minified) v{get_plotlyjs_version()}\n" in head


def test_its_licence_lies_beside_it():
    assert "MIT License" in LIBRARY.parent.joinpath("LICENSE").read_text(encoding="utf-8")


@pytest.mark.viewer
def test_it_is_the_file_of_npm():
    published = NPM / "node_modules" / "plotly.js-basic-dist-min"
    if not published.is_dir():
        pytest.skip("no node_modules; make test-viewers installs it")
    for name in ("plotly-basic.min.js", "LICENSE"):
        assert LIBRARY.parent.joinpath(name).read_bytes() == (published / name).read_bytes()
