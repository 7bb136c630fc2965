"""How strongly to drive the pins or electrodes of a tactile display for SED that is known, computed in this process."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._felt import Feel, stacked
from .wire import Map

__all__ = ["intensities"]


def intensities(
    sed_j_per_m3: ArrayLike,
    times_s: ArrayLike | None = None,
    *,
    layout: Mapping[str, Any],
    effects: Sequence[str] = (),
    bundle: str | os.PathLike[str] | None = None,
    **hello: Any,
) -> Map:
    """Intensities of each actuator for a map of SED (224, 224), J/m3, or for a series (n, 224, 224).

    `layout` is the member `actuators` of a hello: places, and how intensities are found; its `drive` may be `formula`
    or `fitted`. A layout whose input is `sa1_rate` needs `effects=["afferents"]` and `times_s`. The bits are those of a
    session that found the same SED. Raises BadInput and Refused.
    """
    feel = Feel(bundle=bundle, map=False, actuators=dict(layout), **hello, effects=["actuators", *effects])
    if times_s is None:
        maps = np.asarray(sed_j_per_m3)
        found = [feel.step(one) for one in (maps if maps.ndim == 3 else maps[None])]
        values = stacked([one.actuators for one in found])
        return values if maps.ndim == 3 else values[0]
    return stacked([one.actuators for one in feel.series(sed_j_per_m3, times_s)])
