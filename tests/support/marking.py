"""Marks of single cases of parametrised tests."""

import pytest


def long(*values):
    """Return a case of a parametrised test that runs in the long run only, as other cases like it always run."""
    return pytest.param(*values, marks=pytest.mark.long)
