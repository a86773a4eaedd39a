"""Benchmarks: the bench is compared with the same work done by other means, timed in the same run."""
