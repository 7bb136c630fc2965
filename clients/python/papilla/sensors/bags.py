"""Readings over time, from bags of ROS."""

from __future__ import annotations

from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import BadInput, MissingExtra
from .record import Record, from_zero

Reals = NDArray[np.float64]
_FILES: Final = (".bag", ".db3", ".mcap")
_DATES_NS: Final = 10**18
"""Of 2001; stamps before it are no dates."""


def is_bag(path: Path) -> bool:
    """A bag of ROS 1 or 2: a file, or a folder with its metadata."""
    return (path / "metadata.yaml").is_file() if path.is_dir() else path.suffix.lower() in _FILES


def read_bag(path: str | PathLike[str], topic: str | None, *, field: str | None = None) -> Record:
    """Reads the messages of a topic as readings; needs `papilla[ros]`, and no ROS.

    `field` names the member of a message that holds the readings of all taxels, dotted where it lies deeper;
    without it the only array of numbers is taken, as `data` of `std_msgs/Float32MultiArray`. Times are those of
    `header.stamp` if messages have one, else those at which they were recorded. Raises BadInput, MissingExtra.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise MissingExtra("a bag of ROS", "ros") from error
    file = Path(path)
    stamps: list[int] = []
    readings: list[Reals] = []
    try:
        # A bag without definitions of its messages has those of a usual ROS 2.
        with AnyReader([file], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            connections = [connection for connection in reader.connections if connection.topic == topic]
            if not connections:
                known = ", ".join(sorted({connection.topic for connection in reader.connections})) or "none"
                wrong = "name the topic of the readings" if topic is None else f"{file.name} has no topic {topic!r}"
                raise BadInput("topic", f"{wrong}; there are {known}")
            for connection, recorded_ns, raw in reader.messages(connections=connections):
                message = reader.deserialize(raw, connection.msgtype)
                stamps.append(_stamp_ns(message) or recorded_ns)
                readings.append(_numbers(file, message, field, len(readings)))
    except (AnyReaderError, OSError) as error:
        raise BadInput("record", f"{file.name} is no readable bag of ROS ({error})") from error
    if not readings:
        raise BadInput("record", f"{file.name} has no message on {topic}")
    for number, values in enumerate(readings):
        if len(values) != len(readings[0]):
            raise BadInput(
                "record",
                f"{file.name}: message {number} of {topic} has {len(values)} readings, the first {len(readings[0])}",
            )
    # Nanoseconds of an epoch have more digits than a float.
    times_s = 1e-9 * np.array([stamp - stamps[0] for stamp in stamps], np.float64)
    names = [str(i) for i in range(len(readings[0]))]
    # The clock of a simulation begins near 0.
    start = datetime.fromtimestamp(1e-9 * stamps[0], UTC) if stamps[0] > _DATES_NS else None
    return Record(from_zero(times_s), np.stack(readings), names, start)


def _stamp_ns(message: Any) -> int:
    """Of the header; 0 without one, or if nobody set it."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _numbers(file: Path, message: Any, field: str | None, number: int) -> Reals:
    """The readings of one message."""
    where = f"{file.name}, message {number}"
    if field is None:
        arrays = [name for name, value in vars(message).items() if _is_array(value)]
        if len(arrays) != 1:
            found = f"{', '.join(arrays)}: name one of them as field" if arrays else "no array of numbers"
            raise BadInput("field", f"{where}: a message of {message.__msgtype__} has {found}")
        field = arrays[0]
    value = message
    for part in field.split("."):
        if not hasattr(value, part):
            members = (
                ", ".join(name for name in vars(value) if name != "__msgtype__")
                if hasattr(value, "__dict__")
                else "none"
            )
            raise BadInput("field", f"{where}: no member {part!r}; there are {members}")
        value = getattr(value, part)
    if not _is_array(value):
        raise BadInput("field", f"{where}: {field} is no array of numbers")
    return np.asarray(value, np.float64).reshape(-1)


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size > 0
