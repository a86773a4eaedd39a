"""Replay of a recorded run, process by process or as a complete loop, and comparison with the record."""
