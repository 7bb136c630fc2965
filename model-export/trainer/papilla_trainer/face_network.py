"""Networks from the pressures at the V skin vertices to the SED at the V interface vertices.

To first order strain is linear in pressure and SED quadratic in strain. So a network forms, at
each face of the interface, six components e that are linear in pressure, corrects them for
finite strain, and answers the mean of their squared length over the faces about each vertex: never
negative, and zero without pressure, for there is no bias anywhere. The linear map is the finger's
own operator, a low-rank part of global reach and, where asked for, a stencil over the nearest
vertices. The correction has the same weights at every face.

The finger is mirror-symmetric and so is every network here, exactly: pressures are split into an
even and an odd part over the vertices of one half, which also halves weights and time.
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, fields
from typing import Any

import torch
from torch import Tensor, nn

from papilla_trainer.errors import UsageError
from papilla_trainer.face_layout import BLOCK, RING, FaceLayout
from papilla_trainer.linear_operator import COMPONENTS

_NAME = re.compile(
    r"face-r(?P<rank>\d+)(?:-n(?P<near>\d+))?(?:-z(?P<whole>\d+))?(?:-h(?P<hidden>\d+)(?P<star>s)?)?"
)
PRESSURE_UNIT_PA = 1e4
SED_UNIT_J_PER_M3 = 100.0


@dataclass(frozen=True)
class FaceSpec:
    """What decides a face network's shape.

    ``rank``: coordinates of the low-rank part, even and odd together; ``near``: vertices of a
    block's stencil (0: none); ``whole``: width of the gated layer on those coordinates (0: none);
    ``hidden``: width of the correction at each face (0: none); ``star``: whether that sees each of
    a face's four neighbours by itself.
    """

    rank: int
    near: int = 0
    whole: int = 0
    hidden: int = 0
    star: bool = False
    kind: str = "face_net"

    @property
    def name(self) -> str:
        """The name that `--network` reads."""
        parts = (("n", self.near), ("z", self.whole), ("h", self.hidden))
        name = f"face-r{self.rank}" + "".join(f"-{k}{n}" for k, n in parts if n)
        return name + ("s" if self.star else "")

    def as_json(self) -> dict[str, Any]:
        """The form that the model's metadata carry."""
        return asdict(self)


def parse_face_network(name: str) -> FaceSpec:
    """Read ``face-rR[-nK][-zW][-hH[s]]``."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise UsageError(
            f"unknown network '{name}': give face-rR[-nK][-zW][-hH[s]] (rank, stencil, width of "
            "the layer on the whole finger and of the one at each face, with s one that sees its "
            "neighbours), e.g. face-r128-n32-h48"
        )
    given = match.groupdict()
    star = given.pop("star") is not None
    number = {key: int(value) for key, value in given.items() if value is not None}
    if number["rank"] % 2 or 0 in number.values():
        raise UsageError(f"--network {name}: the rank must be even and no number may be 0")
    return FaceSpec(**number, star=star)


class Gated(nn.Module):
    """``(x A * tanh(x B)) C``: no bias, so zero stays zero; starts as nothing."""

    def __init__(self, width: int, hidden: int) -> None:
        super().__init__()
        self.value = nn.Parameter(torch.randn(width, hidden) * 0.5 / width**0.5)
        self.gate = nn.Parameter(torch.randn(width, hidden) * 0.5 / width**0.5)
        self.out = nn.Parameter(torch.zeros(hidden, width))

    def forward(self, x: Tensor) -> Tensor:
        """What is added to x, ``[..., width]``."""
        return ((x @ self.value) * torch.tanh(x @ self.gate)) @ self.out


class Correction(nn.Module):
    """What finite strain adds, from strain and pressure at a face and around it.

    It gives components at the face itself, and a load: what of the pressure acts otherwise than on
    the undeformed skin, which the linear map then takes to the whole finger. To lowest order both
    are quadratic in the strain, as they should be; for large strain they are linear.
    """

    def __init__(self, inputs: int, hidden: int, places: int) -> None:
        super().__init__()
        self.dropout = nn.Dropout(0.0)
        self.value = nn.Parameter(torch.randn(inputs, hidden) / inputs**0.5)
        self.gate = nn.Parameter(torch.randn(inputs, hidden) / inputs**0.5)
        self.value_2 = nn.Parameter(torch.randn(hidden, hidden) * 0.5 / hidden**0.5)
        self.gate_2 = nn.Parameter(torch.randn(inputs, hidden) / inputs**0.5)
        self.place = nn.Parameter(torch.zeros(places, hidden))
        self.out = nn.Parameter(torch.zeros(hidden, COMPONENTS))
        self.load = nn.Parameter(torch.zeros(hidden, 1))

    def forward(self, x: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
        """``[N, slots, inputs]`` and ``[slots, places]`` to ``[N, slots, 6]``, ``[N, slots]``."""
        u = (x @ self.value) * torch.tanh(x @ self.gate)
        u = u + (u @ self.value_2) * torch.tanh(x @ self.gate_2)
        u = self.dropout(u * (1.0 + place @ self.place))
        return u @ self.out, (u @ self.load).squeeze(2)


class FaceNet(nn.Module):
    """``[N, V]`` Pa to ``[N, V]`` J/m3."""

    vertex: Tensor
    image: Tensor
    near: Tensor
    ring: Tensor
    star: Tensor
    corner: Tensor
    hand: Tensor
    place: Tensor
    vertex_slot: Tensor
    vertex_share: Tensor
    flip: Tensor
    ones: Tensor

    def __init__(self, spec: FaceSpec, layout: FaceLayout) -> None:
        super().__init__()
        self.spec = spec
        for field in fields(layout):
            self.register_buffer(field.name, getattr(layout, field.name))
        self.halves, self.units = layout.halves, len(layout.unit)
        even, odd = spec.rank - spec.rank // 2, spec.rank // 2
        self.even = even
        self.register_buffer(
            "flip", torch.cat([torch.ones(even), -torch.ones(odd)]), persistent=False
        )
        self.register_buffer("ones", torch.ones(COMPONENTS, 1), persistent=False)
        self.in_even = nn.Parameter(torch.zeros(len(layout.vertex), even))
        self.in_odd = nn.Parameter(torch.zeros(self.halves, odd))
        self.out_even = nn.Parameter(torch.zeros(even, self.units * COMPONENTS))
        self.out_odd = nn.Parameter(torch.zeros(odd, self.units * COMPONENTS))
        if spec.near:
            self.stencil = nn.Parameter(
                torch.zeros(len(layout.near), spec.near, BLOCK * COMPONENTS)
            )
        self.whole = Gated(spec.rank, spec.whole) if spec.whole else None
        self.correction = None
        if spec.hidden:
            inputs = (COMPONENTS + 1) * (1 + len(layout.ring) + len(layout.star))
            self.correction = Correction(inputs, spec.hidden, layout.place.shape[1])

    def linear_map(self) -> list[nn.Parameter]:
        """The parameters that the operator gives."""
        given = [self.in_even, self.in_odd, self.out_even, self.out_odd]
        return [*given, self.stencil] if self.spec.near else given

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """``[N, V]`` Pa to ``[N, V]`` J/m3."""
        pressure = pressure_pa * (1.0 / PRESSURE_UNIT_PA)
        e = self._linear(pressure)
        if self.correction is not None:
            more, load = self.correction(self._surroundings(e, pressure), self.place)
            e = e + more + self._linear(self._to_vertices(load))
        sed = ((e * e) @ self.ones).squeeze(2)  # [N, slots]
        return self._to_vertices(sed) * SED_UNIT_J_PER_M3

    def _linear(self, pressure: Tensor) -> Tensor:
        """Components ``[N, slots, 6]``."""
        here, there = pressure[:, self.vertex], pressure[:, self.image]
        even, odd = here + there, (here - there)[:, : self.halves]
        z = torch.cat([even @ self.in_even, odd @ self.in_odd], dim=1)
        if self.whole is not None:
            # Even outputs of odd inputs: the mean of the layer and its mirror image.
            z = z + self.whole(z) + self.flip * self.whole(self.flip * z)
        shape = (-1, self.units // BLOCK, BLOCK * COMPONENTS)
        in_phase = (z[:, : self.even] @ self.out_even).reshape(shape)
        opposed = (z[:, self.even :] @ self.out_odd).reshape(shape)
        # The odd part is opposed in the mirror.
        e = torch.stack([in_phase + opposed, in_phase - opposed], dim=2)
        if self.spec.near:
            # One product [2, K] x [K, 48] for each block.
            e = e + pressure[:, self.near] @ self.stencil
        return e.reshape(-1, 2 * self.units, COMPONENTS)

    def _surroundings(self, e: Tensor, pressure: Tensor) -> Tensor:
        """A slot's components and pressure, its neighbours' and their means about it.

        ``[N, slots, 21]``, with the star ``[N, slots, 49]``.
        """
        local = pressure[:, self.corner].sum(dim=1) * (1.0 / len(self.corner))
        own = torch.cat([e, local.unsqueeze(2)], dim=2)
        parts, around = [own], own * self.hand
        parts += [around[:, self.star[k]] * self.hand for k in range(len(self.star))]
        for near in range(len(self.ring)):
            around = around[:, self.ring[near]].sum(dim=1) * (1.0 / RING)
            parts.append(around * self.hand)
        return torch.cat(parts, dim=2)

    def _to_vertices(self, values: Tensor) -> Tensor:
        """Slots' values ``[N, slots]`` to their means at the vertices ``[N, V]``."""
        return (values[:, self.vertex_slot] * self.vertex_share).sum(dim=1)
