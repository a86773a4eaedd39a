"""The plotting library is an unchanged copy of its published version."""

import json

import pytest
from bag_readers import NPM

from hsv.pages.engine import LIBRARY

PACKAGE = "plotly.js-basic-dist-min"


def test_it_has_the_version_of_the_npm_package():
    version = json.loads((NPM / "package.json").read_text())["dependencies"][PACKAGE]
    assert f"plotly.js (basic - minified) v{version}\n" in LIBRARY.read_text(encoding="utf-8")[:200]


@pytest.mark.viewer
def test_it_is_the_file_of_npm():
    published = NPM / "node_modules" / PACKAGE
    if not published.is_dir():
        pytest.skip("no node_modules; make test-viewers installs it")
    for name in ("plotly-basic.min.js", "LICENSE"):
        assert LIBRARY.parent.joinpath(name).read_bytes() == (published / name).read_bytes()
