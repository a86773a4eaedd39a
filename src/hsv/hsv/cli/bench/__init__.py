"""Benchmarks: library and graph compared with other implementations of the same work, timed in the same run."""
