"""From a map back to vertex values: the local inverse of the raster, with few pixels a vertex.

A map is linear in each triangle, so the pixels about a vertex determine its value by least squares.
Of all weights that do so, those of least norm are taken: they amplify noise least. Pixels that
matter least are then dropped one after another until ``PIXELS`` are left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.comparison.raster import Raster

I64 = NDArray[np.int64]
F64 = NDArray[np.float64]

PIXELS = 8
_CANDIDATES = 40
_NEAREST = 8
_RIDGE = 1e-4


def vertex_sampler(raster: Raster, vertex_count: int) -> tuple[I64, F64]:
    """``[V, PIXELS]`` pixels of a flat map, and their weights, which sum to 1 for each vertex.

    A constant map is sampled exactly, a rasterised one to some 1e-4 of its norm. A vertex without
    any pixel has weights 0.
    """
    pixels = np.zeros((vertex_count, PIXELS), dtype=np.int64)
    weights = np.zeros((vertex_count, PIXELS))
    entry = np.argsort(raster.vertex.ravel(), kind="stable")
    start = np.searchsorted(raster.vertex.ravel()[entry], np.arange(vertex_count + 1))
    for v in range(vertex_count):
        entries = entry[start[v] : start[v + 1]]
        entries = entries[raster.weight.ravel()[entries] > 0]
        if not entries.size:
            continue
        by_weight = np.argsort(-raster.weight.ravel()[entries], kind="stable")
        rows, row_weights = _fit(raster, _candidates(entries[by_weight] // 3), v)
        pixels[v, :] = raster.pixel[rows[0]]
        pixels[v, : len(rows)] = raster.pixel[rows]
        weights[v, : len(rows)] = row_weights
    return pixels, weights


def _candidates(rows: I64) -> I64:
    """The pixels closest to the vertex, and a fair choice of the others around it."""
    if len(rows) <= _CANDIDATES:
        return rows
    others = np.linspace(_NEAREST, len(rows) - 1, _CANDIDATES - _NEAREST).astype(np.int64)
    return np.concatenate([rows[:_NEAREST], rows[np.unique(others)]])


def _fit(raster: Raster, rows: I64, vertex: int) -> tuple[I64, F64]:
    """Weights s with ``s @ B`` close to the unit vector of ``vertex``; B: pixels x vertices."""
    corners = raster.vertex[rows]
    involved = np.unique(corners)
    matrix = np.zeros((len(rows), len(involved)))
    for k in range(3):
        columns = np.searchsorted(involved, corners[:, k])
        np.add.at(matrix, (np.arange(len(rows)), columns), raster.weight[rows, k])
    wanted = (involved == vertex).astype(np.float64)
    while True:
        inverse = np.linalg.inv(matrix @ matrix.T + _RIDGE * np.eye(len(rows)))
        weights = inverse @ (matrix @ wanted)
        surplus = len(rows) - PIXELS
        if surplus <= 0:
            return rows, weights / weights.sum()
        # What leaving a pixel out costs the fit; a third of the surplus goes at a time.
        cost = weights**2 / np.diag(inverse)
        keep = np.sort(np.argsort(cost, kind="stable")[max(1, surplus // 3) :])
        rows, matrix = rows[keep], matrix[keep]
