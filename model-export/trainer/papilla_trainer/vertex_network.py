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
    r"(?P<gain>-g)?(?:-h(?P<hidden>\d+)(?:x(?P<layers>\d+))?)?"
)
PRESSURE_UNIT_PA = 1e4
SED_UNIT_J_PER_M3 = 100.0
COMPONENTS = 6


@dataclass(frozen=True)
class VertexSpec:
    """What decides a vertex network's shape.

    ``rank``: coordinates of the low-rank part, even and odd together; ``components``: squares per
    vertex; ``near``: vertices of the stencil (0: none); ``gain``: whether each component has a gain
    between 0 and 2, from pressures about the vertex and the low-rank coordinates; ``hidden``,
    ``layers``: gated layers on those coordinates.
    """

    rank: int
    components: int = COMPONENTS
    near: int = 0
    gain: bool = False
    hidden: int = 0
    layers: int = 0
    kind: str = "vertex_net"

    @property
    def name(self) -> str:
        """The name that `--network` reads."""
        name = f"vertex-r{self.rank}"
        if self.components != COMPONENTS:
            name += f"-c{self.components}"
        if self.near:
            name += f"-n{self.near}" + ("-g" if self.gain else "")
        if self.layers:
            name += f"-h{self.hidden}" + (f"x{self.layers}" if self.layers > 1 else "")
        return name

    def as_json(self) -> dict[str, Any]:
        """The form that the model's metadata carry."""
        return asdict(self)


def parse_vertex_network(name: str) -> VertexSpec:
    """Read ``vertex-rR[-cC][-nK[-g]][-hH[xL]]``."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise UsageError(
            f"unknown network '{name}': give vertex-rR[-cC][-nK[-g]][-hH[xL]] (rank, components, "
            "stencil, gain, hidden width and layers), e.g. vertex-r128-n16-g-h128"
        )
    found = {key: value for key, value in match.groupdict().items() if value is not None}
    gain = found.pop("gain", None) is not None
    number = {key: int(value) for key, value in found.items()}
    if number["rank"] % 2 or 0 in number.values() or (gain and "near" not in number):
        raise UsageError(
            f"--network {name}: the rank must be even, no number may be 0, and a gain needs -nK"
        )
    if "hidden" in number:
        number.setdefault("layers", 1)
    return VertexSpec(gain=gain, **number)


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


@dataclass(frozen=True)
class VertexLayout:
    """Which vertices stand for a half: those with y > 0 (``halves`` of them), then the middle line.

    ``unit``, ``image``: ``[U]``, each of them and its mirror image; ``neighbour``: ``[U, 2, K]``,
    the stencil of each, and the same seen in the mirror.
    """

    unit: Tensor
    image: Tensor
    neighbour: Tensor

    @staticmethod
    def of(atlas: Atlas, near: int) -> VertexLayout:
        """The layout with the ``near`` nearest vertices in each stencil."""
        vertices = torch.arange(atlas.vertex_count)
        mirror = torch.from_numpy(atlas.mirror)
        right = vertices[torch.from_numpy(atlas.skin_mm[:, 1] > 0) & (mirror != vertices)]
        unit = torch.cat([right, vertices[mirror == vertices]])
        nearest = torch.from_numpy(atlas.nearest(unit.numpy(), near))
        return VertexLayout(unit, mirror[unit], torch.stack([nearest, mirror[nearest]], dim=1))

    @staticmethod
    def of_weights(weights: dict[str, Tensor]) -> VertexLayout:
        """The layout of a trained network, so that it can be built without its atlas."""
        unit = weights["unit"]
        neighbour = weights.get("neighbour", torch.empty(len(unit), 2, 0, dtype=torch.long))
        return VertexLayout(unit, weights["image"], neighbour)

    @property
    def halves(self) -> int:
        """Vertices off the middle line, on one side of it."""
        return int((self.unit != self.image).sum())

    @property
    def vertex_count(self) -> int:
        """V."""
        return len(self.unit) + self.halves


class VertexNet(nn.Module):
    """``[N, V]`` Pa to ``[N, V]`` J/m3. Sides: 0 a vertex of the layout itself, 1 its image."""

    unit: Tensor
    image: Tensor
    flip: Tensor
    neighbour: Tensor
    first: Tensor
    second: Tensor

    def __init__(self, spec: VertexSpec, layout: VertexLayout) -> None:
        super().__init__()
        self.spec = spec
        self.halves, self.units = layout.halves, len(layout.unit)
        self.register_buffer("unit", layout.unit)
        self.register_buffer("image", layout.image)
        even, odd, count = spec.rank - spec.rank // 2, spec.rank // 2, spec.components
        self.even = even
        self.register_buffer("flip", torch.cat([torch.ones(even), -torch.ones(odd)]))
        self.in_even = nn.Parameter(torch.randn(self.units, even) / self.units**0.5)
        self.in_odd = nn.Parameter(torch.randn(self.halves, odd) / self.halves**0.5)
        self.out_even = nn.Parameter(torch.randn(even, count * self.units) * 0.3 / even**0.5)
        self.out_odd = nn.Parameter(torch.randn(odd, count * self.units) * 0.3 / odd**0.5)
        if spec.near:
            self.register_buffer("neighbour", layout.neighbour)
            self.near = nn.Parameter(torch.zeros(self.units, spec.near, count))
        self.layers = nn.ModuleList(Gated(spec.rank, spec.hidden) for _ in range(spec.layers))
        if spec.gain:
            self.near_gain = nn.Parameter(torch.zeros(self.units, spec.near, count))
            self.gain_even = nn.Parameter(torch.zeros(even, count * self.units))
            self.gain_odd = nn.Parameter(torch.zeros(odd, count * self.units))
        # Where a vertex's SED stands in [side 0 | side 1]; on the middle line both sides' mean.
        place = torch.empty(2, layout.vertex_count, dtype=torch.long)
        place[:, layout.image] = self.units + torch.arange(self.units)
        place[:, layout.unit[: self.halves]] = torch.arange(self.halves)
        place[0, layout.unit[self.halves :]] = torch.arange(self.halves, self.units)
        self.register_buffer("first", place[0].clone())
        self.register_buffer("second", place[1].clone())

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """``[N, V]`` Pa to ``[N, V]`` J/m3."""
        pressure = pressure_pa * (1.0 / PRESSURE_UNIT_PA)
        here, there = pressure[:, self.unit], pressure[:, self.image]
        even, odd = here + there, (here - there)[:, : self.halves]
        z = start = torch.cat([even @ self.in_even, odd @ self.in_odd], dim=1)
        for layer in self.layers:
            # Even outputs of odd inputs: the mean of the layer and its mirror image.
            z = z + layer(z) + self.flip * layer(self.flip * z)
        e = self._spread(z, self.out_even, self.out_odd)
        if self.spec.near:
            near, gain = self._stencil(pressure)
            e = e + near
            if gain is not None:
                gain = gain + self._spread(start, self.gain_even, self.gain_odd)
                e = e + e * torch.tanh(gain)
        sed = (e * e).sum(dim=1).flatten(1)  # [N, 2 U]
        return (sed[:, self.first] + sed[:, self.second]) * (0.5 * SED_UNIT_J_PER_M3)

    def _spread(self, z: Tensor, even: Tensor, odd: Tensor) -> Tensor:
        """Coordinates to components ``[N, C, 2, U]``: the odd part is opposed in the mirror."""
        shape = (-1, self.spec.components, self.units)
        in_phase = (z[:, : self.even] @ even).reshape(shape)
        opposed = (z[:, self.even :] @ odd).reshape(shape)
        return torch.stack([in_phase + opposed, in_phase - opposed], dim=2)

    def _stencil(self, pressure: Tensor) -> tuple[Tensor, Tensor | None]:
        """What the nearest vertices add to components and to gains, ``[N, C, 2, U]`` each."""
        weights = [self.near, self.near_gain] if self.spec.gain else [self.near]
        # One product [2, K] x [K, C] for each vertex: a gather and a sum cost the server more.
        values = pressure[:, self.neighbour] @ torch.cat(weights, dim=2)
        parts = values.permute(0, 3, 2, 1).split(self.spec.components, dim=1)
        return parts[0], parts[1] if self.spec.gain else None
