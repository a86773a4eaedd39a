"""Errors, units, parameters, files with limits, progress and interruption."""
