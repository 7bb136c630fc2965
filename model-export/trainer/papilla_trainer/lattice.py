"""Reads fields that are known at the nodes of cells: meshes that differ from press to press.

Cells are rectangles of one lattice on the skin, halved where a contact asked for it, each with nine
nodes. Where a pixel lies on the lattice is fixed (``raster.npz``), so a cell is found without a
search: it is written into each of its squares.

SED is read in the middle of a pixel. Pressure is the mean over a pixel: ridges and edges of contact
are thinner than one, and the mean keeps the force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError

CELL_PLACE, CELL_NODES = "cell_place", "cell_nodes"

F64 = NDArray[np.float64]
Functions = Callable[[F64], F64]

# Points along a pixel over which pressure is a mean, and pixels across a map.
POINTS = 4
SIDE_PX = 224

# A place on the last row or column belongs to the cell before it.
_BEFORE = 1e-3

# Squares of the lattice for which memory is taken (shipped fingers have 2 million).
_SQUARES_MAX = 1 << 27


def quadratics(x: F64) -> F64:
    """``[N]`` in -1 to 1 to ``[N, 3]``: quadratic functions of nodes at -1, 0 and 1."""
    return np.stack([0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)], axis=1)


def hats(x: F64) -> F64:
    """The same, linear between neighbouring nodes."""
    return np.stack([np.maximum(-x, 0.0), 1.0 - np.abs(x), np.maximum(x, 0.0)], axis=1)


@dataclass(frozen=True)
class Lattice:
    """Where N points lie: ``side`` ``[N]`` of the half cube, ``place`` ``[N, 2]`` row, column."""

    side: NDArray[np.int64]
    place: F64

    def read(
        self, place: NDArray[Any], nodes: NDArray[Any], functions: Functions
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """``[N, 9]`` nodes and weights of points, from cells ``[L, 5]``, their nodes ``[L, 9]``."""
        cell = self._cells(place.astype(np.int64))
        if (cell < 0).any():
            raise DatasetError(f"{int((cell < 0).sum())} pixels lie in no cell")
        first, size = place[cell, 1:3].astype(np.float64), place[cell, 3:5].astype(np.float64)
        xi = 2.0 * (self.place - first) / size - 1.0
        row, column = functions(xi[:, 0]), functions(xi[:, 1])
        weights = (row[:, :, None] * column[:, None, :]).reshape(len(xi), 9)
        return nodes[cell].astype(np.int64), weights.astype(np.float32)

    def within(self, pixel: NDArray[np.int64]) -> Lattice:
        """POINTS by POINTS points of each pixel, the first of all, then the second of all.

        This is of the middles of ``pixel``, ``[N]``.
        Between a pixel's middle and its neighbours' a place is linear. Where there is no neighbour,
        or it lies on another side, points stay at the middle.
        """
        at = np.full((SIDE_PX + 2) ** 2, -1)
        row, column = pixel // SIDE_PX + 1, pixel % SIDE_PX + 1
        own = row * (SIDE_PX + 2) + column
        at[own] = np.arange(len(pixel))

        def step(away: int) -> F64:
            """Along the lattice to the pixel that lies so far away."""
            there = at[own + away]
            same = (there >= 0) & (self.side[there] == self.side)
            return np.where(same[:, None], self.place[there] - self.place, 0.0)

        up, down, left, right = (step(k) for k in (-SIDE_PX - 2, SIDE_PX + 2, -1, 1))
        offsets = (np.arange(POINTS) + 0.5) / POINTS - 0.5
        rows = [(down if y > 0.0 else up) * abs(y) for y in offsets]
        columns = [(right if x > 0.0 else left) * abs(x) for x in offsets]
        places = [self.place + y + x for y in rows for x in columns]
        return Lattice(np.tile(self.side, len(places)), np.concatenate(places))

    def _cells(self, place: NDArray[np.int64]) -> NDArray[np.int64]:
        """The cell of each point, -1 where none is."""
        end = place[:, 1:3] + place[:, 3:5]
        sides = 1 + max(int(place[:, 0].max()), int(self.side.max()))
        # Places at the end of the last cells are asked for too.
        rows, columns = 1 + np.maximum(end.max(axis=0), self.place.max(axis=0).astype(np.int64))
        if sides * rows * columns > _SQUARES_MAX:
            raise DatasetError(f"cells lie on {sides} sides of {rows} by {columns} squares")
        cell_of = np.full((sides, rows, columns), -1, dtype=np.int32)
        for cell, (side, row, column, height, width) in enumerate(place.tolist()):
            cell_of[side, row : row + height, column : column + width] = cell
        at = self.place.astype(np.int64)
        found = cell_of[self.side, at[:, 0], at[:, 1]]
        for back in ((_BEFORE, 0.0), (0.0, _BEFORE), (_BEFORE, _BEFORE)):
            left = np.flatnonzero(found < 0)
            at = np.maximum(self.place[left] - back, 0.0).astype(np.int64)
            found[left] = cell_of[self.side[left], at[:, 0], at[:, 1]]
        return found.astype(np.int64)
