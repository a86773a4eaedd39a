"""A disk that is full, for this process alone."""

import resource
import sys
from contextlib import contextmanager


@contextmanager
def files_no_larger_than(size):
    """Let no file of this process grow beyond ``size`` bytes."""
    limits, written = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    # Python would cut the bytecode of what it imports meanwhile to that size, and later processes trip over it.
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        sys.dont_write_bytecode = written
