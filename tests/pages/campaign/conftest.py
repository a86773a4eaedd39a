"""Fixtures of campaigns with short flights."""

from short_campaigns import out, planned, results, short  # noqa: F401 (fixtures)
