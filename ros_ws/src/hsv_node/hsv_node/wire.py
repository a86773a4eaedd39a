"""Step messages straight from the signals of the loop, and back: what a step of the graph spends least time on.

Here a message is the flat tuple of all that stands in it, in the order of its type, lengths of texts and sequences
included, as :meth:`hsv_node.codec.Codec.unpack` gives it; no object is made for it. What stands where follows from the
table :data:`hsv.bags.exchange.HELD`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.bags.description import CLOCK, TOPICS
from hsv.bags.exchange import FAULTS, HELD, Head, active_faults, function, taking
from hsv_node.codec import codec

if TYPE_CHECKING:
    from hsv.flight.blocks import Signals

Values = tuple[Any, ...]
"""What stands in a message, behind its encapsulation; the header comes first, in every one but the clock's."""

STEP_PLACE = 5
_FIRST = 6
"""Places of the step and of what comes behind it; at 0 is the encapsulation, and the header between the two."""


def head_of(values: Values) -> Head:
    """Return the header of a message."""
    return Head._make(values[1:STEP_PLACE])


def taker(topic: str) -> Callable[[Values, Signals], None]:
    """Return the function that takes the signals that a block needs from a step topic's message.

    It raises a :class:`hsv.base.errors.SignalError` where they cannot be made of it, and leaves the signals as they
    are. Faults that are those of the message before are not read again.
    """
    kind = codec(TOPICS[topic])
    names: dict[str, Any] = {"head": Head._make}
    fields = []
    at = f"{_FIRST}"
    for i, row in enumerate(HELD[topic]):
        # Expressions of places: constants in them are summed once, when this is compiled.
        first, end, size = at, f"{at} + {len(row.fields)}", ""
        if row.form is FAULTS:
            names[f"signal_{i}"] = _remembering(lambda _, values: active_faults(kind.message(values)), (0, 0), ())
            numbers = f"values[{first}:], values"
        elif row.form and row.form.sequence:
            size = f"values[{at}]"
            first, end = f"{at} + 1", f"{at} + 1 + {size}"
            numbers = f"values[{first}:{end}]"
        else:
            numbers = f"values[{first}:{end}]" if row.form else f"values[{first}]"
        fields.append((numbers, size))
        at = end
    head = f"head(values[1:{STEP_PLACE}]), values[{STEP_PLACE}]"
    return function(topic, "values, signals", taking(topic, head, fields), **names)


def giver(topic: str) -> Callable[[Signals], bytes]:
    """Return the function that makes the bytes of a step topic's message of the signals; their header is a Head.

    Faults that are those of the message before are not written again.
    """
    names: dict[str, Any] = {"pack": codec(TOPICS[topic]).pack}
    values = ["*signals.header", "signals.step"]
    for i, row in enumerate(HELD.get(topic, ())):
        if row.form is FAULTS:
            names[f"values_{i}"] = _remembering(lambda faults: (*_flat(FAULTS.values(faults)),), (), (0, 0))
        if row.form and row.form.sequence:
            values += f"len(numbers := {row.given(i)})", "*numbers"
        else:
            values.append("*" * bool(row.form) + row.given(i))
    whole = "signals.header[:2]" if topic == CLOCK else f"({', '.join(values)})"
    return function(topic, "signals", [f"return pack({whole})"], **names)


def _remembering(make: Callable[..., Any], given: Any, made: Any) -> Callable[..., Any]:
    """Return ``make``, which is not called where its first argument is that of the last call; ``made`` of ``given``."""

    def remembered(now: Any, *others: Any) -> Any:
        nonlocal given, made
        if now != given:
            made = make(now, *others)
            given = now
        return made

    return remembered


def _flat(value: Any) -> Iterator[Any]:
    """Yield what stands in a message for texts, sequences, and tuples of fields, as :attr:`Values` have it."""
    match value:
        case str():
            data = value.encode() + b"\0"
            yield from (len(data), data)
        case tuple():
            for each in value:
                yield from _flat(each)
        case list() | np.ndarray():
            yield len(value)
            for each in value:
                yield from _flat(each)
        case _:
            yield value
