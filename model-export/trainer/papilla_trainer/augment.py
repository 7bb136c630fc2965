"""Samples that follow from others: mirror images and shifts of a few pixels."""

from __future__ import annotations

import torch
from torch import Tensor


def mirrored(maps: Tensor) -> Tensor:
    """Maps ``[..., 224, 224]`` of the mirror image: the middle column is the finger's axis."""
    return maps.flip(-1)


def varied(
    pressure: Tensor, sed: Tensor, shift_px: int, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """A batch ``[N, 1, 224, 224]`` as a training step sees it; pressure and SED alike.

    Every other sample stands in the mirror: which ones, the batch's order decides. Each is moved by
    up to ``shift_px`` rows and columns: the skin changes little over half a millimetre, and what is
    learnt of a pressure must not depend on which pixels it falls on.
    """
    pair = torch.cat([pressure, sed], dim=1)
    pair = torch.cat([pair[::2], mirrored(pair[1::2])])
    if shift_px > 0:
        by = torch.randint(-shift_px, shift_px + 1, (len(pair), 2), generator=generator).tolist()
        moved = [maps.roll(steps, (1, 2)) for maps, steps in zip(pair, by, strict=True)]
        pair = torch.stack(moved)
    return pair[:, :1], pair[:, 1:]
