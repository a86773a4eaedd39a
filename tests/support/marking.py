"""Marks of single cases."""

from __future__ import annotations

from typing import Any

import pytest


def long(*values: Any) -> Any:
    """Return a case of a parametrised test that is left to the long run: others like it run always."""
    return pytest.param(*values, marks=pytest.mark.long)
