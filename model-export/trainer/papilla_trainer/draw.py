"""Which samples an epoch sees."""

from __future__ import annotations

import torch
from torch import Tensor


def drawn(source: Tensor, most: int | None) -> int:
    """How many samples `draw` returns."""
    counts = source.unique(return_counts=True)[1]
    return int((counts if most is None else counts.clamp(max=most)).sum())


def draw(source: Tensor, most: int | None, generator: torch.Generator) -> Tensor:
    """Samples in an order by chance, of each source ``most`` at most (None: all).

    ``source`` is ``[N]``: which one each sample is of. A campaign of a thousand plates would else
    count for several times what a few hundred presses of many shapes do.
    """
    order = torch.randperm(len(source), generator=generator)
    if most is None:
        return order
    of = source[order]
    places = [torch.nonzero(of == one).flatten()[:most] for one in source.unique()]
    return order[torch.cat(places).sort().values]
