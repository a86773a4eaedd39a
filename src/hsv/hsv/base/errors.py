"""Exceptions of the library: a base class, and for each cause a subclass that also inherits a built-in exception."""

import difflib
import os
from collections.abc import Iterable
from unicodedata import category


class HsvError(Exception):
    """Base class of all errors of this library; most messages name the field, its value and what was expected."""


class QuantityError(HsvError, ValueError):
    """A quantity whose text, unit or value is not acceptable."""


class TrimError(HsvError, ValueError):
    """A flight condition that is impossible or has no equilibrium within the input limits."""


class VehicleError(HsvError, ValueError):
    """A vehicle that is unknown, or whose file cannot be read or has a wrong field."""


class DocumentError(HsvError, ValueError):
    """A file that cannot be read or parsed; the message lacks the name of the file, which the caller adds."""


class ScenarioError(HsvError, ValueError):
    """A scenario that is unknown, or whose file cannot be read or has a wrong field or design."""


class DesignError(HsvError, ValueError):
    """A design, its inputs or a controller parameter that is missing or wrong, or a design that cannot be computed."""


class GovernorError(HsvError, ValueError):
    """A wrong command to the governor, or one that no reference can follow within the input limits of the plan."""


class RecordingError(HsvError, ValueError):
    """A bag that is missing, damaged, not recorded by this project, or cannot be written."""


class RunError(HsvError, RuntimeError):
    """A flight or another process that failed."""


class ControllerError(RunError):
    """A custom controller that failed in flight; the message names it, and the step if known."""


class SignalError(RunError):
    """A signal with a wrong value; the message begins with the name of the signal, which is also in ``signal``."""

    def __init__(self, signal: str, wrong: str) -> None:
        super().__init__(signal, wrong)
        self.signal, self.wrong = signal, wrong

    def __str__(self) -> str:
        return self.wrong


class ProcessError(RunError):
    """A process that runs external code has crashed or does not answer."""


class CampaignError(HsvError, ValueError):
    """A campaign with a wrong setting, or results that are missing, unusable or those of another campaign."""


class ParameterError(HsvError, ValueError):
    """A parameter of a node or component with a wrong name, type, size or value."""


class Mistakes:
    """Collects the errors of independent checks of one file, to report them together: ``with mistakes:`` a check."""

    def __init__(self) -> None:
        self.found: list[HsvError] = []

    def __enter__(self) -> None: ...

    def __exit__(self, _: object, error: object, __: object) -> bool:
        """Keep an ``HsvError`` instead of passing it on."""
        if isinstance(error, HsvError):
            self.found.append(error)
        return isinstance(error, HsvError)

    def report(self) -> None:
        """Raise the first error; the messages of all others become its notes."""
        if self.found:
            first, *others = self.found
            for words in (words for error in others for words in messages(error)):
                first.add_note(words)
            raise first


def messages(error: object) -> list[str]:
    """Return the message of an error and those of its notes, the further mistakes in the same file."""
    return [str(error), *getattr(error, "__notes__", ())]


def require(argument: str, value: object, kinds: type | tuple[type, ...], expected: str) -> None:
    """Raise a ParameterError that names an ``argument`` of a function whose value is of none of the ``kinds``."""
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise ParameterError(f"{argument} = {' '.join(repr(value).split())[:80]}: expected {expected}")


def one_of(known: Iterable[str], name: str, also: str = "") -> str:
    """Return "one of ", the ``known`` names, the text ``also``, and a hint if a known name resembles ``name``."""
    return f"one of {', '.join(known := [*known])}{also}{did_you_mean(name, known)}"


def visible(text: str) -> str:
    """Return ``text`` with escapes for control and format (e.g. bidirectional) characters except newline and tab."""
    if text.isprintable():
        return text
    hidden = [c for c in {*text} if c not in "\n\t" and category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp")]
    return text.translate({ord(c): repr(c)[1:-1] for c in hidden}) if hidden else text


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a hint for the message about an unknown ``name``: the nearest known one, or an empty text."""
    names = {str(other).lower(): str(other) for other in known}
    written = name.lower()
    near = difflib.get_close_matches(written, names, 1) or [n for n in names if written and n.startswith(written)]
    return f" (did you mean {names[near[0]]!r}?)" if near else ""


def reason(error: OSError) -> str:
    """Return the reason for a system error on one line, without the error number and the name of the file."""
    return os.strerror(error.errno) if error.errno else " ".join(str(error).split())
