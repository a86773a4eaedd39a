"""Errors, units, files with limits, progress and interruption."""
