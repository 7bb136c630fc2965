"""Which pixels of the skin each taxel covers: flat arrays, arrays that wrap the finger, taxels with poses."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import check
from ..atlas import Atlas
from ..errors import BadInput

Numbers = NDArray[np.float64]
Pixels = NDArray[np.int64]
PAD_MM: Final = (11.25, 0.0, -6.53)
"""The lowest point of the pad."""
REACH_MM: Final = 3.0
"""A taxel farther than this from the skin is beside the finger."""
# Cosine between the outward normal of the skin and the direction that a taxel faces, below which it presses.
_FACING: Final = -0.2
_BAND_MM: Final = 0.5
_ANGLE: Final = np.radians(4.0)


def flat(
    atlas: Atlas, rows: int, columns: int, pitch_mm: float, side_mm: float, centre: Numbers, turn: Numbers
) -> list[Pixels]:
    """A flat array: a taxel covers the skin that lies over it along the direction that the array faces."""
    local = (atlas.places_mm - centre) @ turn
    facing = normals(atlas) @ turn[:, 2] < _FACING
    return _owned(local[:, 0], local[:, 1], facing, (rows, columns), pitch_mm, side_mm)


def wrapped(
    atlas: Atlas, rows: int, columns: int, pitch_mm: float, side_mm: float, centre: Numbers, yaw_deg: float
) -> list[Pixels]:
    """A flexible array that lies on the skin: its lengths are those along the skin.

    Rows follow one another along the finger's middle; each row runs around the finger in a plane across it.
    """
    own = int(np.argmin(((atlas.places_mm - centre) ** 2).sum(axis=1)))
    off = float(np.linalg.norm(atlas.places_mm[own] - centre))
    if off > REACH_MM:
        raise BadInput("centre_mm", f"it lies {off:.1f} mm from the skin; the middle of a wrapped array lies on it")
    along, across = unrolled(atlas)
    along, across = along - along[own], across - across[own]
    yaw = np.radians(yaw_deg)
    turned = np.cos(yaw) * along + np.sin(yaw) * across, np.cos(yaw) * across - np.sin(yaw) * along
    everywhere = np.ones(len(along), bool)
    return _owned(*turned, everywhere, (rows, columns), pitch_mm, side_mm)


def posed(atlas: Atlas, places: Numbers, quaternions: Numbers, sides_mm: Numbers) -> list[Pixels]:
    """Flat squares, each in its own pose: each covers the skin over it along the direction that it faces."""
    outward, found = normals(atlas), []
    for place, quaternion, side_mm in zip(places, quaternions, sides_mm, strict=True):
        turn = rotation(quaternion)
        local = (atlas.places_mm - place) @ turn
        over = (np.abs(local[:, :2]) <= 0.5 * side_mm).all(axis=1) & (outward @ turn[:, 2] < _FACING)
        # Not the far side of the finger.
        found.append(np.flatnonzero(over & (np.abs(local[:, 2]) <= REACH_MM)))
    return found


def round_(atlas: Atlas, places: Numbers, areas_mm2: Numbers) -> list[Pixels]:
    """Circles on the skin around the points of it that are nearest."""
    found = []
    for place, area in zip(places, areas_mm2, strict=True):
        off = np.linalg.norm(atlas.places_mm - place, axis=1)
        own = int(np.argmin(off))
        if off[own] > REACH_MM:
            found.append(np.zeros(0, np.int64))
            continue
        near = np.linalg.norm(atlas.places_mm - atlas.places_mm[own], axis=1)
        near[own] = 0.0
        found.append(np.flatnonzero(near <= np.sqrt(area / np.pi)))
    return found


def _owned(
    along_mm: Numbers,
    across_mm: Numbers,
    able: NDArray[np.bool_],
    shape: tuple[int, int],
    pitch_mm: float,
    side_mm: float,
) -> list[Pixels]:
    """The pixels of each square of an array, by their coordinates from its middle."""
    rows, columns = shape
    along = along_mm / pitch_mm + (rows - 1) / 2
    across = across_mm / pitch_mm + (columns - 1) / 2
    row, column = np.rint(along).astype(int), np.rint(across).astype(int)
    half = 0.5 * side_mm / pitch_mm
    inside = able & (np.abs(along - row) <= half) & (np.abs(across - column) <= half)
    inside &= (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    own = np.where(inside, row * columns + column, -1)
    return [np.flatnonzero(own == number) for number in range(rows * columns)]


def unrolled(atlas: Atlas) -> tuple[Numbers, Numbers]:
    """Lengths along the skin at each of `atlas.pixels`, mm: along the middle of the pad, and around the finger.

    The skin is cut into cross-sections, each a curve of radius over angle about an axis inside the finger.
    """
    places = atlas.places_mm
    # Inside the finger everywhere: halfway between the lowest skin and the highest that the atlas has.
    axis_mm = 0.5 * (places[:, 2].min() + places[:, 2].max())
    angle = np.arctan2(places[:, 1], axis_mm - places[:, 2])
    radius = np.hypot(places[:, 1], places[:, 2] - axis_mm)
    stations = np.arange(places[:, 0].min(), places[:, 0].max() + _BAND_MM, _BAND_MM)
    angles = np.arange(-np.pi, np.pi + _ANGLE, _ANGLE)
    arcs, lows = np.empty((len(stations), len(angles))), np.empty(len(stations))
    for number, station in enumerate(stations):
        near = np.abs(places[:, 0] - station) < _BAND_MM
        order = np.argsort(angle[near])
        curve = np.interp(angles, angle[near][order], _smooth(radius[near][order]))
        slope = np.gradient(curve, angles)
        steps = np.sqrt(curve**2 + slope**2) * _ANGLE
        arc = np.concatenate([[0.0], np.cumsum(0.5 * (steps[1:] + steps[:-1]))])
        arcs[number] = arc - np.interp(0.0, angles, arc)
        lows[number] = np.interp(0.0, angles, curve)
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(stations), np.diff(lows)))])
    along = np.interp(places[:, 0], stations, lengths)
    # Bilinear between stations and angles.
    at = np.clip((places[:, 0] - stations[0]) / _BAND_MM, 0, len(stations) - 1 - 1e-9)
    low, share = at.astype(int), at % 1.0
    turn = (angle - angles[0]) / _ANGLE
    left, part = turn.astype(int), turn % 1.0
    rows = [arcs[low + more, left] * (1 - part) + arcs[low + more, left + 1] * part for more in (0, 1)]
    return along, rows[0] * (1 - share) + rows[1] * share


def _smooth(values: Numbers, count: int = 15) -> Numbers:
    """A running mean: pixels of a band do not lie in one plane."""
    if len(values) < 2 * count:
        return values
    padded = np.pad(values, count // 2, mode="edge")
    found: Numbers = np.convolve(padded, np.full(count, 1 / count), mode="valid")
    return found


def normals(atlas: Atlas) -> Numbers:
    """Unit normals of the skin out of the finger, at each of `atlas.pixels`."""
    a, b, c = (atlas.positions_mm[atlas.triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    found: Numbers = normal[atlas.owners]
    return found


def vector(member: str, value: ArrayLike, length: int) -> Numbers:
    """So many finite numbers."""
    array = check.numbers(value, member).astype(np.float64)
    if array.shape != (length,) or not np.isfinite(array).all():
        raise BadInput(member, f"shape {array.shape}; {length} finite numbers are due")
    return array


def rotation(quaternion: ArrayLike) -> Numbers:
    """The matrix of a unit quaternion x y z w."""
    q = vector("quaternion", quaternion, 4)
    if abs(np.linalg.norm(q) - 1) > 1e-3:
        raise BadInput("quaternion", f"length {np.linalg.norm(q):.4g}; a unit quaternion x y z w is due")
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
