"""The command line with all its commands, for those who read it as a whole: its documentation, and tests."""

from __future__ import annotations

from hsv.cli.main import application

app = application()
