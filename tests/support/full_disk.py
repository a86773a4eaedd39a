"""A full disk, emulated for this process alone."""

import resource
import sys
from contextlib import contextmanager


@contextmanager
def files_no_larger_than(size):
    """Limit the size of every file that this process writes to ``size`` bytes."""
    limits, written = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    # Bytecode of modules imported meanwhile would be cut at this size, too, and break later processes.
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        sys.dont_write_bytecode = written
