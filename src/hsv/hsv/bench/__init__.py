"""Benchmarks: the library and the graph against the same work done by other means, timed in the same run."""
