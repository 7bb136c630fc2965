"""The graph in which a linear network is served: map in Pa, vertices, network, map in J/m3."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from papilla_trainer.comparison.linear_network import LinearNet
from papilla_trainer.comparison.raster import Raster
from papilla_trainer.comparison.sampling import vertex_sampler
from papilla_trainer.maps import MAP_LEN, SIDE_PX


class MapFrame(nn.Module):
    """Everything about the two rasters that the graph needs, as constants.

    ``pixel``, ``weight``: ``[PIXELS, V]``, what to sample the pressure map by; ``corner``:
    ``[3, T]`` vertices of the triangles of the interface; ``triangle``: ``[224 * 224]``, in which
    one each pixel lies; ``share``: ``[3, 224 * 224]``, its linear weights, 0 outside the patch.
    """

    pixel: Tensor
    weight: Tensor
    corner: Tensor
    triangle: Tensor
    share: Tensor

    def __init__(self, constants: dict[str, Tensor]) -> None:
        super().__init__()
        for name, value in constants.items():
            self.register_buffer(name, value)

    @staticmethod
    def of(skin: Raster, interface: Raster, vertex_count: int) -> MapFrame:
        """The frame of two rasters."""
        pixel, weight = vertex_sampler(skin, vertex_count)
        corner, triangle = np.unique(interface.vertex, axis=0, return_inverse=True)
        of_pixel = np.zeros(MAP_LEN, dtype=np.int64)
        of_pixel[interface.pixel] = triangle.reshape(-1)
        share = np.zeros((3, MAP_LEN), dtype=np.float32)
        # A weight is below zero only by rounding at an edge; SED must not be.
        share[:, interface.pixel] = np.clip(interface.weight, 0.0, None).T
        constants = {
            "pixel": pixel.T,
            "weight": weight.T.astype(np.float32),
            "corner": corner.T,
            "triangle": of_pixel,
            "share": share,
        }
        return MapFrame(
            {name: torch.from_numpy(np.ascontiguousarray(a)) for name, a in constants.items()}
        )

    def sample(self, maps: Tensor) -> Tensor:
        """``[224 * 224]`` to ``[1, V]``."""
        return (maps[self.pixel] * self.weight).sum(dim=0, keepdim=True)

    def draw(self, values: Tensor) -> Tensor:
        """``[1, V]`` to ``[1, 1, 224, 224]``; one index a pixel is all that has to be followed."""
        corners = values[0][self.corner]  # [3, T]
        pixels = corners.index_select(1, self.triangle) * self.share
        return pixels.sum(dim=0).reshape(1, 1, SIDE_PX, SIDE_PX)


class ServedVertexModel(nn.Module):
    """``[1, 1, 224, 224]`` Pa to ``[1, 1, 224, 224]`` J/m3, >= 0, 0 outside the patch.

    The linear map is rounded to 16 bits (5e-4 of each value): it is nearly all of the file.
    """

    def __init__(self, network: LinearNet, frame: MapFrame) -> None:
        super().__init__()
        # So it is exported; errors are measured of what is served.
        for parameter in network.linear_map():
            parameter.data = parameter.data.half().float()
        self.network: Callable[[Tensor], Tensor] = network
        self.frame = frame

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """Any batch in PyTorch; exported at batch 1."""
        maps = pressure_pa.reshape(-1, MAP_LEN)
        drawn = [
            self.frame.draw(self.network(self.frame.sample(maps[i]))) for i in range(len(maps))
        ]
        return drawn[0] if len(drawn) == 1 else torch.cat(drawn)
