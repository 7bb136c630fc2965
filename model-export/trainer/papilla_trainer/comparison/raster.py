"""The triangles of the atlas that pixels lie in, for graphs that work at its vertices."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError
from papilla_trainer.files import read_npz
from papilla_trainer.maps import F32, MAP_LEN


@dataclass(frozen=True)
class Raster:
    """The pixels ``[N]`` of one patch, the vertices ``[N, 3]`` about each, and their weights.

    The weights of a pixel add up to 1: the value there is linear in those at the vertices.
    """

    pixel: NDArray[np.int64]
    vertex: NDArray[np.int64]
    weight: F32

    @staticmethod
    def read(directory: Path, patch: str, vertex_count: int) -> Raster:
        """``skin`` or ``interface`` of a dataset's ``raster.npz``."""
        path = directory / "raster.npz"
        arrays = read_npz(path)
        try:
            pixel = arrays[f"{patch}_pixel"].astype(np.int64)
            vertex = arrays[f"{patch}_vertex"].astype(np.int64)
            weight = arrays[f"{patch}_weight"].astype(np.float32)
        except KeyError as error:
            raise DatasetError(f"{path}: no array {error}") from error
        if vertex.shape != (pixel.size, 3) or weight.shape != (pixel.size, 3) or not pixel.size:
            raise DatasetError(f"{path}: the arrays of patch '{patch}' do not fit each other")
        if pixel.min() < 0 or pixel.max() >= MAP_LEN or np.unique(pixel).size != pixel.size:
            raise DatasetError(
                f"{path}: pixel indices of patch '{patch}' are out of range or double"
            )
        if vertex.min() < 0 or vertex.max() >= vertex_count:
            raise DatasetError(
                f"{path}: patch '{patch}' names vertex {int(vertex.max())}, but the manifest "
                f"says {vertex_count} vertices"
            )
        return Raster(pixel, vertex, weight)
