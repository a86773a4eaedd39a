"""The fuzz's fixture."""

from fuzzing import fuzz  # noqa: F401 (fixture)
