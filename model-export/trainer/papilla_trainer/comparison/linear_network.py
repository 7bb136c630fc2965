"""A network from the pressures at V skin vertices to the SED at V interface vertices: an operator.

To first order strain is linear in pressure and SED quadratic in strain. So the network forms, at
each face of the interface, six components e that are linear in pressure, and answers the mean of
their squared length over the faces about each vertex: never negative, and zero without pressure.
The linear map is an operator's approximation: a low-rank part of global reach and, where asked for,
a stencil over the nearest vertices. Nothing of it is trained.

The finger is mirror-symmetric and so is the network, exactly: pressures are split into an even and
an odd part over the vertices of one half, which also halves weights and time.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

import torch
from torch import Tensor, nn

from papilla_trainer.comparison.layout import BLOCK, Layout
from papilla_trainer.comparison.linear_operator import COMPONENTS
from papilla_trainer.map_network import PRESSURE_UNIT_PA, SED_UNIT_J_PER_M3


@dataclass(frozen=True)
class LinearSpec:
    """What decides the network's shape, and whose operator it is (``kind``).

    ``rank``: coordinates of the low-rank part, even and odd together; ``near``: vertices of a
    block's stencil (0: none).
    """

    rank: int
    near: int
    kind: str

    def as_json(self) -> dict[str, Any]:
        """The form that the model's metadata carry."""
        return asdict(self)


class LinearNet(nn.Module):
    """``[N, V]`` Pa to ``[N, V]`` J/m3."""

    vertex: Tensor
    image: Tensor
    near: Tensor
    vertex_slot: Tensor
    vertex_share: Tensor
    ones: Tensor

    def __init__(self, spec: LinearSpec, layout: Layout) -> None:
        super().__init__()
        self.spec = spec
        for field in fields(layout):
            self.register_buffer(field.name, getattr(layout, field.name))
        self.halves, self.units = layout.halves, len(layout.unit)
        even, odd = spec.rank - spec.rank // 2, spec.rank // 2
        self.even = even
        self.register_buffer("ones", torch.ones(COMPONENTS, 1), persistent=False)
        self.in_even = nn.Parameter(torch.zeros(len(layout.vertex), even))
        self.in_odd = nn.Parameter(torch.zeros(self.halves, odd))
        self.out_even = nn.Parameter(torch.zeros(even, self.units * COMPONENTS))
        self.out_odd = nn.Parameter(torch.zeros(odd, self.units * COMPONENTS))
        if spec.near:
            self.stencil = nn.Parameter(
                torch.zeros(len(layout.near), spec.near, BLOCK * COMPONENTS)
            )

    def linear_map(self) -> list[nn.Parameter]:
        """The parameters that the operator gives."""
        given = [self.in_even, self.in_odd, self.out_even, self.out_odd]
        return [*given, self.stencil] if self.spec.near else given

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """``[N, V]`` Pa to ``[N, V]`` J/m3."""
        pressure = pressure_pa * (1.0 / PRESSURE_UNIT_PA)
        e = self._linear(pressure)
        sed = ((e * e) @ self.ones).squeeze(2)  # [N, slots]
        return self._to_vertices(sed) * SED_UNIT_J_PER_M3

    def _linear(self, pressure: Tensor) -> Tensor:
        """Components ``[N, slots, 6]``."""
        here, there = pressure[:, self.vertex], pressure[:, self.image]
        even, odd = here + there, (here - there)[:, : self.halves]
        z = torch.cat([even @ self.in_even, odd @ self.in_odd], dim=1)
        shape = (-1, self.units // BLOCK, BLOCK * COMPONENTS)
        in_phase = (z[:, : self.even] @ self.out_even).reshape(shape)
        opposed = (z[:, self.even :] @ self.out_odd).reshape(shape)
        # The odd part is opposed in the mirror.
        e = torch.stack([in_phase + opposed, in_phase - opposed], dim=2)
        if self.spec.near:
            # One product [2, K] x [K, 48] for each block.
            e = e + pressure[:, self.near] @ self.stencil
        return e.reshape(-1, 2 * self.units, COMPONENTS)

    def _to_vertices(self, values: Tensor) -> Tensor:
        """Slots' values ``[N, slots]`` to their means at the vertices ``[N, V]``."""
        return (values[:, self.vertex_slot] * self.vertex_share).sum(dim=1)
