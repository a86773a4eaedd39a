"""Marks of single cases."""

import pytest


def long(*values):
    """Return a case of a parametrised test that is left to the long run: others like it run always."""
    return pytest.param(*values, marks=pytest.mark.long)
