"""Readings over time."""

from __future__ import annotations

from datetime import datetime
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import check


class Record(NamedTuple):
    """Readings of a sensor over time."""

    times_s: NDArray[np.float64]
    """From the first reading on, s."""
    readings: NDArray[np.float64]
    """(frames, taxels)."""
    names: list[str]
    """Of the taxels."""
    start: datetime | None = None
    """When the first reading was made, where the record says it."""
    lines: list[int] | None = None
    """Line of each frame in a file of text."""


def from_zero(times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times from the first on; raises BadInput unless they rise."""
    checked = check.times(times_s, len(times_s))
    shifted: NDArray[np.float64] = checked - checked[0]
    return shifted
