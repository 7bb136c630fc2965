"""Which samples an epoch sees."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

Most = int | None | Mapping[int, int | None]
"""How many samples of a source an epoch sees at most: of each the same, or by source; None: all."""


def drawn(source: Tensor, most: Most) -> int:
    """How many samples `draw` returns."""
    sources, counts = source.unique(return_counts=True)
    pairs = zip(sources.tolist(), counts.tolist(), strict=True)
    return sum(count if (m := _most(most, one)) is None else min(count, m) for one, count in pairs)


def draw(source: Tensor, most: Most, generator: torch.Generator) -> Tensor:
    """Samples in an order by chance, of each source ``most`` at most.

    ``source`` is ``[N]``: which one each sample is of. A campaign of a thousand plates would else
    count for several times what a few hundred presses of many shapes do.
    """
    order = torch.randperm(len(source), generator=generator)
    if most is None:
        return order
    of = source[order]
    places = [
        torch.nonzero(of == one).flatten()[: _most(most, one)] for one in source.unique().tolist()
    ]
    return order[torch.cat(places).sort().values]


def _most(most: Most, source: int) -> int | None:
    return most.get(source) if isinstance(most, Mapping) else most
