"""What a sensor of some pitch and noise costs in accuracy, as measured by studies/sensors.py."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from .. import check
from ..errors import BadInput


class Expected(NamedTuple):
    """Median errors against finite elements over test states, of arrays that cover the pad."""

    sed_relative_l2: float
    """Relative L2 norm of the error of the SED map."""
    force_relative: float
    sa1_relative: float
    """Of the sum of the static rates of all SA1 afferents."""
    beyond: bool
    """The sensor is coarser or noisier than any that was measured; the errors are those of the worst one."""


def table() -> dict[str, Any]:
    """The measured table."""
    found: dict[str, Any] = json.loads(files("papilla.sensors").joinpath("accuracy.json").read_text())
    return found


def expected(pitch_mm: float, noise_share: float) -> Expected:
    """The errors to expect, between measured sensors; `noise_share` is the noise over the greatest reading.

    Raises BadInput for what is no pitch or no noise.
    """
    if check.number(pitch_mm, "pitch_mm", "a distance in mm") <= 0:
        raise BadInput("pitch_mm", f"{pitch_mm}; a distance above 0 is due")
    if check.number(noise_share, "noise_share", "a share of the greatest reading") < 0:
        raise BadInput("noise_share", f"{noise_share}; a share of the greatest reading is due, 0 or above")
    rows = table()["rows"]
    pitches = np.array(sorted({row["pitch_mm"] for row in rows}))
    noises = np.array(sorted({row["noise"] for row in rows}))
    at = {(row["pitch_mm"], row["noise"]): row for row in rows}

    def between(name: str) -> float:
        grid = np.array([[at[pitch, noise][name]["median"] for noise in noises] for pitch in pitches])
        along = [float(np.interp(noise_share, noises, line)) for line in grid]
        return float(np.interp(np.log(pitch_mm), np.log(pitches), along))

    beyond = bool(pitch_mm > pitches[-1] * 1.01 or noise_share > noises[-1] * 1.01)
    return Expected(between("sed_relative_l2"), between("force_relative"), between("sa1_relative"), beyond)
