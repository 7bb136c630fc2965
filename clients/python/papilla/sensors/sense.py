"""From a record of a sensor to what the finger felt."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from os import PathLike
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import check
from ..errors import BadInput
from ..http import DEFAULT_URL
from ..rendering import render_chunks
from ..send_series import Progress, line
from ..series import Series, joined
from ..wire import SIDE_PX, Map
from .expect import Expected, expected
from .record import Record
from .taxels import Taxels

_BATCH: Final = 64
# An array's rim that reads this share of the greatest reading probably lost a part of the contact.
_RIM: Final = 0.2
_REPRODUCED: Final = 0.05
_PRESSED: Final = 0.1
# Standard deviations of the noise beyond which a reading is none of it.
_CERTAIN: Final = 5.0
WRITERS: Final = {".nc": "to_netcdf", ".npz": "to_npz", ".csv": "to_csv", ".nwb": "to_nwb"}


class Sensed(NamedTuple):
    """What a finger felt under a sensor."""

    series: Series
    """With `sensor_reproduction` and, with maps, `sensor_pressure_pa` among its values.

    What a `Series` calls `error_sed_median` and so on is `network_error_sed_median` here: it is the error of the
    network alone, as if the sensor's map of pressure were exact.
    """
    expected: Expected
    """Errors to expect of such a sensor, against finite elements."""
    warnings: list[str]
    start: datetime | None = None
    """When the record began, where it says it."""

    def save(self, path: str | PathLike[str]) -> None:
        """Writes NetCDF, NPZ, CSV or NWB by the ending of the path.

        Sensor, errors to expect of it, and warnings are attributes of the file, those of a CSV a JSON file beside it.
        """
        if writer(path) == "to_nwb":
            self.series.to_nwb(path, self.start)
        else:
            getattr(self.series, writer(path))(path)

    def summary(self) -> dict[str, Any]:
        """The record in a few numbers, for JSON."""
        values = self.series.values
        found: dict[str, Any] = {"frames": len(self.series)}
        if self.series.times_s is not None:
            found["duration_s"] = float(self.series.times_s[-1])
        for name, key in (
            ("summary_force_n", "force_max_n"),
            ("summary_sed_max_j_per_m3", "sed_max_j_per_m3"),
            ("summary_sa1_rate_hz", "sa1_rate_max_hz"),
        ):
            if name in values:
                found[key] = float(values[name].max())
        # Where hardly anything presses, the noise is all that there is to reproduce.
        force_n = values["summary_force_n"]
        pressed = force_n > _PRESSED * force_n.max()
        found["reproduction_error_max"] = float(values["sensor_reproduction"][pressed].max()) if pressed.any() else 0.0
        if self.series.spikes is not None:
            found["spikes"] = len(self.series.spikes.unit)
        found["flagged_frames"] = self.series.flagged()
        found["tier"] = str(self.series.ready["tier"])
        found["expected_error"] = self.expected._asdict()
        found["warnings"] = self.warnings
        return found


def writer(path: str | PathLike[str]) -> str:
    """The method of `Series` that writes such a file."""
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise BadInput("out", f"{ending or 'no ending'} is none of {', '.join(WRITERS)}")
    return WRITERS[ending]


def sense(
    record: Record,
    sensor: Taxels,
    *,
    url: str = DEFAULT_URL,
    token: str | None = None,
    tier: str | None = None,
    effects: Sequence[str] = ("summary", "afferents"),
    maps: bool = True,
    prior: ArrayLike | None = None,
    progress: Progress = None,
    **hello: Any,
) -> Sensed:
    """SED, firing rates and, with the effect `spikes`, spikes under a sensor over time.

    `maps=False` keeps numbers alone: a map takes 0.2 MB a frame, and there are up to three. `prior` is what is known
    of the pressure's shape, for each frame or for all; see `Taxels.pressure`.
    Raises BadInput before anything is sent.
    """
    if record.readings.shape[1] != len(sensor):
        raise BadInput(
            "record", f"it has {record.readings.shape[1]} taxels, and the sensor '{sensor.name}' {len(sensor)}"
        )
    shapes = None if prior is None else check.numbers(prior, "prior")
    if shapes is not None and shapes.shape not in (check.SIDE, (len(record.readings), *check.SIDE)):
        due_shape = f"{check.SIDE} or ({len(record.readings)}, {SIDE_PX}, {SIDE_PX})"
        raise BadInput("prior", f"shape {shapes.shape}; {due_shape} is due")
    _check_whole(record, sensor)
    pressure = sensor.pascals(record.readings)
    greatest = float(np.nanmax(pressure))
    _ask_place(record, sensor, greatest)
    check.ask_unit(max(greatest, 0.0), "pressure", " of the sensor")
    names = list(dict.fromkeys(["summary", *effects]))
    if not maps:
        hello["map"] = False
        if "afferents" in names:
            hello["afferents"] = {"map": False, **hello.get("afferents", {})}
    if tier is not None:
        hello["tier"] = tier
    kept: list[Map] = []
    errors: list[np.ndarray[Any, np.dtype[np.float64]]] = []

    def fields() -> Iterator[Map]:
        for start in range(0, len(record.readings), _BATCH):
            readings = record.readings[start : start + _BATCH]
            known = None if shapes is None else shapes[start : start + _BATCH] if shapes.ndim == 3 else shapes
            found = sensor.pressure(readings, prior=known)
            errors.append(sensor.reproduction(readings, found))
            if maps:
                kept.append(found)
            yield from found

    series = joined(
        list(
            render_chunks(
                fields(), record.times_s, chunk=_BATCH, unit="Pa", url=url, token=token, effects=names,
                progress=_of(progress, len(record.readings)), **hello,
            )
        )
    )  # fmt: skip
    series.values = {_of_network(name): values for name, values in series.values.items()}
    if maps:
        series.values["sensor_pressure_pa"] = np.concatenate(kept)
    series.values["sensor_reproduction"] = np.concatenate(errors)
    share = float(sensor.noise_pa().mean()) / greatest if greatest > 0 else 0.0
    due = expected(sensor.pitch_mm, share)
    warnings = [*series.warnings, *_doubts(record, sensor, series, due)]
    series.warnings = warnings
    series.about = _about(sensor, due)
    return Sensed(series, due, warnings, record.start)


def _check_whole(record: Record, sensor: Taxels) -> None:
    """Raises BadInput with line and column for a reading that is missing."""
    bad = np.argwhere(~np.isfinite(record.readings) & sensor.live)
    if not len(bad):
        return
    frame, taxel = (int(i) for i in bad[0])
    line = "" if record.lines is None else f"line {record.lines[frame]}, "
    raise BadInput(
        "record",
        f"{line}column '{record.names[taxel]}': there is no reading ({len(bad)} such); list taxel {taxel} under dead, "
        "or leave those moments out",
        frame,
    )


def _ask_place(record: Record, sensor: Taxels, greatest: float) -> None:
    """Raises BadInput where most of an array misses the finger, and what is read is read there."""
    beside = int(sensor.off.sum())
    readings = np.abs(record.readings - sensor.offset)
    missed = float(np.nanmax(readings[:, sensor.off & ~sensor.dead], initial=0.0))
    felt = float(np.nanmax(readings[:, sensor.live], initial=0.0))
    if 2 * beside > len(sensor) and missed > felt:
        raise BadInput(
            "sensor",
            f"{beside} of {len(sensor)} taxels lie beside the finger, and the greatest reading is theirs "
            f"({missed:.3g}, on the finger {felt:.3g}): look at centre_mm, at quaternion (x y z w; not turned, the "
            "array lies flat under the pad and faces it) and at the unit of lengths, mm",
        )


def _of_network(name: str) -> str:
    return f"network_{name}" if name.startswith("error_") else name


def _about(sensor: Taxels, due: Expected) -> dict[str, Any]:
    """What files say of the sensor."""
    found: dict[str, Any] = {
        "sensor_name": sensor.name,
        "sensor_taxels": len(sensor),
        "sensor_pitch_mm": sensor.pitch_mm,
        "sensor_unit": sensor.unit,
        "sensor_noise": sensor.noise,
        "sensor_taxels_beside_the_finger": int(sensor.off.sum()),
    }
    found |= {f"sensor_expected_error_{name}": value for name, value in due._asdict().items() if name != "beyond"}
    found["sensor_expected_error_beyond"] = int(due.beyond)
    found["sensor_expected_error_about"] = (
        "medians over test states, of sensor and network together, against finite elements; beyond is 1 where the "
        "sensor is coarser or noisier than any that was measured. network_error_* are of the network alone"
    )
    return found


def _of(progress: Progress, total: int) -> Progress:
    """The same, told how many frames there are."""
    if not callable(progress):
        return (lambda done, _: line(done, total)) if progress else None
    tell = progress
    return lambda done, _: tell(done, total)


def _doubts(record: Record, sensor: Taxels, series: Series, due: Expected) -> list[str]:
    """What a person should know of this record."""
    doubts = []
    if sensor.off.any():
        doubts.append(
            f"{int(sensor.off.sum())} of {len(sensor)} taxels lie beside the finger; their readings were left out"
        )
    pressure, noise = np.nan_to_num(sensor.pascals(record.readings)), float(sensor.noise_pa().max())
    rim = int(((sensor.edge_share(record.readings) > _RIM) & (pressure.max(axis=1) > _CERTAIN / _RIM * noise)).sum())
    if rim:
        doubts.append(f"in {rim} frames the contact reaches the array's edge; what presses beyond it is missing")
    poor = int((series.values["sensor_reproduction"] > _REPRODUCED).sum())
    if poor and not sensor.noise:
        doubts.append(f"in {poor} frames the map misses the readings by more than 5 %: name the sensor's noise")
    below = int((pressure < -_CERTAIN * noise - 1e-9).any(axis=1).sum())
    if below:
        doubts.append(f"in {below} frames a taxel reads below zero, which counts as zero: look at offset and noise")
    if due.beyond:
        doubts.append(
            "the sensor is coarser or noisier than any that was measured: its errors may be greater than stated"
        )
    if series.flagged():
        doubts.append(f"{series.flagged()} frames are flagged; see flags")
    return doubts
