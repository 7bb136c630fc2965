"""Answers of a series that is rendered in process: parts of their messages as rows of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import wire
from .answer import Touch
from .series import CARRIED, MEMBERS, TIMES, Array, Series
from .wire import SIDE_PX

Rooms: TypeAlias = list[tuple[int, NDArray[np.uint8]]]
"""Places in the message of an answer, and where what begins there goes."""
_MAP_BYTES: Final = 4 * SIDE_PX**2
_RATES_HEAD: Final = "head of the rates"


class Rows:
    """A row for each frame, of the header and of each section; read once all are there."""

    def __init__(self, count: int, ready: dict[str, Any]) -> None:
        self._ready = ready
        self._heads = np.zeros(count, wire.HEAD)
        self._offsets: dict[str, int] = {}
        self._rows: dict[str, NDArray[np.uint8]] = {}
        for section in ready["sections"]:
            name, offset, size = section["name"], section["offset"], section["bytes"]
            if name == "rates":
                self._room(_RATES_HEAD, offset, wire.RATES_HEAD, count)
                offset, size = offset + wire.RATES_HEAD, size - wire.RATES_HEAD
            self._room(name, offset, size, count)

    def _room(self, name: str, offset: int, size: int, count: int) -> None:
        self._offsets[name], self._rows[name] = offset, np.empty((count, size), np.uint8)

    @staticmethod
    def fit(ready: dict[str, Any]) -> bool:
        """Whether each answer of a session has the same numbers at the same places."""
        is_windowed = "contact_window" in ready["session_effects"]
        return not is_windowed and all(section["name"] != "spikes" for section in ready["sections"])

    def rooms(self, first: int, count: int) -> list[Rooms]:
        """Those of each of `count` frames."""
        heads = self._heads.view(np.uint8).reshape(-1, wire.HEAD.itemsize)
        offsets = [0, *(self._offsets[name] for name in self._rows)]
        columns = [rows[first : first + count] for rows in (heads, *self._rows.values())]
        return [list(zip(offsets, rows, strict=True)) for rows in zip(*columns, strict=True)]

    def has_flag(self, name: str, first: int, count: int) -> bool:
        """Whether an answer has a flag."""
        bit = next(bit for bit, own in wire.FLAGS.items() if own == name)
        return bool((self._heads["flags"][first : first + count] & bit).any())

    def series(self, tier: str, times_s: NDArray[np.float64] | None, warnings: Sequence[str], seconds: float) -> Series:
        """All of it."""
        tiers, flags = np.full(len(self._heads), tier), self._heads["flags"].copy()
        return Series(times_s, self._values(), flags, tiers, self._ready, None, warnings, seconds)

    def _values(self) -> dict[str, Array]:
        rows, heads = self._rows, self._heads
        found: dict[str, Array] = {}
        if "vertices" in rows:
            found["sed_j_per_m3"] = self._scaled("vertices", heads["scale"])[:, : self._ready["vertices"]]
        elif "map" in rows:
            found["sed_j_per_m3"] = _square(self._scaled("map", heads["scale"]))
        if "rates" in rows:
            found["rates_hz"] = _square(self._scaled("rates", rows[_RATES_HEAD][:, :4].view("<f4")[:, 0]))
        for section, (_, name) in CARRIED.items():
            if section in rows and section != "rates":
                values = rows[section].view("<f4")
                if section in ("shear", "displacement"):
                    values = values.reshape(len(heads), -1, 3)
                found[name] = _square(values) if section == "pressure" else values
        for section, (kind, start) in MEMBERS.items():
            if section in rows:
                numbers = rows[section].view("<f4").astype(np.float64)
                columns = _touch(numbers) if kind is Touch else numbers.T.copy()
                found |= {f"{start}{name}": column for name, column in zip(kind._fields, columns, strict=True)}
        for name in TIMES:
            found[name] = heads[name].astype(np.int64)
        return found

    def _scaled(self, section: str, scale: NDArray[np.float32]) -> NDArray[np.float32]:
        return wire.scaled_rows(self._rows[section], self._ready["answer_sample_type"], scale)


def _square(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Maps as such; values at vertices as they are."""
    return values.reshape(-1, SIDE_PX, SIDE_PX) if 4 * values.shape[1] == _MAP_BYTES else values


def _touch(numbers: NDArray[np.float64]) -> list[Array]:
    """The members of `Touch`, of the numbers in its section."""
    found: list[Array] = []
    at = 0
    for name in Touch._fields:
        if name in ("force_n", "torque_n_mm", "centre_mm"):
            found.append(numbers[:, at : at + 3].copy())
            at += 3
        else:
            found.append(numbers[:, at].copy())
            at += 1
    return found
