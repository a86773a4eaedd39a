"""Refusing files and folders that could not be written, before any work is done for them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp

from hsv.base.errors import ParameterError, reason


def check_target(path: Path, field: str) -> None:
    """Refuse a file that could not be written.

    Raises:
        ParameterError: ``path`` is a folder, lies in none, or may not be written.
    """
    usable = os.access(path, os.W_OK) and not path.is_dir() if path.exists() else _takes_files(path.parent)
    if not usable:
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written, expected a file in an existing folder")


def check_folder(path: Path, field: str) -> None:
    """Refuse a folder that could not be written, or not be made; it is not made yet.

    Raises:
        ParameterError: ``path`` is a file, lies below one, or may not be written or made.
    """
    there = path.absolute()
    while not os.path.lexists(there):
        there = there.parent
    if not _takes_files(there):
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written, expected a folder or the name of a new one")


@contextmanager
def writing(path: Path, field: str) -> Iterator[None]:
    """Convert system errors while ``path`` is written into one error; an incomplete file is removed.

    Raises:
        ParameterError: It could not be written.
    """
    try:
        yield
    except OSError as error:
        if path.is_file():
            path.unlink()
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written ({reason(error)})") from error


def _takes_files(folder: Path) -> bool:
    # Permissions do not tell: a file system may be read-only, or not one of files.
    try:
        Path(mkdtemp(dir=folder)).rmdir()
    except OSError:
        return False
    return True
