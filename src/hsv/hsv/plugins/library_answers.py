"""Answers of the child process of a library, in a fixed form that is read without running code.

The library can write whatever it likes to the descriptors of its process, so that an answer is data from a stranger:
a mark, the kind and the length, then numbers, bytes, or a text. Unlike the requests, no answer is a pickle.
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

_HEADER = struct.Struct("<4scq")
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
    kind, content = _packed(answer)
    message = memoryview(_HEADER.pack(_MARK, kind, len(content)) + content)
    while message:
        message = message[os.write(descriptor, message) :]


def receive_answer(descriptor: int, patience: float) -> Any:
    """Return the next answer in a socket; an error is returned, not raised.

    Raises:
        ProcessError: What was written is no answer, or it is not complete after ``patience`` seconds.
        EOFError: The child has ended.
    """
    until = time.monotonic() + patience
    mark, kind, length = _HEADER.unpack(_read(descriptor, _HEADER.size, until))
    if mark == _MARK and 0 <= length <= _MOST:
        try:
            return _unpacked(kind, _read(descriptor, length, until))
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError):
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


def _packed(answer: Any) -> tuple[bytes, bytes]:
    if answer is None:
        return b"-", b""
    if isinstance(answer, HsvError):
        return b"e", json.dumps([type(answer).__name__, str(answer)]).encode()
    if isinstance(answer, int):
        return b"i", struct.pack("<q", answer)
    if isinstance(answer, bytes):
        return b"b", answer
    if isinstance(answer, np.ndarray):
        return b"n", answer.tobytes()
    return b"d", json.dumps(asdict(answer)).encode()


def _unpacked(kind: bytes, content: bytes) -> Any:
    if kind == b"-":
        return None
    if kind == b"e":
        name, text = map(str, json.loads(content))
        found = getattr(errors, name, None)
        known = isinstance(found, type) and issubclass(found, HsvError) and found is not errors.SignalError
        return found(text) if known and found else ProcessError(text)
    if kind == b"i":
        return struct.unpack("<q", content)[0]
    if kind == b"b":
        return content
    if kind == b"n":
        return np.frombuffer(content).copy()
    if kind == b"d":
        return _block(json.loads(content))
    raise ValueError(kind)


def _block(fields: dict[str, Any]) -> CBlock:
    """Return the description of a block from its ``fields``, with the types that it must have."""
    parameters = []
    for given in fields["parameters"]:
        default = [float(each) for each in np.ravel(given["default"])]
        name, description, unit = (str(given[key]) for key in ("name", "description", "unit"))
        bounds = float(given["minimum"]), float(given["maximum"])
        parameters.append(Parameter(name, default if len(default) > 1 else default[0], description, unit, *bounds))
    inputs, outputs = (
        tuple(SignalType(str(s["name"]), str(s["unit"]), int(s["size"])) for s in fields[key])
        for key in ("inputs", "outputs")
    )
    name, source, size = str(fields["name"]), str(fields["source"]), int(fields["state_size"])
    return CBlock(name, source, int(fields["address"]), size, inputs, outputs, tuple(parameters))
