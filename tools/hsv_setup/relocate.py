"""Rewrites the paths of the machine that built the ROS wheels to those of this environment.

The wheels' exported CMake files and `parent_prefix_path` index entries carry the builder's Python prefix; without
this no package that uses a message of theirs compiles.
"""

from __future__ import annotations

import re
from pathlib import Path

_BUILDER = r"/opt/python/cp3\d+-cp3\d+"


def relocate(prefix: Path, python_include: str, numpy_include: str) -> int:
    """Rewrite all files below an installation prefix; repeating it changes nothing.

    Args:
        prefix: The virtual environment, which is the ament prefix.
        python_include: Directory of Python.h.
        numpy_include: Directory that holds numpy/arrayobject.h.

    Returns:
        The number of files changed.
    """
    # The longer paths first: each of them starts with the builder's prefix.
    rules = [
        (re.compile(_BUILDER + r"/include/python3\.\d+"), _literal(python_include)),
        (re.compile(_BUILDER + r"/lib/python3\.\d+/site-packages/numpy/_?core/include"), _literal(numpy_include)),
        (re.compile(_BUILDER), _literal(str(prefix))),
    ]
    share = prefix / "share"
    changed = 0
    for path in [*share.glob("*/cmake/*.cmake"), *share.glob("ament_index/resource_index/parent_prefix_path/*")]:
        before = after = path.read_text()
        for pattern, replacement in rules:
            after = pattern.sub(replacement, after)
        if after != before:
            path.unlink()  # what uv installs may be a link to its cache
            path.write_text(after)
            changed += 1
    return changed


def _literal(path: str) -> str:
    return path.replace("\\", r"\\")
