"""Spikes of a whole session, with the effect `spikes`, as arrays and files."""

from __future__ import annotations

from datetime import UTC, datetime
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .answer import Answer
from .errors import MissingExtra, PapillaError


class SpikeTrains:
    """Collects the spikes of one finger of a session, frame by frame.

    `trains = SpikeTrains(session.ready)`, then `trains.add(answer)` for every answer.
    """

    def __init__(self, ready: dict[str, Any], finger: int = 0, *, resumed: bool = False) -> None:
        """Raises PapillaError if the session has no effect `spikes`. `resumed`: spikes before do not count as lost."""
        if "units" not in ready:
            raise PapillaError("the session does not name the effect 'spikes'")
        self.finger = finger
        self.atlas_hash: str = ready["atlas_hash"]
        self.classes = np.array([unit["class"] for unit in ready["units"]])
        """`sa1`, `ra` or `pc` of each unit."""
        self.models = np.array([unit["model"] for unit in ready["units"]], np.uint8)
        self.px = np.array([unit["px"] for unit in ready["units"]], np.float32)
        """Place of each unit in the map, (column + 0.5, row + 0.5)."""
        self.lost = 0
        """Spikes that no answer carried: of late answers, or beyond `spikes_max`."""
        self._total = None if resumed else 0
        self._units: list[NDArray[np.uint16]] = []
        self._times_us: list[NDArray[np.int64]] = []

    def add(self, answer: Answer) -> None:
        """Takes the next answer; those of other fingers and without spikes are passed over."""
        if answer.spikes is None or answer.finger != self.finger:
            return
        if self._total is None:
            self._total = answer.spikes.total - len(answer.spikes.unit)
        fired = (answer.spikes.total - self._total) % 2**32
        self._total = answer.spikes.total
        self.lost += fired - len(answer.spikes.unit)
        self._units.append(answer.spikes.unit)
        self._times_us.append(answer.spikes.time_us)

    def append(self, later: SpikeTrains) -> None:
        """Takes the spikes of a later part of the same session."""
        self._units += later._units
        self._times_us += later._times_us
        self.lost += later.lost

    @property
    def unit(self) -> NDArray[np.uint16]:
        """The unit of every spike, in the order of time."""
        return np.concatenate([np.zeros(0, np.uint16), *self._units])

    @property
    def time_us(self) -> NDArray[np.int64]:
        """The time of every spike, by the client's clock."""
        return np.concatenate([np.zeros(0, np.int64), *self._times_us])

    def of(self, unit: int) -> NDArray[np.int64]:
        """The times of one unit, us."""
        times_us: NDArray[np.int64] = self.time_us[self.unit == unit]
        return times_us

    def save_npz(self, path: str | PathLike[str]) -> None:
        """Writes `unit`, `time_us` of every spike; `unit_class`, `unit_model`, `unit_px`; `lost`, `atlas_hash`."""
        np.savez(
            path,
            unit=self.unit,
            time_us=self.time_us,
            unit_class=self.classes,
            unit_model=self.models,
            unit_px=self.px,
            lost=self.lost,
            atlas_hash=self.atlas_hash,
        )

    def save_nwb(self, path: str | PathLike[str], start: datetime | None = None) -> None:
        """Writes the units table of a Neurodata Without Borders file, times in s from the first spike on.

        Raises MissingExtra without `papilla[nwb]`. `start`: when the session began (now).
        """
        try:
            from pynwb import NWBHDF5IO, NWBFile
        except ImportError as error:
            raise MissingExtra("an NWB file", "nwb") from error
        file = NWBFile(
            session_description=f"simulated touch units of a fingertip, {self.lost} spikes lost",
            identifier=f"papilla-{self.atlas_hash}",
            session_start_time=start or datetime.now(UTC),
        )
        times_us = self.time_us
        self.add_units(file, -1e-6 * int(times_us.min()) if times_us.size else 0.0)
        with NWBHDF5IO(str(path), "w") as out:
            out.write(file)

    def add_units(self, file: Any, first_s: float = 0.0) -> None:
        """Adds the units table to an `NWBFile`; spikes at 0 of the client's clock are at `first_s`."""
        file.add_unit_column("unit_class", "sa1, ra or pc")
        file.add_unit_column("unit_model", "number of the model neuron of its class")
        file.add_unit_column("px", "place in the map, column and row")
        units, times_us = self.unit, self.time_us
        for unit, (kind, model, px) in enumerate(zip(self.classes, self.models, self.px, strict=True)):
            times_s = 1e-6 * times_us[units == unit] + first_s
            file.add_unit(spike_times=times_s, unit_class=str(kind), unit_model=int(model), px=px)
