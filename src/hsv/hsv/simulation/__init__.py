"""Scenarios, the in-process closed loop and the metrics of a flight."""
