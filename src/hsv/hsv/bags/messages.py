"""Messages of the step topics: the layout of their bytes, and the signals of the loop in them.

In one run, the sequences and the ``frame_id`` of a topic have constant lengths. All its messages (XCDR1, little-endian)
then have the same layout, which follows from the message definition: one numpy structured type, :class:`Structure`.
Nodes, replay and reader view the bytes of a message with this type instead of converting it field by field. Only a list
of messages, such as the active faults, is converted by rosbags, and only when its bytes change.

:data:`hsv.bags.description.TOPIC_FIELDS` declares the fields that contain the signals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces.typing import Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from hsv.bags.definitions import blank, deserialized, fields_of, installed_types
from hsv.bags.description import CLOCK, TOPIC_FIELDS, TOPICS, TUBE_STATUS, WIRE_ALIGNMENT
from hsv.base.errors import ParameterError, RunError, SignalError
from hsv.flight.blocks import LOOP
from hsv.model import signals as types
from hsv.model.signals import DIAGNOSED, N_INPUTS, NEVER, VARYING, SignalType

if TYPE_CHECKING:
    from hsv.flight.blocks import Signals
    from hsv.model.faults.schedule import ActiveFault
    from hsv.model.faults.table import Fault

FRAME = "vehicle_carried"
"""``frame_id`` of every message of a step: the vehicle-carried frame of the state."""

ENCAPSULATION = 4
"""Length of the header of a message in CDR, bytes; fields are aligned relative to the end of the header."""

_LITTLE_ENDIAN = b"\x00\x01"
_STAMP = Struct("<iI")
"""Seconds and nanoseconds of simulated time, the first fields of every message of a step."""


def stamp_of(step: int, period: float) -> tuple[int, int]:
    """Return seconds and nanoseconds of simulated time at ``step`` of a flight with a ``period`` (s)."""
    return divmod(round(step * period * 1e9), 1_000_000_000)


def stamp_in(message: bytes) -> int:
    """Return the simulated time (ns) at the beginning of a message (CDR) of a step topic."""
    seconds, nanoseconds = _STAMP.unpack_from(message, ENCAPSULATION)
    return int(seconds * 1_000_000_000 + nanoseconds)


class MessageError(RunError):
    """The bytes are not a message of the expected type, or the type has another definition than expected."""


class Structure:
    """The layout of all messages of a type whose texts and sequences have given lengths.

    Attributes:
        dtype: Structured type of the message after its header; the names of the fields are paths such as
            ``header.stamp.sec`` or ``state.altitude``. A text includes its closing zero.
        lengths: Offset and value of the length of every text and sequence, by path.
        size: Size of :attr:`dtype`, bytes.
        complete: Whether dtype has all fields, except empty lists of texts or messages; else it ends before a non-empty
            one or wide text.
    """

    def __init__(self, store: Typesdict, message_type: str, message: bytes) -> None:
        """Determine the layout from a ``message`` (CDR); raise a MessageError if it is big-endian or too short."""
        if message[:2] != _LITTLE_ENDIAN:
            raise MessageError(
                f"{message_type}: CDR that begins with {message[:2].hex()}, expected 0001, little-endian"
            )
        self.lengths: dict[str, tuple[int, int]] = {}
        self.complete = True
        self.type = message_type
        self.size = 0
        self._places: dict[str, tuple[np.dtype[Any], int]] = {}
        self._walk(store, message_type, message)
        if len(message) < ENCAPSULATION + self.size:
            raise MessageError(f"{message_type}: {len(message)} bytes, expected at least {ENCAPSULATION + self.size}")
        self.dtype = np.dtype(
            {
                "names": list(self._places),
                "formats": [dtype for dtype, _ in self._places.values()],
                "offsets": [offset for _, offset in self._places.values()],
                "itemsize": self.size,
            }
        )
        # The bytes that decide the layout, encapsulation and lengths, are compared as one integer.
        decisive = [(0, _LITTLE_ENDIAN)]
        decisive += [(ENCAPSULATION + at, length.to_bytes(4, "little")) for at, length in self.lengths.values()]
        self._decided = decisive[-1][0] + len(decisive[-1][1])
        mask, expected = bytearray(self._decided), bytearray(self._decided)
        for at, octets in decisive:
            mask[at : at + len(octets)], expected[at : at + len(octets)] = b"\xff" * len(octets), octets
        self._mask, self._expected = (int.from_bytes(octets, "little") for octets in (mask, expected))

    def fits(self, message: bytes) -> bool:
        """Return whether ``message`` has this layout, possibly followed by further bytes."""
        if len(message) < ENCAPSULATION + self.size:
            return False
        return int.from_bytes(message[: self._decided], "little") & self._mask == self._expected

    def rows(self, messages: Sequence[bytes]) -> NDArray[Any] | None:
        """Return the messages as an array of :attr:`dtype`, shape (n,); None if one has another layout or length."""
        size = len(messages[0])
        if any(len(message) != size for message in messages) or not all(map(self.fits, messages)):
            return None
        octets = np.frombuffer(b"".join(messages), np.uint8).reshape(-1, size)
        body = np.ascontiguousarray(octets[:, ENCAPSULATION : ENCAPSULATION + self.size])
        return body.view(self.dtype)[:, 0]

    def select(self, chosen: Mapping[str, tuple[str, int]]) -> np.dtype[Any]:
        """Return a structured type of the same size with only the ``chosen`` fields: {new name: (path, size)}.

        The size is 1 for a number, :data:`VARYING` for a sequence of numbers, and n for n consecutive numbers; their
        path is that of the first, or of the nested message that contains them. A MessageError names a field that the
        definition lacks or that is of another kind.
        """
        names, formats, offsets = list(self._places), [], []
        for path, size in chosen.values():
            first = next((i for i, name in enumerate(names) if name == path or name.startswith(f"{path}.")), None)
            count = 1 if first is None or self._places[names[first]][0].shape else max(size, 1)
            run = [self._places[name] for name in names[first : first + count]] if first is not None else []
            if len(run) < count or {dtype for dtype, _ in run} != {run[0][0]} or run[0][0].kind == "S":
                raise MessageError(f"{self.type}: recorded with another definition, expected a field {path}")
            dtype, offset = run[0]
            formats.append(dtype if count == 1 else np.dtype((dtype, (count,))))
            offsets.append(offset)
        return np.dtype({"names": list(chosen), "formats": formats, "offsets": offsets, "itemsize": self.size})

    def _walk(self, store: Typesdict, message_type: str, message: bytes, prefix: str = "") -> None:
        for field in fields_of(store, message_type):
            if not self.complete:
                return
            path = prefix + field.name
            if field.count == "one" and field.format:
                self._place(path, np.dtype(field.format))
            elif field.count == "one" and field.is_text:
                self._place(path, np.dtype(f"S{self._length(path, message)}"))
            elif field.count == "one" and field.is_message:
                self._walk(store, field.type, message, path + ".")
            elif field.count == "one":  # a text of wide characters
                self.complete = False
            else:
                at = self.size
                count = field.length if field.count == "array" else self._length(path, message)
                if field.format:
                    self._place(path, np.dtype((field.format, (count,))))
                elif count:
                    # Texts and messages in a list differ in size, so that the offsets of the rest are not fixed.
                    self.complete, self.size = False, at
                    self.lengths.pop(path, None)

    def _place(self, path: str, dtype: np.dtype[Any]) -> None:
        if dtype.itemsize and dtype.kind != "S":
            self.size += -self.size % dtype.base.itemsize
        self._places[path] = dtype, self.size
        self.size += dtype.itemsize

    def _length(self, path: str, message: bytes) -> int:
        offset = self.size + -self.size % 4
        at = ENCAPSULATION + offset
        length = int.from_bytes(message[at : at + 4], "little")
        if length > len(message):
            raise MessageError(f"{self.type}: {path}: length {length} in a message of {len(message)} bytes")
        self.lengths[path] = offset, length
        self.size = offset + 4
        return length


_NEEDED = {signal for block in LOOP for signal in (*block.inputs, *block.delayed, *block.state)} | {types.STATUS}
"""The signals to unpack: the inputs and states of the blocks, and the status, which nodes pass on."""

_VALUES: dict[SignalType, Callable[[Signals], Any]] = {
    types.ESTIMATE: lambda signals: () if signals.estimate is signals.measurement else signals.estimate,
    types.GAIN: lambda signals: signals.gain.ravel(),
}
"""Functions that return the numbers to send for a signal, if these differ from the value of the signal."""


class StepMessages:
    """Conversion of the signals of a step to and from the messages of one topic; clock messages can only be packed."""

    def __init__(self, topic: str, store: Typestore | None = None) -> None:
        """Choose the topic by its role, e.g. ``hsv/state``, and its message definitions; None: the installed ones."""
        self.type = TOPICS[topic]
        self._store = store or installed_types(self.type)
        carried = TOPIC_FIELDS.get(topic, {})
        self._has_faults = types.ACTIVE_FAULTS in carried
        numbers = {signal: field for signal, field in carried.items() if signal is not types.ACTIVE_FAULTS}
        self._sequences = {signal: field for signal, field in numbers.items() if signal.sequence}
        self._has_estimate = types.ESTIMATE in self._sequences
        self._needed = {signal.name: (field, _size(signal)) for signal, field in numbers.items() if signal in _NEEDED}
        if topic == TUBE_STATUS:
            sent = {name: (size, attrgetter(f"diagnostics.{name}")) for name, size in DIAGNOSED.items()}
            sent["u_reference"] = N_INPUTS, attrgetter("reference_input")
        else:
            sent = {field: (_size(s), _VALUES.get(s, attrgetter(s.name))) for s, field in numbers.items()}
        self._sent = {field: size for field, (size, _) in sent.items()}
        self._values = [value for _, value in sent.values()]
        self._varying = [i for i, size in enumerate(self._sent.values()) if size == VARYING]
        stamp = "clock" if topic == CLOCK else "header.stamp"
        self._front = {path: (path, 1) for path in (f"{stamp}.sec", f"{stamp}.nanosec", "step")[: 2 + bool(carried)]}
        """Fields at the beginning of every message: stamp and, except for the clock, the step."""
        self._received: Structure | None = None
        self._checked: bytes | None = None
        """The last message whose layout was checked."""
        self._list = b""
        self._faults: tuple[ActiveFault, ...] = ()
        self._layout: tuple[object, ...] | None = None

    def step(self, message: bytes) -> int:
        """Return the step number of a message; raise a MessageError or SignalError if the message is invalid."""
        self._check(message)
        return int.from_bytes(message[self._step_at : self._step_at + 8], "little")

    def unpack(self, message: bytes, signals: Signals) -> None:
        """Write stamp, step and the values that blocks need from a message into ``signals``.

        If the message is invalid, raise a MessageError or SignalError and leave ``signals`` unchanged.
        """
        if message is not self._checked:
            self._check(message)
        faults = self._active_faults(message) if self._has_faults else ()
        # A copy without the header aligns the numbers.
        seconds, nanoseconds, step, *values = np.frombuffer(message[ENCAPSULATION:], self._dtype, 1).item()
        signals.stamp, signals.step = (seconds, nanoseconds), step
        vars(signals).update(zip(self._needed, values, strict=True))
        if self._has_faults:
            signals.active_faults = faults
        if self._has_estimate and not len(signals.estimate):
            signals.estimate = signals.measurement

    def pack(self, signals: Signals) -> bytes:
        """Return the message (CDR) with the values of ``signals``, padded as over DDS."""
        values = [value(signals) for value in self._values]
        layout = [len(values[i]) for i in self._varying], signals.active_faults if self._has_faults else ()
        if self._layout != layout:
            self._allocate(*layout)
            self._layout = layout
        front = (*signals.stamp, signals.step)[: len(self._front)]
        self._row[0] = *front, *values
        return bytes(self._buffer)

    def _check(self, message: bytes) -> None:
        """Raise a MessageError or SignalError if ``message`` is invalid; adapt to its layout if it is another one."""
        if self._received is None or not self._received.fits(message):
            structure = Structure(self._store.fielddefs, self.type, message)
            for signal, field in self._sequences.items():
                if field in structure.lengths and not signal.admits(length := structure.lengths[field][1]):
                    raise SignalError(signal.name, f"{field}: {length} numbers, expected {signal.sequence}")
            self._dtype = structure.select(self._front | self._needed)
            fields = self._dtype.fields
            assert fields is not None
            self._step_at = ENCAPSULATION + fields["step"][1]
            self._received = structure
        self._checked = message

    def _active_faults(self, message: bytes) -> tuple[ActiveFault, ...]:
        assert self._received is not None
        if self._received.complete and self._received.lengths["since"][1] == 0:
            return ()
        found = message[ENCAPSULATION + self._received.size :]
        if found != self._list or not found:
            try:
                decoded = deserialized(self._store, message, self.type)
            except SerdeError as error:
                raise MessageError(f"{self.type}: {error}") from None
            self._faults, self._list = active_faults(decoded), found
        return self._faults

    def _allocate(self, lengths: Sequence[int], faults: tuple[ActiveFault, ...]) -> None:
        """Allocate a message with sequences of these ``lengths`` and these ``faults``, and a row of its numbers."""
        message = blank(self._store, self.type)
        if hasattr(message, "header"):
            message.header.frame_id = FRAME
        sequences = (field for field, size in self._sent.items() if size == VARYING)
        for field, length in zip(sequences, lengths, strict=True):
            setattr(message, field, np.zeros(length))
        if faults:
            fault_type = self._store.types["hsv_msgs/msg/Fault"]
            message.active = [
                fault_type(f.channel, f.type, list(f.parameters), np.array([*f.parameters.values()], np.float64))
                for f, _ in faults
            ]
            message.since = np.array([active.since for active in faults], np.uint64)
        data = bytes(self._store.serialize_cdr(message, self.type))
        self._buffer = bytearray(data + bytes(-len(data) % WIRE_ALIGNMENT))
        structure = Structure(self._store.fielddefs, self.type, data)
        dtype = structure.select(self._front | {field: (field, size) for field, size in self._sent.items()})
        self._row = np.frombuffer(self._buffer, dtype, 1, ENCAPSULATION)


def _size(signal: SignalType) -> int:
    return VARYING if signal.sequence else signal.size


def fault_in(message: Any) -> Fault:
    """Return the fault in a ``Fault`` message; a ParameterError names an invalid channel, type or parameter."""
    from hsv.model.faults.table import Fault  # imported here because most nodes need no faults

    names, values = message.parameter_names, message.parameter_values
    if len(names) != len(values):
        raise ParameterError(f"fault.parameter_values: {len(values)} values, expected {len(names)}, one for each name")
    return Fault.of(message.channel, message.type, dict(zip(names, map(float, values), strict=True)))


def active_faults(message: Any) -> tuple[ActiveFault, ...]:
    """Return the active faults in an ``Actuator`` message, each with its first step; raise a SignalError if invalid."""
    from hsv.model.faults.schedule import ActiveFault

    active, since = message.active, message.since
    if len(active) != len(since):
        raise SignalError(
            "active_faults", f"since: {len(since)} steps, expected {len(active)}, one for each fault in active"
        )
    found = []
    for i, (fault, first) in enumerate(zip(active, map(int, since), strict=True)):
        try:
            found.append(ActiveFault(fault_in(fault), first))
        except ParameterError as error:
            raise SignalError("active_faults", f"active[{i}]: {error}") from error
        if first > NEVER:
            raise SignalError("active_faults", f"since[{i}] = {first}: expected a step, at most {NEVER}")
    return tuple(found)
