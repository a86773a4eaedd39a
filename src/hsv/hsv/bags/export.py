"""Export the topics of a bag as tables in CSV, Parquet, npz or mat, with names and units of the fields."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hsv.bags.reader import Bag
from hsv.bags.steps import bag_warnings
from hsv.bags.units import Units
from hsv.base.errors import RecordingError, reason

INCOMPLETE = "incomplete"
"""Name of the file or array with the warnings about an incomplete bag."""

_MATLAB_LETTERS = 63
"""Maximum length of a name in MATLAB"""


class Format(StrEnum):
    """Export formats of a bag."""

    csv = "csv"
    parquet = "parquet"
    npz = "npz"
    mat = "mat"

    @property
    def single(self) -> bool:
        """Whether all topics are written to one file."""
        return self in (Format.npz, Format.mat)


def export(bag: Bag, topics: Iterable[str], form: Format, target: Path) -> list[Path]:
    """Write ``topics``, given by name or role; return the written files.

    CSV and Parquet: the folder ``target`` contains one file per topic, such as ``hsv_state.csv`` for ``/hsv/state``,
    with one column per number, such as ``elastic_rate_1 [kg^0.5 m/s]``; other fields become texts or JSON. npz: the
    file ``target`` has one array per field, such as ``hsv_state.elastic_rate_1 [kg^0.5 m/s]``. mat: the file has one
    structure per topic, such as ``hsv_state``, with a field ``elastic_rate_1`` and its unit in
    ``hsv_state.units.elastic_rate_1``. The first column or field of a topic is the simulated ``time`` (s). Warnings
    about an incomplete bag become one more text file or array, :data:`INCOMPLETE`.

    Raises:
        RecordingError: A topic is missing, or the target exists or cannot be written.
    """
    if target.exists():
        raise RecordingError(
            f"out = {str(target)!r}: exists already, expected a new {'file' if form.single else 'folder'}"
        )
    topics = [bag.name_of(topic) for topic in topics]
    lacking = "; ".join(bag_warnings(bag))
    if form.single:
        contents = (_structures if form is Format.mat else _arrays)(bag, topics)
    else:
        contents = {topic: table(*_columns(bag, topic)) for topic in topics}
    try:
        (target.parent if form.single else target).mkdir(parents=True, exist_ok=form.single)
    except OSError as error:
        raise _refused(target, error) from error
    try:
        if form.single:
            notes: dict[str, Any] = {INCOMPLETE: np.array(lacking)} if lacking else {}
            with target.open("wb") as stream:
                if form is Format.mat:
                    from scipy.io import savemat

                    savemat(stream, contents | notes, long_field_names=True, do_compression=True, oned_as="column")
                else:
                    np.savez_compressed(stream, **contents, **notes)
            return [target]
        written = [_write(target / f"{_file_stem(topic)}.{form}", table) for topic, table in contents.items()]
        if lacking:
            written.append(target / f"{INCOMPLETE}.txt")
            written[-1].write_text(f"{bag.path}: {lacking}\n", encoding="utf-8")
        return written
    except BaseException as error:
        # An incomplete export would block the next one.
        shutil.rmtree(target, ignore_errors=True)
        target.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise _refused(target, error) from error
        raise


def _refused(target: Path, error: OSError) -> RecordingError:
    return RecordingError(f"out = {str(target)!r}: cannot be written: {reason(error)}")


def _arrays(bag: Bag, topics: Iterable[str]) -> dict[str, Any]:
    return {
        f"{_file_stem(topic)}.{_headed(name, unit)}": array
        for topic in topics
        for name, (array, unit) in _fields(bag, topic).items()
    }


def _structures(bag: Bag, topics: Iterable[str]) -> dict[str, Any]:
    structures: dict[str, Any] = {}
    topics = [*topics]
    names = _matlab_names([_file_stem(topic) for topic in topics])
    for topic, name in zip(topics, names, strict=True):
        fields = {name.replace(".", "_"): field for name, field in _fields(bag, topic).items()}
        values = {
            name: array.astype(object) if array.dtype.kind == "U" else array for name, (array, _) in fields.items()
        }
        structures[name] = values | {"units": {field: unit for field, (_, unit) in fields.items()}}
    return structures


def _matlab_names(names: Sequence[str]) -> list[str]:
    """Return ``names`` as MATLAB reads them: a letter first, at most 63 letters, digits and underscores, and unique."""
    found = [INCOMPLETE]
    for name in names:
        usable = re.sub(r"\W", "_", name, flags=re.ASCII)
        usable = usable if re.match("[A-Za-z]", usable) else f"x{usable}"
        ends = ("", *(f"_{number}" for number in range(2, len(names) + 2)))
        found.append(next(n for n in (usable[: _MATLAB_LETTERS - len(end)] + end for end in ends) if n not in found))
    return found[1:]


def _file_stem(topic: str) -> str:
    return topic.strip("/").replace("/", "_")


def _columns(bag: Bag, topic: str) -> tuple[dict[str, NDArray[Any]], dict[str, Units]]:
    """Return the fields of a topic, and their units, both by name; the first is the simulated ``time`` (s)."""
    return {"time": bag.times(topic) * 1e-9} | bag.columns(topic), {"time": Units(("s",))} | bag.units(topic)


def _fields(bag: Bag, topic: str) -> dict[str, tuple[NDArray[Any], str]]:
    """Return each field of a topic, by name, as (array, unit); fields other than texts and number arrays are JSON."""
    columns, units = _columns(bag, topic)
    fields = {}
    for name, column in columns.items():
        array = column if column.dtype != object else np.array([_text(value) for value in column], np.str_)
        fields[name] = array, units[name].together(column.shape[1] if column.ndim > 1 else 1)
    return fields


def table(columns: Mapping[str, NDArray[Any]], units: Mapping[str, Units]) -> dict[str, NDArray[Any]]:
    """Return a table of messages, {name with unit: column}: a column for each number, and one for each other field.

    A sequence of numbers has as many columns as its longest value; shorter values are padded with NaN. Fields that are
    neither numbers nor texts become texts in JSON.

    Args:
        columns: Fields of messages from :mod:`hsv.bags.columns`.
        units: Units of the fields from :func:`hsv.bags.units.units_of`.
    """
    table: dict[str, NDArray[Any]] = {}
    for name, column in columns.items():
        if column.dtype == object and len(column) and all(_is_numbers(value) for value in column):
            column = _padded(column)
        if column.ndim > 1:
            for index in range(column.shape[1]):
                table[_headed(f"{name}[{index}]", units[name].of(index))] = column[:, index]
        elif column.dtype == object:
            table[_headed(name, units[name].of())] = np.array([_text(value) for value in column], object)
        else:
            table[_headed(name, units[name].of())] = column
    return table


def _headed(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _is_numbers(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiub"


def _padded(column: NDArray[Any]) -> NDArray[np.float64]:
    wide = np.full((len(column), max(len(value) for value in column)), np.nan)
    for row, value in zip(wide, column, strict=True):
        row[: len(value)] = value
    return wide


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return json.dumps(value.tolist() if isinstance(value, np.ndarray) else value)


def _write(path: Path, table: dict[str, NDArray[Any]]) -> Path:
    import pyarrow
    from pyarrow import csv, parquet

    write = csv.write_csv if path.suffix == f".{Format.csv}" else parquet.write_table
    write(pyarrow.table({name: pyarrow.array(column) for name, column in table.items()}), path)
    return path
