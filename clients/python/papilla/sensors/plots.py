"""A picture of a record: what the sensor read, what the finger felt."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np

from ..errors import MissingExtra
from ..save import whole
from ..wire import SIDE_PX
from .record import Record
from .sense import Sensed
from .taxels import Taxels


def overview(path: str | PathLike[str], record: Record, sensor: Taxels, sensed: Sensed) -> None:
    """Writes a picture: numbers over time, and maps of the moment of greatest force. Raises MissingExtra."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a picture", "plots") from error
    series = sensed.series
    values = series.values
    peak = int(values["summary_force_n"].argmax())
    raster = series.spikes is not None
    has_maps = "sensor_pressure_pa" in values
    rows = 3 + raster
    figure = Figure(figsize=(12 if has_maps else 7, 2.3 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 3 if has_maps else 1, width_ratios=(1, 1, 0.9) if has_maps else None)
    lines = [
        ("summary_force_n", "force, N", 1.0),
        ("summary_sed_max_j_per_m3", "greatest SED, kJ/m³", 1e-3),
        ("summary_sa1_rate_hz", "all SA1 afferents, spikes/s", 1.0),
    ]
    first = None
    for number, (name, label, factor) in enumerate(lines):
        axis = figure.add_subplot(grid[number, :2] if has_maps else grid[number, 0], sharex=first)
        first = first or axis
        axis.plot(record.times_s, factor * values[name], color="tab:blue", linewidth=1.2)
        axis.axvline(record.times_s[peak], color="0.6", linestyle=":", linewidth=1)
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.tick_params(labelbottom=number == 2 and not raster)
    if raster and series.spikes is not None and first is not None:
        axis = figure.add_subplot(grid[3, :2] if has_maps else grid[3, 0], sharex=first)
        trains = series.spikes
        for kind, colour in (("sa1", "tab:green"), ("ra", "tab:blue"), ("pc", "tab:orange")):
            mine = trains.classes[trains.unit] == kind
            axis.plot(1e-6 * trains.time_us[mine], trains.unit[mine], "|", ms=2, color=colour, label=kind.upper())
        axis.set_ylabel("unit")
        axis.legend(loc="upper right", fontsize=8)
    figure.axes[-1].set_xlabel("time, s")
    due = sensed.expected
    figure.suptitle(
        f"{sensor.name}: {len(sensor)} taxels, {sensor.pitch_mm:.3g} mm apart. Expected error of SED against finite "
        f"elements: {100 * due.sed_relative_l2:.0f} % (median)",
        fontsize=10,
    )
    if has_maps:
        _maps(figure, grid, record, sensor, series, peak)
    with whole(path) as there:
        figure.savefig(there, dpi=110)


def _maps(figure: Any, grid: Any, record: Record, sensor: Taxels, series: Any, peak: int) -> None:
    """Readings, pressure and SED at one moment, on the atlas."""
    skin = np.zeros(SIDE_PX * SIDE_PX, bool)
    skin[sensor.atlas.pixels] = True
    pressure = sensor.pascals(record.readings[peak])[0]
    read = np.full(SIDE_PX * SIDE_PX, np.nan)
    for pixels, value in zip(sensor.footprints, pressure, strict=True):
        read[sensor.atlas.pixels[pixels]] = value
    shown = [
        ("readings, kPa", read.reshape(SIDE_PX, SIDE_PX), "magma"),
        ("pressure, kPa", series.values["sensor_pressure_pa"][peak], "magma"),
        ("SED, kJ/m³", series.values["sed_j_per_m3"][peak], "viridis"),
    ]
    most = 1e-3 * float(max(np.nanmax(read), shown[1][1].max()))
    for row, (title, image, colours) in enumerate(shown):
        axis = figure.add_subplot(grid[row, 2])
        inside = np.where(skin.reshape(SIDE_PX, SIDE_PX), 1e-3 * image, np.nan)
        axis.set_facecolor("0.92")
        drawn = axis.imshow(inside, cmap=colours, vmin=0, vmax=most if row < 2 else None)
        axis.set_xticks([])
        axis.set_yticks([])
        axis.set_title(f"{title}, at {record.times_s[peak]:.3g} s", fontsize=9)
        figure.colorbar(drawn, ax=axis, shrink=0.85)
