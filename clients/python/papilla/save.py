"""Files of a series. Each is written beside its place and then put there, so that none is ever half written."""

from __future__ import annotations

import csv as csv_files
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import BadInput, MissingExtra
from .quantities import quantity
from .spikes import SpikeTrains
from .wire import FLAGS, SIDE_PX

if TYPE_CHECKING:
    import xarray


class Recorded(Protocol):
    """What is written: a `Series`."""

    times_s: NDArray[np.float64] | None
    values: dict[str, NDArray[Any]]
    flags: NDArray[np.uint8]
    tier: NDArray[Any]
    ready: dict[str, Any]
    spikes: SpikeTrains | None
    warnings: list[str]
    about: dict[str, Any]

    def __len__(self) -> int: ...

    def flag_names(self, frame: int) -> list[str]: ...

    def dimensions(self, name: str) -> tuple[str, ...]: ...


@contextmanager
def whole(path: str | PathLike[str]) -> Iterator[Path]:
    """A place beside `path` to write to; it becomes `path` if all goes well, else it is gone."""
    target = Path(path)
    if not target.parent.is_dir():
        raise BadInput("path", f"the folder {target.parent} does not exist; make it first")
    with tempfile.TemporaryDirectory(prefix=".papilla-", dir=target.parent) as folder:
        there = Path(folder) / target.name
        yield there
        os.replace(there, target)


def attributes(series: Recorded) -> dict[str, Any]:
    """What was agreed on, as text and numbers."""
    ready = series.ready
    about: dict[str, Any] = {"source": "papilla", "tier": ready["tier"], "atlas_hash": ready["atlas_hash"]}
    about["session_effects"] = " ".join(ready.get("session_effects", []))
    for name in ("method", "pressure_max_pa"):
        if name in ready:
            about[name] = ready[name]
    if "expected_error" in ready:
        about["contact_expected_error"] = json.dumps(ready["expected_error"])
    about |= series.about
    if series.warnings:
        about["warnings"] = "\n".join(series.warnings)
    return about


def dataset(series: Recorded) -> xarray.Dataset:
    try:
        import xarray
    except ImportError as error:
        raise MissingExtra("a Dataset", "xarray") from error
    first = "time" if series.times_s is not None else "frame"
    variables: dict[str, Any] = {}
    for name, array in series.values.items():
        unit, about = quantity(name)
        variables[name] = (series.dimensions(name), array, {"units": unit, "long_name": about})
    masks = {"flag_masks": np.array(list(FLAGS), np.uint8), "flag_meanings": " ".join(FLAGS.values())}
    variables["flags"] = ((first,), series.flags, {"long_name": "how far to trust an answer", **masks})
    variables["tier"] = ((first,), series.tier, {"long_name": "model that computed SED"})
    if series.times_s is not None:
        # Not as `s`: xarray would read a time of the day into it.
        coordinates: dict[str, Any] = {"time": ("time", series.times_s, {"long_name": "time", "unit": "s"})}
    else:
        coordinates = {"frame": ("frame", np.arange(len(series)))}
    used = {dimension for name in series.values for dimension in series.dimensions(name)}
    if "row" in used:
        place = "pixel of the atlas, counted from the finger's far end"
        coordinates["row"] = ("row", np.arange(SIDE_PX), {"long_name": place})
        coordinates["column"] = ("column", np.arange(SIDE_PX), {"long_name": "pixel of the atlas"})
    if "axis" in used:
        coordinates["axis"] = ("axis", np.array(["x", "y", "z"]))
    if series.spikes is not None:
        trains = series.spikes
        variables["spike_unit"] = (("spike",), trains.unit, {"long_name": "number of the unit that fired"})
        variables["spike_time_s"] = (("spike",), 1e-6 * trains.time_us, {"unit": "s", "long_name": "since frame 0"})
        variables["unit_class"] = (("unit",), trains.classes, {"long_name": "sa1, ra or pc"})
    return xarray.Dataset(variables, coordinates, attributes(series))


def netcdf(series: Recorded, path: str | PathLike[str]) -> None:
    data = dataset(series)
    try:
        import h5netcdf  # noqa: F401
    except ImportError as error:
        raise MissingExtra("a NetCDF file", "xarray") from error
    packed = {name: {"zlib": True, "complevel": 1} for name, array in data.items() if array.ndim > 1}
    with whole(path) as there:
        data.to_netcdf(there, engine="h5netcdf", encoding=packed)


def npz(series: Recorded, path: str | PathLike[str]) -> None:
    arrays: dict[str, Any] = dict(series.values)
    if series.times_s is not None:
        arrays["times_s"] = series.times_s
    if series.spikes is not None:
        arrays |= {"spike_unit": series.spikes.unit, "spike_time_us": series.spikes.time_us}
        arrays["unit_class"] = series.spikes.classes
    names = [" ".join(series.flag_names(row)) for row in range(len(series))]
    about = json.dumps(attributes(series))
    with whole(path) as there, there.open("wb") as file:
        np.savez_compressed(file, **arrays, flags=np.array(names), tier=series.tier, about=np.array(about))


def rows(series: Recorded) -> tuple[list[str], list[list[Any]]]:
    """Names of columns, and a row for each frame."""
    columns: dict[str, Any] = {}
    columns |= {"frame": np.arange(len(series))} if series.times_s is None else {"time_s": series.times_s}
    for name, array in series.values.items():
        dimensions = series.dimensions(name)[1:]
        if not dimensions:
            columns[name] = array
        elif dimensions[0] in ("row", "vertex"):
            columns[f"{name}_max"] = array.reshape(len(series), -1).max(axis=1)
        else:
            marks = "xyz" if dimensions == ("axis",) else [str(i) for i in range(array.shape[1])]
            columns |= {f"{name}_{mark}": array[:, i] for i, mark in enumerate(marks)}
    columns["tier"] = series.tier
    columns["flags"] = [" ".join(series.flag_names(row)) for row in range(len(series))]
    table = [
        [value.item() if hasattr(value, "item") else value for value in row]
        for row in zip(*columns.values(), strict=True)
    ]
    return list(columns), table


def csv(series: Recorded, path: str | PathLike[str]) -> None:
    names, table = rows(series)
    target = Path(path)
    with whole(target) as there, whole(target.with_name(target.name + ".json")) as beside:
        with there.open("w", newline="", encoding="utf-8") as file:
            writer = csv_files.writer(file)
            writer.writerow(names)
            writer.writerows(table)
        beside.write_text(json.dumps(attributes(series), indent=2) + "\n", encoding="utf-8")


def nwb(series: Recorded, path: str | PathLike[str], start: datetime | None) -> None:
    if series.times_s is None:
        raise BadInput("times", "an NWB file needs the time of each frame: give times to render")
    try:
        from pynwb import NWBHDF5IO, H5DataIO, NWBFile, TimeSeries
    except ImportError as error:
        raise MissingExtra("an NWB file", "nwb") from error
    about = attributes(series)
    file = NWBFile(
        session_description="what a fingertip feels, computed by Papilla: " + json.dumps(about),
        identifier=f"papilla-{about['atlas_hash'][:16]}-{datetime.now(UTC):%Y%m%dT%H%M%S%f}",
        session_start_time=start or datetime.now(UTC),
    )
    module = file.create_processing_module("papilla", "answers of the service")
    for name, array in series.values.items():
        unit, words = quantity(name)
        packed = H5DataIO(array, compression="gzip", compression_opts=1) if array.ndim > 1 and array.size else array
        module.add(TimeSeries(name=name, data=packed, unit=unit, timestamps=series.times_s, description=words))
    bits = "bits: " + ", ".join(f"{bit} {name}" for bit, name in FLAGS.items())
    module.add(TimeSeries(name="flags", data=series.flags, unit="1", timestamps=series.times_s, description=bits))
    if series.spikes is not None:
        series.spikes.add_units(file, first_s=float(series.times_s[0]))
    with whole(path) as there, NWBHDF5IO(str(there), "w") as out:
        out.write(file)
