"""Answers of the child process of a library, in a fixed form that is read without running code.

The library can write whatever it likes to the descriptors of its process, so that an answer is data from a stranger:
a mark and the length of a JSON text. Unlike the requests, no answer is a pickle.
"""

from __future__ import annotations

import json
import os
import struct
import time
from dataclasses import asdict, dataclass
from select import POLLIN, poll
from typing import Any

import numpy as np

from hsv.base import errors
from hsv.base.errors import HsvError, ProcessError
from hsv.base.parameters import Parameter
from hsv.model.signals import SignalType

_HEADER = struct.Struct("<4sq")
_MARK = b"hsv1"
_MOST = 2**28
"""Maximum length (bytes) of an answer"""


@dataclass(frozen=True)
class CBlock:
    """The checked description of a block that a library exports."""

    name: str
    source: str
    """Path of the source relative to the library's folder, or empty"""
    address: int
    """Address of the step function in the process that loaded the library."""
    state_size: int
    inputs: tuple[SignalType, ...]
    outputs: tuple[SignalType, ...]
    parameters: tuple[Parameter, ...]
    """Parameters, named ``block.parameter``, in the order in which the step function receives their values"""


def send_answer(descriptor: int, answer: Any) -> None:
    """Write ``answer`` to a socket: None, an error of the library, an integer, bytes, numbers, or a block."""
    content = json.dumps(answer, default=_plain, ensure_ascii=False).encode()
    message = memoryview(_HEADER.pack(_MARK, len(content)) + content)
    while message:
        message = message[os.write(descriptor, message) :]


def _plain(answer: Any) -> Any:
    if isinstance(answer, HsvError):
        return {"error": type(answer).__name__, "text": str(answer)}
    if isinstance(answer, bytes):
        return answer.decode("latin-1")
    return answer.tolist() if isinstance(answer, np.ndarray) else asdict(answer)


def receive_answer(descriptor: int, patience: float) -> Any:
    """Return the next answer in a socket; an error is returned, not raised.

    Raises:
        ProcessError: What was written is no answer, or it is not complete after ``patience`` seconds.
        EOFError: The child has ended.
    """
    until = time.monotonic() + patience
    mark, length = _HEADER.unpack(_read(descriptor, _HEADER.size, until))
    if mark == _MARK and 0 <= length <= _MOST:
        try:
            return _parsed(json.loads(_read(descriptor, length, until)))
        except (ArithmeticError, LookupError, TypeError, ValueError, RecursionError):
            pass
    raise ProcessError("wrote to a descriptor that is not its own")


def _read(descriptor: int, length: int, until: float) -> bytes:
    found, ready = bytearray(), poll()
    ready.register(descriptor, POLLIN)
    while len(found) < length:
        if not ready.poll(max(0.0, 1e3 * (until - time.monotonic()))):
            raise ProcessError("wrote a part of an answer")
        part = os.read(descriptor, min(length - len(found), 2**20))
        if not part:
            raise EOFError
        found += part
    return bytes(found)


def _parsed(found: Any) -> Any:
    if isinstance(found, str):
        return found.encode("latin-1")
    if isinstance(found, list):
        return np.array(found, float)
    if not isinstance(found, dict):
        return found
    if "error" in found:
        kind = getattr(errors, str(found["error"]), None)
        known = isinstance(kind, type) and issubclass(kind, HsvError) and kind is not errors.SignalError
        return (kind if known and kind else ProcessError)(str(found["text"]))
    parameters = []
    for given in found["parameters"]:
        default = np.ravel(np.array(given["default"], float)).tolist()
        name, description, unit = (str(given[key]) for key in ("name", "description", "unit"))
        bounds = float(given["minimum"]), float(given["maximum"])
        parameters.append(Parameter(name, default if len(default) > 1 else default[0], description, unit, *bounds))
    inputs, outputs = (
        tuple(SignalType(str(s["name"]), str(s["unit"]), int(s["size"])) for s in found[key])
        for key in ("inputs", "outputs")
    )
    name, source, size = str(found["name"]), str(found["source"]), int(found["state_size"])
    return CBlock(name, source, int(found["address"]), size, inputs, outputs, tuple(parameters))
