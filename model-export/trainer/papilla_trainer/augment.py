"""Samples that follow from others: mirror images and shifts of a few pixels."""

from __future__ import annotations

import torch
from torch import Tensor

# Width of a contact, pixels of .14 mm, up to which it is moved by as much as is asked.
_NARROW_PX = 15.0


def mirrored(maps: Tensor) -> Tensor:
    """Maps ``[..., 224, 224]`` of the mirror image: the middle column is the finger's axis."""
    return maps.flip(-1)


def reach_px(pressure: Tensor, shift_px: int) -> Tensor:
    """``[N]``: how far samples ``[N, 1, 224, 224]`` are moved at most.

    SED under an edge depends on the skin around it, which is the same a half millimetre away; SED
    under a plate depends on where bone and nail are. So what is wider than 15 pixels is moved by
    less, as 1 / width. Width is that of the square over which the same force and the same sum of
    squares would be spread evenly.
    """
    total = pressure.sum(dim=(1, 2, 3))
    squares = (pressure * pressure).sum(dim=(1, 2, 3))
    width = total / squares.clamp(min=torch.finfo(squares.dtype).tiny).sqrt()
    part = _NARROW_PX / width.clamp(min=_NARROW_PX)
    return (shift_px * part).round().to(torch.int64)


def varied(
    pressure: Tensor, sed: Tensor, shift_px: int, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """A batch ``[N, 1, 224, 224]`` as a training step sees it; pressure and SED alike.

    Every other sample stands in the mirror: which ones, the batch's order decides. Each is moved by
    up to ``shift_px`` rows and columns, wide contacts by less (:func:`reach_px`): what is learnt of
    a pressure must not depend on which pixels it falls on.
    """
    pair = torch.cat([pressure, sed], dim=1)
    pair = torch.cat([pair[::2], mirrored(pair[1::2])])
    if shift_px > 0:
        far = reach_px(pair[:, :1], shift_px).cpu()[:, None]
        by = (torch.rand((len(pair), 2), generator=generator) * (2 * far + 1)).long() - far
        moved = [maps.roll(steps, (1, 2)) for maps, steps in zip(pair, by.tolist(), strict=True)]
        pair = torch.stack(moved)
    return pair[:, :1], pair[:, 1:]
