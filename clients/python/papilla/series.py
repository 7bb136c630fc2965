"""The answers to a series of frames, as arrays."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from . import save
from .answer import NOT_STATED, Answer, ErrorEstimate, Summary, Touch
from .errors import NotCarried
from .spikes import SpikeTrains
from .wire import FLAGS, SIDE_PX

if TYPE_CHECKING:
    from datetime import datetime

    import xarray

Array = NDArray[Any]

CARRIED: Final = {
    "rates": ("rates", "rates_hz"),
    "pressure": ("pressure_pa", "pressure_pa"),
    "shear": ("shear_pa", "shear_pa"),
    "displacement": ("displacement_mm", "displacement_mm"),
    "points": ("points", "points_j_per_m3"),
    "point_rates": ("point_rates_hz", "point_rates_hz"),
    "actuators": ("actuators", "actuators"),
}
"""By the section of an answer that holds it: the member of `Answer`, and what a series calls it."""
MEMBERS: Final[dict[str, tuple[type[Touch | Summary | ErrorEstimate], str]]] = {
    "touch": (Touch, "touch_"),
    "summary": (Summary, "summary_"),
    "error_estimate": (ErrorEstimate, "error_"),
}
"""By the section of an answer: the type whose members are quantities of a series, and what their names begin with."""
TIMES: Final = ("total_us", "queue_us", "infer_us")
"""Times in the service, which every answer has."""


class Series:
    """What came of a series of frames.

    `values` has an array for each quantity, with the frame as first axis. What there is depends on the hello:
    `sed_j_per_m3`, `rates_hz`, `pressure_pa`, `shear_pa`, `displacement_mm`, `points_j_per_m3`,
    `point_rates_hz`, `actuators`, the members of `Touch` and `Summary` as `touch_force_n`, `summary_sa1_rate_hz` and
    so on, how wrong each answer is likely to be (the members of `ErrorEstimate`, as `error_sed_p90`; infinite where
    nothing is stated), and times in the service. `series["sed_j_per_m3"]` is the same as
    `series.values["sed_j_per_m3"]`.
    """

    def __init__(
        self,
        times_s: NDArray[np.float64] | None,
        values: dict[str, Array],
        flags: NDArray[np.uint8],
        tier: Array,
        ready: dict[str, Any],
        spikes: SpikeTrains | None,
        warnings: Sequence[str],
        seconds: float,
    ) -> None:
        self.times_s = times_s
        """Time of each frame as it was given, s; None without times."""
        self.values = values
        self.flags = flags
        """Bits of `papilla.wire.FLAGS`; `flag_names` has words."""
        self.tier = tier
        """Name of the model of each frame."""
        self.ready = ready
        """What the service agreed to."""
        self.spikes = spikes
        """With the effect `spikes`; its times begin at 0 with the first frame."""
        self.warnings = list(warnings)
        """What a person should know; see `Session.warnings`."""
        self.seconds = seconds
        """How long it took."""
        self.about: dict[str, Any] = {}
        """What files are to say besides, text and numbers by name."""

    def __len__(self) -> int:
        return len(self.flags)

    def __getitem__(self, name: str) -> Array:
        if name not in self.values:
            raise NotCarried(name, f"this series has {', '.join(self.values)}; ask for more in the hello")
        return self.values[name]

    def __repr__(self) -> str:
        named = ", ".join(f"{name} {array.shape[1:] or ''}".strip() for name, array in self.values.items())
        return f"<papilla.Series of {len(self)} frames, {self.flagged()} flagged: {named}>"

    @property
    def sed(self) -> Array:
        """SED, J/m3: (frame, row, column), or (frame, vertex)."""
        return self["sed_j_per_m3"]

    @property
    def rates_hz(self) -> Array:
        """Firing rates of SA1 afferents, Hz; needs the effect `afferents`."""
        return self["rates_hz"]

    @property
    def force_n(self) -> Array:
        """Force on the finger, N: (frame, 3) of objects and gaps."""
        return self["touch_force_n"]

    def flag_names(self, frame: int) -> list[str]:
        """The flags of one frame, such as `out_of_range`."""
        return [name for bit, name in FLAGS.items() if self.flags[frame] & bit]

    def flagged(self, name: str | None = None) -> int:
        """How many frames have a flag (by name, or any but `no_contact`)."""
        bits = [bit for bit, own in FLAGS.items() if own == name or (name is None and own != "no_contact")]
        return int(np.count_nonzero(self.flags & np.uint8(sum(bits))))

    def dimensions(self, name: str) -> tuple[str, ...]:
        """Names of the axes of a quantity."""
        first = "time" if self.times_s is not None else "frame"
        shape = self.values[name].shape[1:]
        if shape == (SIDE_PX, SIDE_PX):
            return (first, "row", "column")
        if name in ("shear_pa", "displacement_mm"):
            return (first, "vertex", "axis")
        if name.startswith("touch_") and shape:
            return (first, "axis")
        others = {"points_j_per_m3": "point", "point_rates_hz": "point", "actuators": "actuator"}
        return (first, others.get(name, "vertex")) if shape else (first,)

    def to_xarray(self) -> xarray.Dataset:
        """As a Dataset with units, flags and tier; raises MissingExtra without `papilla[xarray]`."""
        return save.dataset(self)

    def to_netcdf(self, path: str | PathLike[str]) -> None:
        """Writes `to_xarray()` as NetCDF 4; raises MissingExtra without `papilla[xarray]`."""
        save.netcdf(self, path)

    def to_npz(self, path: str | PathLike[str]) -> None:
        """Writes all arrays as a compressed NPZ of NumPy, which needs nothing more."""
        save.npz(self, path)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Writes a row for each frame: all numbers, and the greatest value of each map.

        What other files have as attributes goes into a JSON file beside it: `a.csv.json` beside `a.csv`.
        """
        save.csv(self, path)

    def to_nwb(self, path: str | PathLike[str], start: datetime | None = None) -> None:
        """Writes a Neurodata Without Borders file; needs times; raises MissingExtra without `papilla[nwb]`."""
        save.nwb(self, path, start)


class Columns:
    """Collects answers row by row; `put` may be called from several threads for different rows."""

    def __init__(self, count: int, ready: dict[str, Any], in_order: bool) -> None:
        self._count = count
        self._ready = ready
        self._values: dict[str, Array] = {}
        self._flags = np.zeros(count, np.uint8)
        self._tier: list[str] = [""] * count
        self._spikes = SpikeTrains(ready, resumed=True) if in_order and "units" in ready else None
        self._lock = threading.Lock()

    def put(self, row: int, answer: Answer) -> None:
        """Takes the answer of one frame."""
        if self._spikes is not None:
            self._spikes.add(answer)
        self._tier[row] = answer.tier
        self._flags[row] = sum(bit for bit, name in FLAGS.items() if getattr(answer, name))
        for name, value in _quantities(answer).items():
            array = self._values.get(name)
            if array is None:
                with self._lock:
                    found = np.asarray(value)
                    empty = np.zeros((self._count, *found.shape), found.dtype)
                    array = self._values.setdefault(name, empty)
            array[row] = value

    def series(self, times_s: NDArray[np.float64] | None, warnings: Sequence[str], seconds: float) -> Series:
        """All of it."""
        tier = np.array(self._tier)
        return Series(times_s, self._values, self._flags, tier, self._ready, self._spikes, warnings, seconds)


def _quantities(answer: Answer) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if answer.values is not None or answer.vertices is not None:
        found["sed_j_per_m3"] = answer.sed
    for member, name in CARRIED.values():
        value = getattr(answer, member)
        if value is not None:
            found[name] = value
    for section, (kind, start) in MEMBERS.items():
        members = getattr(answer, section)
        if members is not None and members is not NOT_STATED:
            found |= {f"{start}{name}": np.asarray(getattr(members, name), np.float64) for name in kind._fields}
    for name in TIMES:
        found[name] = np.int64(getattr(answer, name))
    return found


def joined(parts: list[Series]) -> Series:
    """Parts of a series, one after the other."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    values = {name: np.concatenate([part.values[name] for part in parts]) for name in first.values}
    spikes = first.spikes
    if spikes is not None:
        for part in parts[1:]:
            if part.spikes is not None:
                spikes.append(part.spikes)
    return Series(
        None if first.times_s is None else np.concatenate([part.times_s for part in parts if part.times_s is not None]),
        values,
        np.concatenate([part.flags for part in parts]),
        np.concatenate([part.tier for part in parts]),
        first.ready,
        spikes,
        sorted({words for part in parts for words in part.warnings}),
        sum(part.seconds for part in parts),
    )
