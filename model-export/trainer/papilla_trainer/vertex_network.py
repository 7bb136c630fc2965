"""Networks from the pressures at the V skin vertices to the SED at the V interface vertices.

To first order strain is linear in pressure and SED quadratic in strain. So a network forms, for
each vertex, components e that are linear in pressure and answers the sum of their squares:
never negative, and zero without pressure. The linear map is a low-rank part of global reach and,
where asked for, a stencil over the nearest vertices. What finite strain adds are bias-free gated
layers: on the low-rank coordinates (the whole finger) and on each vertex's components.

The finger is mirror-symmetric and so is every network here, exactly: pressures are split into an
even and an odd part over the vertices of one half, which also halves weights and time.
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor, nn

from papilla_trainer.atlas import Atlas
from papilla_trainer.errors import UsageError

_NAME = re.compile(
    r"vertex-r(?P<rank>\d+)(?:-c(?P<components>\d+))?(?:-n(?P<near>\d+))?"
    r"(?:-h(?P<hidden>\d+)(?:x(?P<layers>\d+))?)?(?:-l(?P<local>\d+))?"
)
PRESSURE_UNIT_PA = 1e4
SED_UNIT_J_PER_M3 = 100.0
COMPONENTS = 6


@dataclass(frozen=True)
class VertexSpec:
    """What decides a vertex network's shape.

    ``rank``: coordinates of the low-rank part, even and odd together; ``components``: squares per
    vertex; ``near``: vertices of the stencil (0: none); ``hidden``, ``layers``: gated layers on the
    low-rank coordinates; ``local``: hidden width of the gated layer on each vertex's components.
    """

    rank: int
    components: int = COMPONENTS
    near: int = 0
    hidden: int = 0
    layers: int = 0
    local: int = 0
    kind: str = "vertex_net"

    @property
    def name(self) -> str:
        """The name that `--network` reads."""
        name = f"vertex-r{self.rank}"
        if self.components != COMPONENTS:
            name += f"-c{self.components}"
        if self.near:
            name += f"-n{self.near}"
        if self.layers:
            name += f"-h{self.hidden}" + (f"x{self.layers}" if self.layers > 1 else "")
        return name + (f"-l{self.local}" if self.local else "")

    def as_json(self) -> dict[str, Any]:
        """The form that the model's metadata carry."""
        return asdict(self)


def parse_vertex_network(name: str) -> VertexSpec:
    """Read ``vertex-rR[-cC][-nK][-hH[xL]][-lM]``."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise UsageError(
            f"unknown network '{name}': give vertex-rR[-cC][-nK][-hH[xL]][-lM] (rank, components, "
            "stencil, hidden width and layers, local width), e.g. vertex-r128-n16-h128-l16"
        )
    number = {key: int(value) for key, value in match.groupdict().items() if value is not None}
    if number["rank"] < 2 or number["rank"] % 2 or 0 in number.values():
        raise UsageError(f"--network {name}: the rank must be even, and no number may be 0")
    if "hidden" in number:
        number.setdefault("layers", 1)
    return VertexSpec(**number)


class Gated(nn.Module):
    """``x + (x A * tanh(x B)) C``: no bias, so zero stays zero; starts as the identity."""

    def __init__(self, width: int, hidden: int) -> None:
        super().__init__()
        self.value = nn.Parameter(torch.randn(width, hidden) * 0.5 / width**0.5)
        self.gate = nn.Parameter(torch.randn(width, hidden) * 0.5 / width**0.5)
        self.out = nn.Parameter(torch.zeros(hidden, width))

    def forward(self, x: Tensor) -> Tensor:
        """What is added to x, ``[..., width]``."""
        return ((x @ self.value) * torch.tanh(x @ self.gate)) @ self.out


class VertexNet(nn.Module):
    """``[N, V]`` Pa to ``[N, V]`` J/m3.

    U vertices stand for a half: those with y > 0 (H of them), then those on the middle line. Sides:
    0 the vertex itself, 1 its mirror image.
    """

    unit: Tensor
    image: Tensor
    flip: Tensor
    neighbour: Tensor
    first: Tensor
    second: Tensor

    def __init__(self, spec: VertexSpec, atlas: Atlas) -> None:
        super().__init__()
        self.spec = spec
        vertices = torch.arange(atlas.vertex_count)
        mirror = torch.from_numpy(atlas.mirror)
        right = vertices[torch.from_numpy(atlas.skin_mm[:, 1] > 0) & (mirror != vertices)]
        half = torch.cat([right, vertices[mirror == vertices]])
        self.halves, self.units = len(right), len(half)
        self.register_buffer("unit", half)
        self.register_buffer("image", mirror[half])
        even, odd, count = spec.rank - spec.rank // 2, spec.rank // 2, spec.components
        self.even = even
        self.register_buffer("flip", torch.cat([torch.ones(even), -torch.ones(odd)]))
        self.in_even = nn.Parameter(torch.randn(self.units, even) / self.units**0.5)
        self.in_odd = nn.Parameter(torch.randn(self.halves, odd) / self.halves**0.5)
        self.out_even = nn.Parameter(torch.randn(even, count * self.units) * 0.3 / even**0.5)
        self.out_odd = nn.Parameter(torch.randn(odd, count * self.units) * 0.3 / odd**0.5)
        if spec.near:
            near = torch.from_numpy(atlas.nearest(half.numpy(), spec.near))
            # [2, U, K]: the stencil of each vertex, and the same seen in the mirror.
            self.register_buffer("neighbour", torch.stack([near, mirror[near]]))
            self.near = nn.Parameter(torch.zeros(self.units, spec.near, count))
        self.layers = nn.ModuleList(Gated(spec.rank, spec.hidden) for _ in range(spec.layers))
        self.local = Gated(count, spec.local) if spec.local else None
        # Where a vertex's SED stands in [side 0 | side 1]; on the middle line both sides' mean.
        place = torch.empty(2, atlas.vertex_count, dtype=torch.long)
        place[:, mirror[half]] = self.units + torch.arange(self.units)
        place[:, right] = torch.arange(self.halves)
        place[0, half[self.halves :]] = torch.arange(self.halves, self.units)
        self.register_buffer("first", place[0].clone())
        self.register_buffer("second", place[1].clone())

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """``[N, V]`` Pa to ``[N, V]`` J/m3."""
        pressure = pressure_pa * (1.0 / PRESSURE_UNIT_PA)
        here, there = pressure[:, self.unit], pressure[:, self.image]
        even, odd = here + there, (here - there)[:, : self.halves]
        z = torch.cat([even @ self.in_even, odd @ self.in_odd], dim=1)
        for layer in self.layers:
            # Even outputs of odd inputs: the mean of the layer and its mirror image.
            z = z + layer(z) + self.flip * layer(self.flip * z)
        shape = (-1, self.spec.components, self.units)
        in_phase = (z[:, : self.even] @ self.out_even).reshape(shape)
        opposed = (z[:, self.even :] @ self.out_odd).reshape(shape)
        e = torch.stack([in_phase + opposed, in_phase - opposed], dim=2)  # [N, C, 2, U]
        if self.spec.near:
            stencil = pressure[:, self.neighbour]  # [N, 2, U, K]
            e = e + torch.einsum("nsuk,ukc->ncsu", stencil, self.near)
        if self.local is not None:
            e = e + self.local(e.permute(0, 2, 3, 1)).permute(0, 3, 1, 2)
        sed = (e * e).sum(dim=1).flatten(1)  # [N, 2 U]
        return (sed[:, self.first] + sed[:, self.second]) * (0.5 * SED_UNIT_J_PER_M3)
