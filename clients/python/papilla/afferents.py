"""What the nerve fibres of a finger make of SED that is known, computed in this process.

`rates(sed, times_s)` gives firing rates of SA1 fibres, Hz; `spikes(sed, times_s, pressure)` says when units fire.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from ._felt import Feel, spike_trains, stacked
from .spikes import SpikeTrains
from .wire import Map

__all__ = ["Feel", "rates", "spikes"]


def rates(
    sed_j_per_m3: ArrayLike,
    times_s: ArrayLike,
    *,
    parameters: Mapping[str, Any] | None = None,
    bundle: str | os.PathLike[str] | None = None,
) -> Map:
    """Firing rates of SA1 fibres, Hz, as many maps (n, 224, 224) as came of SED, J/m3.

    `parameters` are those of the effect `afferents`. The bits are those of a session with that effect which found the
    same SED. Raises BadInput and Refused.
    """
    members = {} if parameters is None else {"afferents": dict(parameters)}
    feel = Feel(bundle=bundle, effects=["afferents"], **members)
    return stacked([one.rates_hz for one in feel.series(sed_j_per_m3, times_s)])


def spikes(
    sed_j_per_m3: ArrayLike,
    times_s: ArrayLike,
    pressure_pa: ArrayLike | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    bundle: str | os.PathLike[str] | None = None,
) -> SpikeTrains:
    """When the touch units of a finger fire under a series of maps (n, 224, 224) of SED, J/m3.

    `pressure_pa` are the maps of pressure; PC units go by their force, and without pressure they are silent.
    `parameters` are those of the effect `spikes`. Raises BadInput and Refused.
    """
    members = {} if parameters is None else {"spikes": dict(parameters)}
    feel = Feel(bundle=bundle, effects=["spikes"], map=False, **members)
    return spike_trains(feel, feel.series(sed_j_per_m3, times_s, pressure_pa))
