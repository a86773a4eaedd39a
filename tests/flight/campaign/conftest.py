"""Campaigns of short flights."""

from short_campaigns import out, planned, results, short  # noqa: F401 (fixtures)
