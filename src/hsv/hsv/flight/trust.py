"""Restrictions on bags and campaigns: they may not run code or read arbitrary files that they name.

A scenario or class that a user names on the command line is the user's own. What a bag or a campaign names may be
anybody's: it counts only where the user says so, with ``--trust``. Controllers that are registered here under a name
are installed code, which data may choose, not bring.
"""

from __future__ import annotations

from pathlib import PurePath

from hsv.base.errors import ParameterError
from hsv.control.controllers import names_code


def require_trust(controller: str, source: object, trust: bool) -> None:
    """Refuse a controller whose code a bag or a campaign names, unless the user trusts it.

    Args:
        controller: Controller as named in a scenario.
        source: The bag or result file.
        trust: Whether the user said so.

    Raises:
        ParameterError: It names code, and is not trusted.
    """
    if names_code(controller) and not trust:
        raise ParameterError(f"{source}: controller = {controller!r}: code that this file names, run only with --trust")


def require_path_inside(path: str, field: str, source: object, trust: bool) -> None:
    """Refuse a path in a bag or a campaign that is absolute or leads upwards, unless the user trusts it.

    Args:
        path: A path, or a name of something shipped.
        field: Field of the scenario.
        source: The bag or result file.
        trust: Whether the user said so.

    Raises:
        ParameterError: The path leads out of the folder, and is not trusted.
    """
    if (PurePath(path).is_absolute() or ".." in PurePath(path).parts) and not trust:
        raise ParameterError(f"{source}: {field} = {path!r}: a path out of the folder, followed only with --trust")
