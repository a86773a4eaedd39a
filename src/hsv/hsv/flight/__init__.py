"""Scenarios, flights in one process, metrics, fingerprints and campaigns."""
