"""Reads fields that are known on cells: meshes that differ from press to press.

Cells are rectangles of one lattice on the skin, halved where a contact asked for it. SED is the
polynomial through nine nodes of each. Pressure is known at its nine Gauss points, where contact was
found: linear between them, constant beyond the outermost. Where a pixel lies on the lattice is
fixed (``raster.npz``), so a cell is found without a search.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError

CELL_PLACE, CELL_NODES = "cell_place", "cell_nodes"

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# The outer two of three Gauss points.
_GAUSS_POINT = 0.6**0.5

# A place on the last row or column belongs to the cell before it.
_BEFORE = 1e-3


def _quadratics(x: F64) -> F64:
    """``[N]`` to ``[N, 3]``: polynomials of nodes at -1, 0 and 1."""
    return np.stack([0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)], axis=1)


@dataclass(frozen=True)
class Lattice:
    """Where N pixels lie: ``side`` ``[N]`` of the half cube, ``place`` ``[N, 2]`` row, column."""

    side: I64
    place: F64

    def at_nodes(self, place: NDArray[Any], nodes: NDArray[Any]) -> tuple[I64, F32]:
        """``[N, 9]`` nodes and weights of pixels, from cells ``[L, 5]``, their nodes ``[L, 9]``."""
        cell, xi = self._within(place)
        return nodes[cell].astype(np.int64), _products(_quadratics, xi)

    def at_gauss_points(self, place: NDArray[Any]) -> tuple[I64, F32]:
        """The same for what is known at nine points a cell: point k of cell l is 9 l + k."""
        cell, xi = self._within(place)
        return 9 * cell[:, None] + np.arange(9), _products(_gauss_hats, xi)

    def _within(self, place: NDArray[Any]) -> tuple[I64, F64]:
        """The cell of each pixel, and where in it: ``[N, 2]``, -1 to 1."""
        cell = self._cells(place.astype(np.int64))
        if (cell < 0).any():
            raise DatasetError(f"{int((cell < 0).sum())} pixels lie in no cell")
        first, size = place[cell, 1:3].astype(np.float64), place[cell, 3:5].astype(np.float64)
        return cell, 2.0 * (self.place - first) / size - 1.0

    def _cells(self, place: I64) -> I64:
        """The cell of each pixel, -1 where none is: cells begin at multiples of their sizes."""
        found = np.full(len(self.side), -1)
        for back in ((0.0, 0.0), (_BEFORE, 0.0), (0.0, _BEFORE), (_BEFORE, _BEFORE)):
            at = np.maximum(self.place - back, 0.0).astype(np.int64)
            for size in np.unique(place[:, 3:5], axis=0):
                index = np.flatnonzero((place[:, 3:5] == size).all(axis=1))
                own = _key(place[index, 0], place[index, 1:3])
                order = np.argsort(own)
                wanted = _key(self.side, at // size * size)
                near = np.searchsorted(own[order], wanted).clip(max=len(own) - 1)
                hit = (own[order][near] == wanted) & (found < 0)
                found[hit] = index[order][near][hit]
        return found


def _gauss_hats(x: F64) -> F64:
    """The same of Gauss points: linear between them, constant beyond the outermost."""
    x = (x / _GAUSS_POINT).clip(-1.0, 1.0)
    return np.stack([np.maximum(-x, 0.0), 1.0 - np.abs(x), np.maximum(x, 0.0)], axis=1)


def _products(functions: Callable[[F64], F64], xi: F64) -> F32:
    row, column = functions(xi[:, 0]), functions(xi[:, 1])
    return (row[:, :, None] * column[:, None, :]).reshape(len(xi), 9).astype(np.float32)


def _key(side: I64, first: I64) -> I64:
    """One number for a side, a row and a column (of at most 2^16 each)."""
    return (side * 65536 + first[:, 0]) * 65536 + first[:, 1]
