"""From values at vertices to maps of 224 x 224."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.lattice import SIDE_PX, Lattice

MAP_LEN = SIDE_PX * SIDE_PX

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class Raster:
    """Sparse linear map from the vertex values of one patch to pixels.

    ``lattice``: where the points lie over which a pixel's value is a mean, as many for each, if
    values belong to the nodes of cells.
    """

    pixel: NDArray[np.int64]
    vertex: NDArray[np.int64]
    weight: F32
    lattice: Lattice | None = None

    def rasterise(self, values: F32) -> F32:
        """``[D, V]`` vertex values to ``[D, 224, 224]`` pixels; 0 outside the patch.

        Float32 throughout and summed in the order of the triangle's corners, as the Rust
        rasteriser does.
        """
        corners = values[:, self.vertex]
        return self.scattered(
            (corners[..., 0] * self.weight[:, 0] + corners[..., 1] * self.weight[:, 1])
            + corners[..., 2] * self.weight[:, 2]
        )

    def scattered(self, values: F32) -> F32:
        """``[D, N]`` values at the pixels to ``[D, 224, 224]``; 0 outside the patch."""
        maps = np.zeros((values.shape[0], MAP_LEN), dtype=np.float32)
        maps[:, self.pixel] = values
        return maps.reshape(-1, SIDE_PX, SIDE_PX)

    def mask(self) -> F32:
        """``[224, 224]``: 1 on the patch, 0 outside."""
        mask = np.zeros(MAP_LEN, dtype=np.float32)
        mask[self.pixel] = 1.0
        return mask.reshape(SIDE_PX, SIDE_PX)
