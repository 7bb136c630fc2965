"""Readings over time, from files."""

from __future__ import annotations

import csv
import math
import re
import zipfile
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from os import PathLike
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .. import check
from ..errors import BadInput
from .bags import is_bag, read_bag
from .record import Record, from_zero

TIME_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_UNITS: Final = ", ".join(TIME_UNITS)
_SPELLED: Final = {"sec": "s", "secs": "s", "seconds": "s", "msec": "ms", "milliseconds": "ms", "usec": "us"}
_EPOCH: Final = datetime(2020, 1, 1, tzinfo=UTC)
_TIME_NAMES: Final = ("time", "t", "timestamp", "stamp")


def read_record(
    path: str | PathLike[str],
    *,
    time: str | None = None,
    time_unit: str | None = None,
    rate_hz: float | None = None,
    columns: Sequence[str] | str | None = None,
    topic: str | None = None,
    field: str | None = None,
) -> Record:
    """Reads a record from CSV (a header, then a row for each moment), NPZ (`times_s` and `readings`) or a ROS bag.

    `time` names the column of times; without it one is looked for (`time_s`, `t_ms`, `timestamp` and so on).
    `time_unit` is s, ms, us or ns; without it the end of the name says it. `rate_hz` stands in for times.
    A time may also be a date and time as of ISO 8601, such as 2026-03-01T12:00:00.250.
    `columns` lists the taxels in their order, or gives what their names begin with, followed by their numbers, by
    which they are then sorted; without it all columns but time are taken as they stand.
    Of a bag (a folder of ROS 2, .mcap, .db3, .bag) `topic` carries the readings, and `field` is the member of its
    messages that holds them; see `read_bag`. Raises BadInput with line and column.
    """
    file = Path(path)
    if not file.exists():
        raise BadInput("record", f"{file} does not exist")
    if is_bag(file):
        return read_bag(file, topic, field=field)
    if not file.is_file():
        raise BadInput("record", f"{file} is a folder without a metadata.yaml, so no bag of ROS 2")
    if topic is not None or field is not None:
        raise BadInput("topic", f"{file.name} is no bag of ROS: topic and field are of those")
    if file.suffix == ".npz":
        return _npz(file, time or "times_s", time_unit, rate_hz)
    if file.suffix.lower() not in (".csv", ".tsv", ".txt"):
        raise BadInput("record", f"{file.name} is none of .csv, .tsv, .txt, .npz, .mcap, .db3 and .bag")
    names, values, dated, lines = _table(file)
    at = _time_column(names, time, rate_hz)
    own = _taxel_columns(file, names, columns, at)
    readings = values[:, own]
    missing = np.argwhere(~np.isfinite(readings).any(axis=1))
    if len(missing):
        raise BadInput("record", f"{file.name}, line {lines[int(missing[0, 0])]}: no taxel has a reading")
    if at is None:
        times_s = np.arange(len(values)) / _rate(rate_hz)
    else:
        times_s = values[:, at] * (1.0 if at in dated else _time_factor(names[at], time_unit))
    for column in own:
        if column in dated:
            raise BadInput("record", f"{file.name}, column '{names[column]}': dates, where readings are due")
    start = _EPOCH + timedelta(seconds=float(times_s[0])) if at in dated else None
    return Record(from_zero(times_s), readings, [names[i] for i in own], start, lines)


def _npz(file: Path, time: str, time_unit: str | None, rate_hz: float | None) -> Record:
    try:
        with np.load(file, allow_pickle=False) as archive:
            held = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise BadInput("record", f"{file.name} is no readable NPZ ({error})") from error
    if "readings" not in held:
        raise BadInput("record", f"{file.name} has {', '.join(held)}; an array 'readings' (frames, taxels) is due")
    readings = check.numbers(held["readings"], "readings").astype(np.float64)
    if readings.ndim not in (2, 3) or not len(readings):
        raise BadInput("readings", f"shape {readings.shape}; (frames, taxels) or (frames, rows, columns) is due")
    readings = readings.reshape(len(readings), -1)
    if time in held:
        times_s = check.numbers(held[time], time).astype(np.float64) * _time_factor(time, time_unit)
    else:
        times_s = np.arange(len(readings)) / _rate(rate_hz)
    return Record(from_zero(check.times(times_s, len(readings))), readings, [str(i) for i in range(readings.shape[1])])


def _table(file: Path) -> tuple[list[str], NDArray[np.float64], set[int], list[int]]:
    """Names of columns, numbers, the columns of dates, whose numbers are s, and the line of each row.

    Empty cells and `nan` are NaN.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput("record", f"{file.name} is no text in UTF-8 ({error})") from error
    numbered = [(at, line) for at, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    places, lines = [at for at, _ in numbered[1:]], [line for _, line in numbered]
    if len(lines) < 2:
        raise BadInput("record", f"{file.name} needs a header and a line for each moment")
    marks = {mark: lines[0].count(mark) for mark in (",", ";", "\t")}
    mark = max(marks, key=lambda each: marks[each])
    rows = list(csv.reader(lines, delimiter=mark))
    names = [name.strip() for name in rows[0]]
    if all(_is_number(name) for name in names):
        raise BadInput("record", f"{file.name} has no header: its first line should name the columns, as time_s,t0,t1")
    values, dated = np.empty((len(rows) - 1, len(names))), set[int]()
    for number, row in enumerate(rows[1:]):
        if len(row) != len(names):
            raise BadInput("record", f"{file.name}, line {places[number]}: {len(row)} cells for {len(names)} columns")
        for column, cell in enumerate(row):
            cell = cell.strip()
            if mark == ";":
                cell = cell.replace(",", ".")
            if cell and not _is_number(cell):
                second = _second(cell)
                if second is not None and (number == 0 or column in dated):
                    dated.add(column)
                    values[number, column] = second
                    continue
                raise BadInput(
                    "record", f"{file.name}, line {places[number]}, column '{names[column]}': {cell!r} is no number"
                )
            values[number, column] = float(cell) if cell else math.nan
    return names, values, dated, places


def _second(text: str) -> float | None:
    """A date and time of ISO 8601, in s; without a zone as of UTC."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return (moment - _EPOCH) / timedelta(seconds=1)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _time_column(names: list[str], time: str | None, rate_hz: float | None) -> int | None:
    if time is not None:
        if time not in names:
            raise BadInput("time", f"no column '{time}'; there are {', '.join(names[:8])}")
        return names.index(time)
    for number, name in enumerate(names):
        if name.lower().rpartition("_")[0] in _TIME_NAMES or name.lower() in _TIME_NAMES:
            return number
    if rate_hz is None:
        raise BadInput("time", f"no column of times among {', '.join(names[:8])}: name it as time, or give rate_hz")
    return None


def _time_factor(name: str, unit: str | None) -> float:
    """Seconds of a step of a column; without a unit the end of its name says it."""
    if unit is None:
        stem, _, end = name.lower().rpartition("_")
        unit = _SPELLED.get(end, end)
        if unit not in TIME_UNITS and stem in _TIME_NAMES and end not in _TIME_NAMES:
            raise BadInput("time_unit", f"{end!r} of column '{name}' is no unit of time: say which of {_UNITS} is")
        unit = unit if unit in TIME_UNITS else "s"
    if unit not in TIME_UNITS:
        raise BadInput("time_unit", f"{unit!r} is none of {_UNITS}")
    return TIME_UNITS[unit]


def _taxel_columns(file: Path, names: list[str], columns: Sequence[str] | str | None, time: int | None) -> list[int]:
    """Columns in the order of the taxels; raises BadInput where that order is in doubt."""
    own = [number for number in range(len(names)) if number != time]
    if isinstance(columns, str):
        own = [number for number in own if names[number].startswith(columns)]
        ends = [names[number].removeprefix(columns) for number in own]
        if all(end.isdecimal() for end in ends):
            own = [number for _, number in sorted(zip(map(int, ends), own, strict=True))]
    elif columns is not None:
        missing = [name for name in columns if name not in names]
        if missing:
            raise BadInput("columns", f"no column '{missing[0]}'; there are {', '.join(names[:8])}")
        own = [names.index(name) for name in columns]
    if not own:
        raise BadInput("columns", f"no column of readings among {', '.join(names[:8])}")
    taken = [names[number] for number in own]
    twice = [name for name in taken if taken.count(name) > 1 or names.count(name) > 1]
    if twice:
        raise BadInput(
            "columns", f"{file.name}: '{twice[0]}' stands twice; each taxel has a column with a name of its own"
        )
    if columns is None:
        _check_order(file, taken)
    return own


def _check_order(file: Path, names: list[str]) -> None:
    """Raises BadInput for columns that are numbered and not in the order of their numbers."""
    found = [re.fullmatch(r"(.*?)(\d+)", name) for name in names]
    stems = {match[1] for match in found if match}
    if None in found or len(stems) != 1:
        return
    numbers = [int(match[2]) for match in found if match]
    for before, after in zip(range(len(numbers)), range(1, len(numbers)), strict=False):
        if numbers[after] <= numbers[before]:
            raise BadInput(
                "columns",
                f"{file.name}: '{names[after]}' stands after '{names[before]}', so that it is open which taxel is "
                f"which: columns = {stems.pop()!r} takes them by their numbers, a list of all names in its own order",
            )


def _rate(rate_hz: float | None) -> float:
    if rate_hz is None:
        raise BadInput("rate_hz", "the record has no times: give the rate of its frames")
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise BadInput("rate_hz", f"{rate_hz}; a rate above 0 is due")
    return rate_hz
