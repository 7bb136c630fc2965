"""What is felt of maps of SED that are known: firing rates, spikes and actuators, computed in this process."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import answer as answers
from . import check, wire
from .answer import Answer
from .errors import BadInput
from .link import Warned
from .model import folder, native
from .spikes import SpikeTrains
from .wire import SIDE_PX, WHOLE, Map

if TYPE_CHECKING:
    from . import _native

_SEQUENCES: Final = 2**32


class Feel:
    """Effects of a hello on maps of SED: the answers of a session, without its network.

    `effects` and their parameters are those of a hello (docs/reference/protocol-effects.md); `relaxation`,
    `shear_energy` and the drive `corrected` of actuators need a session. Raises Refused, BadModels, NativeMissing.
    """

    def __init__(self, *, bundle: str | os.PathLike[str] | None = None, **hello: Any) -> None:
        """`bundle` is a finger's folder, of which the atlas is read; by default that of the wheel's finger."""
        self._hello = wire.hello(hello)
        self._folder = folder(bundle)
        self._warned = Warned()
        self._native: _native.Feel
        self.reset()

    def reset(self) -> None:
        """Forgets the maps before: rates and units are at rest."""
        self._native = native().Feel(self._folder, self._hello)
        self.ready: dict[str, Any] = json.loads(self._native.told())
        """What a session's ready says of the effects: sections, units, atlas."""
        self._sequence = 0

    @property
    def warnings(self) -> list[str]:
        """What was logged for people to read, each once."""
        return self._warned.words

    def step(self, sed_j_per_m3: ArrayLike, time_s: float = 0.0, *, pressure_pa: ArrayLike | None = None) -> Answer:
        """The answer to one map of SED (224, 224), J/m3, at a time that counts from 0.

        `pressure_pa` is the pressure under which it came about, by which `spikes` of PC units and the force of
        `summary` go; without it there is none. What is remembered goes on from the call before.
        """
        sed = _map(sed_j_per_m3, "sed_j_per_m3", "sed")
        pressure = np.zeros_like(sed) if pressure_pa is None else _map(pressure_pa, "pressure_pa", "pressure")
        return self._step(sed, time_s, pressure)

    def _step(self, sed: Map, time_s: float, pressure: Map) -> Answer:
        """`step` with maps that were looked at."""
        if not 0.0 <= time_s < 1e9:
            raise BadInput("time_s", f"{time_s} s; times count from 0")
        self._sequence = (self._sequence + 1) % _SEQUENCES
        head, _ = wire.parts(sed, WHOLE, "f32", self._sequence, round(1e6 * time_s), 0)
        message = self._native.frame(head, sed, pressure)
        header = wire.decode(message)
        return answers.read(message, header, self.ready, "")

    def series(self, sed_j_per_m3: ArrayLike, times_s: ArrayLike, pressure_pa: ArrayLike | None = None) -> list[Answer]:
        """`step` for each of many maps (n, 224, 224), in their order."""
        maps, _ = check.given(sed_j_per_m3, "sed_j_per_m3", "sed")
        if maps.ndim != 3 or maps.shape[1:] != check.SIDE:
            raise BadInput("sed_j_per_m3", f"shape {maps.shape}; (frames, {SIDE_PX}, {SIDE_PX}) is due")
        times = check.times(times_s, len(maps))
        doubt = check.times_doubt(times)
        if doubt is not None:
            self._warned.once("times", doubt)
        for number, one in enumerate(maps):
            _check_finite(one, "sed_j_per_m3", number)
        nothing = np.zeros(check.SIDE, np.float32)
        under: Iterable[NDArray[Any]] = itertools.repeat(nothing, len(maps))
        if pressure_pa is not None:
            pressures, said = check.given(pressure_pa, "pressure_pa", "pressure")
            if not said:
                self._warned.ask_unit(pressures, "pressure")
            for number, one in enumerate(pressures):
                _check_finite(one, "pressure_pa", number)
            if pressures.shape != maps.shape:
                raise BadInput("pressure_pa", f"shape {pressures.shape}; that of the maps of SED, {maps.shape}, is due")
            under = pressures
        each = zip(maps, times, under, strict=True)
        return [self._step(_plain(one), float(time), _plain(pressure)) for one, time, pressure in each]


def _map(values: ArrayLike, member: str, kind: str) -> Map:
    array, _ = check.given(values, member, kind)
    if array.shape != check.SIDE:
        raise BadInput(member, f"shape {array.shape}; ({SIDE_PX}, {SIDE_PX}) is due")
    _check_finite(array, member, None)
    return _plain(array)


def _plain(array: NDArray[Any]) -> Map:
    return np.ascontiguousarray(array, np.float32)


def _check_finite(array: NDArray[Any], member: str, number: int | None) -> None:
    wrong = ~np.isfinite(array)
    if wrong.any():
        raise BadInput(member, check.first(wrong, array), number)


def spike_trains(feel: Feel, found: list[Answer]) -> SpikeTrains:
    """The spikes of answers, in the order of time."""
    trains = SpikeTrains(feel.ready)
    for one in found:
        trains.add(one)
    return trains


def stacked(maps: list[Any]) -> NDArray[np.float32]:
    """Maps or vectors one behind the other; of none an empty array."""
    return np.stack(maps) if maps else np.zeros((0,), np.float32)
