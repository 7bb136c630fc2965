"""Where the taxels of a sensor are on the finger, and what their readings mean."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import check
from ..atlas import Atlas
from ..errors import BadInput
from ..http import DEFAULT_URL
from ..wire import SIDE_PX, Map
from . import field, places
from .places import PAD_MM, rotation, vector

Numbers = NDArray[np.float64]
UNITS: Final = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N": 1e6, "mN": 1e3}
"""Of a reading times its gain; N and mN are of force over the taxel."""
_MOST: Final = 2048


class Taxels:
    """An array of taxels on the finger. Make one by `grid`, `wrapped` or `at`.

    `unit`, `gain` and `offset` say what a reading means: pressure = (reading - offset) * gain in `unit`.
    `noise` is the standard deviation of a reading, in readings. `dead` lists taxels whose readings say nothing.
    """

    def __init__(
        self,
        atlas: Atlas,
        footprints: Sequence[NDArray[np.int64]],
        *,
        pitch_mm: float,
        unit: str = "kPa",
        gain: ArrayLike = 1.0,
        offset: ArrayLike = 0.0,
        noise: float = 0.0,
        dead: Sequence[int] = (),
        area_mm2: ArrayLike | None = None,
        name: str = "taxels",
        shape: tuple[int, ...] | None = None,
    ) -> None:
        """`footprints`: for each taxel indices into `atlas.pixels`; none for a taxel off the finger."""
        count = len(footprints)
        if not 1 <= count <= _MOST:
            raise BadInput("taxels", f"there are {count}; 1 to {_MOST} are due")
        if unit not in UNITS:
            raise BadInput("unit", f"{unit!r} is none of {', '.join(UNITS)}")
        if check.number(noise, "noise", "the standard deviation of a reading") < 0:
            raise BadInput("noise", f"{noise}; a standard deviation of a reading is due, 0 or above")
        if check.number(pitch_mm, "pitch_mm", "a distance in mm") <= 0:
            raise BadInput("pitch_mm", f"{pitch_mm}; a distance above 0 is due")
        self.atlas, self.name, self.unit, self.noise = atlas, name, unit, float(noise)
        self.pitch_mm = float(pitch_mm)
        """Distance between neighbours, mm."""
        self.shape = shape or (count,)
        """Of one reading: (rows, columns) of an array, or (taxels,)."""
        self.footprints = [np.asarray(pixels, np.int64) for pixels in footprints]
        self.off = np.array([not len(pixels) for pixels in self.footprints])
        """Taxels that lie beside the finger; their readings are left out."""
        numbers = _whole("dead", dead)
        wrong = [number for number in numbers if not 0 <= number < count]
        if wrong:
            raise BadInput("dead", f"taxel {wrong[0]} does not exist; they count from 0 to {count - 1}")
        self.dead = np.isin(np.arange(count), np.array(numbers, int))
        self.live = ~(self.dead | self.off)
        if not self.live.any():
            raise BadInput("taxels", "none of them lies on the finger: look at centre, pose and unit (mm) of the array")
        self.gain = _each("gain", gain, count)
        self.offset = _each("offset", offset, count)
        if (self.gain == 0).any():
            raise BadInput("gain", f"taxel {int(np.argmin(np.abs(self.gain)))} has gain 0; list it under dead")
        mean_mm2 = [float(atlas.areas_mm2[pixels].sum()) for pixels in self.footprints]
        self.area_mm2 = np.array(mean_mm2) if area_mm2 is None else _each("area_mm2", area_mm2, count)
        self._field = field.Field(
            atlas, [p for p, live in zip(self.footprints, self.live, strict=True) if live], pitch_mm
        )

    @classmethod
    def grid(
        cls,
        rows: int,
        columns: int,
        *,
        pitch_mm: float,
        taxel_mm: float | None = None,
        centre_mm: ArrayLike = PAD_MM,
        quaternion: ArrayLike = (0.0, 0.0, 0.0, 1.0),
        atlas: Atlas | None = None,
        url: str = DEFAULT_URL,
        token: str | None = None,
        **more: Any,
    ) -> Taxels:
        """A flat array that the finger presses on.

        Row 0 is nearest to the fingertip, column 0 at the least y, as seen in the finger's frame: the array's
        rows run along x and its columns along y, its face looks along z, to the pad. `quaternion` (x y z w)
        turns it about `centre_mm`. Each taxel is a square with sides of `taxel_mm` (the pitch), and covers the
        skin that lies over it along the face's direction. Without `atlas` the service at `url` gives it.
        """
        rows, columns, side_mm = _grid(rows, columns, pitch_mm, taxel_mm)
        atlas = Atlas.load(url, token) if atlas is None else atlas
        centre, turn = vector("centre_mm", centre_mm, 3), rotation(quaternion)
        footprints = places.flat(atlas, rows, columns, pitch_mm, side_mm, centre, turn)
        more.setdefault("area_mm2", side_mm**2)
        return cls(atlas, footprints, pitch_mm=pitch_mm, shape=(rows, columns), **more)

    @classmethod
    def wrapped(
        cls,
        rows: int,
        columns: int,
        *,
        pitch_mm: float,
        taxel_mm: float | None = None,
        centre_mm: ArrayLike = PAD_MM,
        yaw_deg: float = 0.0,
        atlas: Atlas | None = None,
        url: str = DEFAULT_URL,
        token: str | None = None,
        **more: Any,
    ) -> Taxels:
        """A flexible array that is wrapped around the pad and lies on the skin.

        Its lengths are those along the skin: rows follow one another along the middle of the pad, row 0 nearest to
        the fingertip, and each row runs around the finger in a plane across it. `yaw_deg` turns the array on the
        skin about its middle, which lies at the skin nearest to `centre_mm`. Where the skin curves two ways, as at
        the fingertip, such an array stretches along its rows.
        """
        rows, columns, side_mm = _grid(rows, columns, pitch_mm, taxel_mm)
        turn_deg = check.number(yaw_deg, "yaw_deg", "an angle in degrees")
        atlas = Atlas.load(url, token) if atlas is None else atlas
        footprints = places.wrapped(
            atlas, rows, columns, pitch_mm, side_mm, vector("centre_mm", centre_mm, 3), turn_deg
        )
        more.setdefault("area_mm2", side_mm**2)
        return cls(atlas, footprints, pitch_mm=pitch_mm, shape=(rows, columns), **more)

    @classmethod
    def at(
        cls,
        *,
        mm: ArrayLike | None = None,
        px: ArrayLike | None = None,
        area_mm2: ArrayLike,
        quaternion: ArrayLike | None = None,
        atlas: Atlas | None = None,
        url: str = DEFAULT_URL,
        token: str | None = None,
        **more: Any,
    ) -> Taxels:
        """Single taxels: places in the finger's frame (`mm`, x y z) or on the map (`px`, column and row + 0.5).

        Each covers the skin within a circle of its area. With a `quaternion` (x y z w) for each taxel, or one for
        all, taxels are flat squares that face along their own z, as on a curved array; each covers the skin that
        lies over it. A taxel farther than 3 mm from the skin counts as off.
        """
        if (mm is None) == (px is None):
            raise BadInput("mm", "give the places as mm or as px")
        atlas = Atlas.load(url, token) if atlas is None else atlas
        if mm is not None:
            where = check.numbers(mm, "mm").astype(np.float64)
            if where.ndim != 2 or where.shape[1] != 3:
                raise BadInput("mm", f"shape {where.shape}; (taxels, 3) is due")
        else:
            spots = check.numbers(px if px is not None else [], "px").astype(np.float64)
            if spots.ndim != 2 or spots.shape[1] != 2:
                raise BadInput("px", f"shape {spots.shape}; (taxels, 2) is due: column and row")
            centres = np.stack([atlas.pixels % SIDE_PX, atlas.pixels // SIDE_PX], axis=1) + 0.5
            nearest = [int(np.argmin(((centres - spot) ** 2).sum(axis=1))) for spot in spots]
            where = atlas.places_mm[nearest]
        if not np.isfinite(where).all():
            raise BadInput("mm", "a place is not finite")
        areas = _each("area_mm2", area_mm2, len(where))
        if (areas <= 0).any():
            raise BadInput("area_mm2", "an area is not above 0")
        if quaternion is None:
            footprints = places.round_(atlas, where, areas)
        else:
            turns = np.atleast_2d(check.numbers(quaternion, "quaternion").astype(np.float64))
            if turns.shape not in ((1, 4), (len(where), 4)):
                raise BadInput("quaternion", f"shape {turns.shape}; (taxels, 4) is due, or one for all")
            footprints = places.posed(atlas, where, np.broadcast_to(turns, (len(where), 4)), np.sqrt(areas))
        if "pitch_mm" not in more:
            more["pitch_mm"] = _spacing(where, areas)
        return cls(atlas, footprints, area_mm2=areas, **more)

    def __len__(self) -> int:
        return len(self.footprints)

    def __repr__(self) -> str:
        kind = f"{self.shape[0]} x {self.shape[1]}" if len(self.shape) == 2 else str(len(self))
        beside = f", {int(self.off.sum())} beside the finger" if self.off.any() else ""
        return (
            f"<papilla Taxels {self.name!r}: {kind}, {self.pitch_mm:.3g} mm apart{beside}, {int(self.dead.sum())} dead>"
        )

    def read(self, pressure_pa: ArrayLike, rng: np.random.Generator | None = None) -> Numbers:
        """What the sensor would read of maps of pressure (..., 224, 224); with `rng` its noise is added."""
        maps = check.numbers(pressure_pa, "pressure_pa")
        if maps.shape[-2:] != check.SIDE:
            raise BadInput("pressure_pa", f"shape {maps.shape}; (..., {SIDE_PX}, {SIDE_PX}) is due")
        flat = maps.reshape(-1, SIDE_PX * SIDE_PX)[:, self.atlas.pixels].astype(np.float64)
        means = np.full((len(flat), len(self)), np.nan)
        means[:, self.live] = self._field.means(flat)
        force = self.unit in ("N", "mN")
        readings = means * (self.area_mm2 * 1e-6 if force else 1.0) / (UNITS[self.unit] * (1e-6 if force else 1.0))
        readings = readings / self.gain + self.offset
        if rng is not None:
            readings += self.noise * rng.standard_normal(readings.shape)
        return readings.reshape(*maps.shape[:-2], *self.shape)

    def pascals(self, readings: ArrayLike) -> Numbers:
        """Readings as mean pressure over each taxel, Pa: (frames, taxels); dead and off ones are NaN."""
        array = check.numbers(readings, "readings").astype(np.float64)
        written = check.written_unit(readings)
        if written in UNITS and written != self.unit and (self.gain == 1.0).all() and not self.offset.any():
            raise BadInput("readings", f"its attribute says the unit {written!r}, the sensor's is {self.unit!r}")
        flat = self._rows(array)
        bad = ~np.isfinite(flat) & self.live
        if bad.any():
            frame, taxel = (int(i) for i in np.argwhere(bad)[0])
            raise BadInput(
                "readings",
                f"taxel {taxel} reads {flat[frame, taxel]} ({int(bad.sum())} such readings); list it under dead, "
                "or leave the frames out",
                frame,
            )
        pressure = (flat - self.offset) * self.gain * UNITS[self.unit]
        if self.unit in ("N", "mN"):
            pressure = pressure / self.area_mm2
        pressure[:, ~self.live] = np.nan
        return pressure

    def noise_pa(self) -> Numbers:
        """Standard deviation of each live taxel's reading, Pa."""
        scale = np.abs(self.gain) * UNITS[self.unit] / (self.area_mm2 if self.unit in ("N", "mN") else 1.0)
        noise: Numbers = (self.noise * scale)[self.live]
        return noise

    def pressure(self, readings: ArrayLike, *, prior: ArrayLike | None = None) -> Map:
        """Maps of pressure, Pa, that reproduce the readings of the taxels: (frames, 224, 224), or one map of one.

        Nowhere negative, smooth, and zero where no taxel felt anything. Readings within the noise are zero. Where it
        is known what touches, `prior` has the map of each frame, or one for all, that contact finds for it, such as
        `papilla.Finger().touch(...).pressure_pa`: details finer than the taxels are then taken from it, and its
        greatness does not matter.
        """
        array = check.numbers(readings, "readings")
        one = array.shape in (self.shape, (len(self),))
        pressure = self.pascals(readings)[:, self.live]
        shapes = None if prior is None else self._prior(prior, len(pressure))
        found = self._field.solve(pressure, self.noise_pa(), shapes)
        flat = np.zeros((len(found), SIDE_PX * SIDE_PX), np.float32)
        flat[:, self.atlas.pixels] = found
        maps: Map = flat.reshape(-1, SIDE_PX, SIDE_PX)
        return maps[0] if one else maps

    def _prior(self, prior: ArrayLike, count: int) -> Numbers:
        """Maps of a prior as (frames, pixels)."""
        maps = check.numbers(prior, "prior").astype(np.float64)
        if maps.shape not in (check.SIDE, (count, *check.SIDE)):
            raise BadInput("prior", f"shape {maps.shape}; {check.SIDE} or ({count}, {SIDE_PX}, {SIDE_PX}) is due")
        if not np.isfinite(maps).all() or maps.min() < 0:
            raise BadInput("prior", "a pressure is negative or not finite; skin is pressed, never pulled")
        flat = maps.reshape(-1, SIDE_PX * SIDE_PX)[:, self.atlas.pixels]
        return np.broadcast_to(flat, (count, flat.shape[1]))

    def reproduction(self, readings: ArrayLike, pressure_pa: ArrayLike) -> Numbers:
        """How far maps are from the readings: norm of the difference over that of the readings, of each frame."""
        wanted = self.pascals(readings)[:, self.live]
        maps = np.asarray(pressure_pa).reshape(-1, SIDE_PX * SIDE_PX)[:, self.atlas.pixels].astype(np.float64)
        norm = np.linalg.norm(wanted, axis=1)
        off = np.linalg.norm(self._field.means(maps) - wanted, axis=1)
        share: Numbers = np.divide(off, norm, out=np.zeros_like(off), where=norm > 0)
        return share

    def edge_share(self, readings: ArrayLike) -> Numbers:
        """Greatest reading of a taxel at the array's edge over the greatest of all, of each frame; 0 of lists."""
        if len(self.shape) != 2:
            return np.zeros(len(self._rows(check.numbers(readings, "readings"))))
        pressure = np.nan_to_num(self.pascals(readings)).reshape(-1, *self.shape)
        rim = np.ones(self.shape, bool)
        rim[1:-1, 1:-1] = False
        most = pressure.reshape(len(pressure), -1).max(axis=1)
        edge = pressure[:, rim].max(axis=1)
        share: Numbers = np.divide(edge, most, out=np.zeros_like(edge), where=most > 0)
        return share

    def _rows(self, array: NDArray[Any]) -> Numbers:
        """Readings as (frames, taxels)."""
        if array.shape in (self.shape, (len(self),)):
            return array.reshape(1, -1).astype(np.float64)
        if array.shape[1:] in (self.shape, (len(self),)):
            return array.reshape(len(array), -1).astype(np.float64)
        due = " or ".join(str(("frames", *shape)).replace("'", "") for shape in {self.shape, (len(self),)})
        cure = "each frame has all taxels"
        if array.shape[:-1] == self.shape or array.shape[:-1] == (len(self),):
            cure = "time seems to come last: give np.moveaxis(readings, -1, 0)"
        elif len(self.shape) == 2 and array.shape[-2:] == self.shape[::-1]:
            cure = "rows and columns seem to be exchanged: give np.swapaxes(readings, -1, -2)"
        raise BadInput("readings", f"shape {array.shape}; {due} is due; {cure}")


def _grid(rows: int, columns: int, pitch_mm: float, taxel_mm: float | None) -> tuple[int, int, float]:
    """Rows, columns, and the side of a taxel, mm, of an array that can be."""
    whole = [_whole(member, [value])[0] for member, value in (("rows", rows), ("columns", columns))]
    if min(whole) < 1 or whole[0] * whole[1] > _MOST:
        raise BadInput("rows", f"{rows} x {columns} taxels; 1 to {_MOST} in all are due")
    pitch_mm = check.number(pitch_mm, "pitch_mm", "a distance in mm")
    if not 0.05 <= pitch_mm <= 30:
        raise BadInput("pitch_mm", f"{pitch_mm} mm; 0.05 to 30 are due. Lengths are in mm; was m meant?")
    side_mm = pitch_mm if taxel_mm is None else check.number(taxel_mm, "taxel_mm", "a length in mm")
    if not 0 < side_mm <= pitch_mm * (1 + 1e-9):
        raise BadInput("taxel_mm", f"{side_mm} mm; a side above 0 and at most the pitch, {pitch_mm} mm, is due")
    return whole[0], whole[1], side_mm


def _whole(member: str, values: Any) -> list[int]:
    """Whole numbers, of Python or NumPy."""
    try:
        return [operator.index(value) for value in values]
    except TypeError as error:
        raise BadInput(member, f"{values!r}; whole numbers are due") from error


def _spacing(places: Numbers, areas: Numbers) -> float:
    """Median distance to the nearest other taxel; of a single one the width of its area."""
    if len(places) < 2:
        return float(np.sqrt(areas[0]))
    off = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(off, np.inf)
    spacing = float(np.median(off.min(axis=1)))
    if spacing <= 0:
        raise BadInput("mm", "taxels lie on top of each other")
    return spacing


def _each(member: str, value: ArrayLike, count: int) -> Numbers:
    array = check.numbers(value, member).astype(np.float64).reshape(-1)
    if len(array) not in (1, count) or not np.isfinite(array).all():
        raise BadInput(member, f"{len(array)} numbers; one finite number, or one for each of {count} taxels, is due")
    return np.broadcast_to(array, (count,)).copy()
