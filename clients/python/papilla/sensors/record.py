"""Readings over time."""

from __future__ import annotations

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


def from_zero(times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times from the first on; raises BadInput unless they rise."""
    checked = check.times(times_s, len(times_s))
    shifted: NDArray[np.float64] = checked - checked[0]
    return shifted
