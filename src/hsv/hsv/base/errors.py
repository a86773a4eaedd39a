"""Exceptions of the library: one base class, and one subclass per cause that also inherits the standard one."""

import difflib
import os
from collections.abc import Iterable


class HsvError(Exception):
    """Base of all errors of this library; the message names the field, its value and the expectation."""


class QuantityError(HsvError, ValueError):
    """A quantity whose text, unit or value is not acceptable."""


class TrimError(HsvError, ValueError):
    """No equilibrium with admissible inputs exists at the requested flight condition."""


class VehicleError(HsvError, ValueError):
    """A vehicle file that is missing or has a wrong field."""


class DocumentError(HsvError, ValueError):
    """A file that cannot be read, or a text that is not as expected; the message does not name it."""


class ScenarioError(HsvError, ValueError):
    """A scenario file that is missing or has a wrong field."""


class DesignError(HsvError, ValueError):
    """A design file, or a parameter of a controller, that is missing, malformed or does not stabilise."""


class GovernorError(HsvError, ValueError):
    """A command for which no reference fits into the inputs of the nominal plan."""


class RecordingError(HsvError, ValueError):
    """A bag that is missing, foreign or damaged."""


class RunError(HsvError, RuntimeError):
    """A flight that did not finish."""


class ControllerError(RunError):
    """A custom controller that failed in flight; the message names it, and the step if known."""


class SignalError(RunError):
    """A signal with wrong contents; the message begins with the field, and ``signal`` names it."""

    def __init__(self, signal: str, wrong: str) -> None:
        super().__init__(signal, wrong)
        self.signal, self.wrong = signal, wrong

    def __str__(self) -> str:
        return self.wrong


class ProcessError(RunError):
    """A process with foreign code that crashed or hangs."""


class CampaignError(HsvError, ValueError):
    """A Monte Carlo campaign with a wrong setting, or its results missing, foreign or of another campaign."""


class ParameterError(HsvError, ValueError):
    """A parameter of a node or component with a wrong name, type, size or value."""


def one_of(known: Iterable[str], name: str, also: str = "") -> str:
    """Return the end of a message about an unknown ``name``: ``one of`` all known ones, a remark, and the nearest."""
    return f"one of {', '.join(known := [*known])}{also}{did_you_mean(name, known)}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a hint for the message about an unknown ``name``: the nearest known one, or an empty text."""
    names = {str(other).lower(): str(other) for other in known}
    written = name.lower()
    near = difflib.get_close_matches(written, names, 1) or [n for n in names if written and n.startswith(written)]
    return f" (did you mean {names[near[0]]!r}?)" if near else ""


def reason(error: OSError) -> str:
    """Return the reason of a system error on one line, without what libraries add."""
    return os.strerror(error.errno) if error.errno else " ".join(str(error).split())
