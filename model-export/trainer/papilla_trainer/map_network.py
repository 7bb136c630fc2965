"""Networks from maps of pressure to maps of SED, on blocks of pixels at three resolutions.

As on faces, strain is linear in pressure to first order and SED a sum of squares. At every pixel a
network forms C components e and answers their squared length: never negative, and zero without
pressure, for there is no bias anywhere.

Two by two pixels are a block: its four pressures are channels, its four times C components too.
A global map of low rank on pixels of 8 comes first. Three levels, of blocks of 8, 4 and 2 pixels,
add to it, each a convolution over K by K blocks, linear in the pressure, with weights that vary
smoothly over the finger. Below the skin the fine part of a pressure is felt nearby alone, so few
blocks do. What differs between bone and tip, the global map knows.

Finite strain is a correction of the two coarse levels: a contact turns and stretches the skin
around it, and what the next level adds starts from there. At the finest level it was worth nothing.

Skin knows no blocks. So a block's four pixels have the same kernel of (2 K - 1)^2 weights, each
about itself, and what a level adds to the next is linear between the middles of its pixels.
"""

from __future__ import annotations

import copy
import re
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from papilla_trainer.errors import UsageError
from papilla_trainer.maps import SIDE_PX

PRESSURE_UNIT_PA = 1e4
SED_UNIT_J_PER_M3 = 100.0
_NAME = re.compile(
    r"map-c(?P<components>\d+)-k(?P<kernel>\d+)-r(?P<rank>\d+)(?:-h(?P<hidden>\d+))?"
)
# Pixels of a block.
_BLOCK = 4
# Pixels across the blocks of the coarsest level.
_COARSEST = 8
# Numbers of `_place`.
_PLACES = 5


@dataclass(frozen=True)
class MapSpec:
    """What decides a map network's shape.

    ``components``: C; ``kernel``: K, odd; ``rank``: of the global map; ``hidden``: width of
    the correction (0: none), four times that at the coarsest level.
    """

    components: int
    kernel: int
    rank: int
    hidden: int = 0
    kind: str = "map_net"

    @property
    def name(self) -> str:
        """The name that `--network` reads."""
        name = f"map-c{self.components}-k{self.kernel}-r{self.rank}"
        return name + (f"-h{self.hidden}" if self.hidden else "")

    @property
    def sides(self) -> list[int]:
        """Blocks across the map, a level each, the finest first."""
        return [SIDE_PX >> level for level in range(1, _COARSEST.bit_length())]

    def as_json(self) -> dict[str, Any]:
        """The form that the model's metadata carry."""
        return asdict(self)


def parse_map_network(name: str) -> MapSpec:
    """Read ``map-cC-kK-rR[-hH]``."""
    match = _NAME.fullmatch(name)
    if match is None:
        raise UsageError(
            f"unknown network '{name}': give map-cC-kK-rR[-hH] (components, blocks across a "
            "convolution, rank of the global map, width of the correction), e.g. map-c6-k5-r32-h16"
        )
    number = {key: int(value) for key, value in match.groupdict().items() if value is not None}
    if number["kernel"] % 2 == 0 or 0 in number.values():
        raise UsageError(f"--network {name}: K must be odd and no number may be 0")
    return MapSpec(**number)


class Level(nn.Module):
    """Components on blocks of one size, from their pressures and from those of the next size up.

    ``kernel``: ``[C, T^2]``, T = 2 K - 1, of each component about its own pixel; ``mix``:
    ``[C, C]``, what the components above give; ``over_finger``: ``[C, 5]``, how the kernels vary.
    """

    place: Tensor
    tap: Tensor
    between: Tensor

    def __init__(self, spec: MapSpec, side: int) -> None:
        super().__init__()
        width = 2 * spec.kernel - 1
        self.kernel = nn.Parameter(torch.randn(spec.components, width**2) * (0.3 / width))
        self.mix = nn.Parameter(torch.eye(spec.components))
        self.over_finger = nn.Parameter(torch.zeros(spec.components, _PLACES))
        self.register_buffer("place", _place(side), persistent=False)
        self.register_buffer("tap", _taps(spec.kernel), persistent=False)
        self.register_buffer("between", _between(), persistent=False)

    def forward(self, blocks: Tensor, above: Tensor) -> Tensor:
        """``[N, 4, n, n]`` and ``[N, C, n, n]`` to ``[N, 4 C, n, n]``."""
        return _level(blocks, above, self.on_blocks(), self.place)

    def on_blocks(self) -> BlockWeights:
        """The same weights as convolutions over blocks."""
        components, taps = len(self.kernel), self.tap.shape
        # The last weight stands for those beyond the kernel.
        padded = functional.pad(self.kernel, (0, 1))
        near = padded[:, self.tap.flatten()].reshape(components * _BLOCK, *taps[1:])
        above = self.mix[:, None, :, None, None] * self.between[None]
        return BlockWeights(
            near, above.flatten(0, 1), self.over_finger.repeat_interleave(_BLOCK, dim=0)
        )


class BlockWeights(NamedTuple):
    """A level's convolutions.

    ``near``: ``[4 C, 4, K, K]``; ``above``: ``[4 C, C, 3, 3]``; ``over_finger``: ``[4 C, 5]``.
    """

    near: Tensor
    above: Tensor
    over_finger: Tensor


def level_of_blocks(
    spec: MapSpec, near: Tensor, above: Tensor, over_finger: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Kernel, mix and over_finger of the level that :meth:`Level.on_blocks` made these of."""
    width, components = 2 * spec.kernel - 1, spec.components
    tap = _taps(spec.kernel)
    # A weight stands wherever a pixel of a block is at its place; all of these are equal.
    kernel = near.new_zeros(components, width**2 + 1)
    kernel[:, tap.flatten()] = near.reshape(components, -1)
    between = _between()
    row, column = 1, 1  # the middle: nowhere 0
    mixed = above.reshape(components, _BLOCK, components, *between.shape[2:])
    mix = mixed[:, 0, :, row, column] / between[0, 0, row, column]
    return kernel[:, :-1].contiguous(), mix.contiguous(), over_finger[::_BLOCK].contiguous()


class ServedLevel(nn.Module):
    """A level whose weights are constants, as they are exported."""

    place: Tensor

    def __init__(self, level: Level) -> None:
        super().__init__()
        # Parameters stay small constants of the graph; plain tensors would become whole maps.
        fixed = (nn.Parameter(weight.detach().clone()) for weight in level.on_blocks())
        self.near, self.above, self.over_finger = fixed
        self.register_buffer("place", level.place, persistent=False)

    def forward(self, blocks: Tensor, above: Tensor) -> Tensor:
        """As :class:`Level`."""
        weights = BlockWeights(self.near, self.above, self.over_finger)
        return _level(blocks, above, weights, self.place)


class Correction(nn.Module):
    """What finite strain adds at a block, from its components and pressures.

    The coarsest level sees the eight blocks around it too. To lowest order what is added is
    quadratic, as it should be; for large pressures it is linear.
    """

    place: Tensor

    def __init__(self, spec: MapSpec, level: int) -> None:
        super().__init__()
        channels = _BLOCK * spec.components
        coarsest = level == len(spec.sides) - 1
        inputs, kernel = channels + _BLOCK, 3 if coarsest else 1
        hidden = spec.hidden * (_BLOCK if coarsest else 1)
        self.value = _convolution(inputs, hidden, kernel)
        self.gate = _convolution(inputs, hidden, kernel)
        self.out = _convolution(hidden, channels, 1)
        for layer in (self.value, self.gate):
            nn.init.normal_(layer.weight, std=inputs**-0.5 / kernel)
        nn.init.zeros_(self.out.weight)
        self.over_finger = nn.Parameter(torch.zeros(hidden, _PLACES))
        self.register_buffer("place", _place(spec.sides[level]), persistent=False)

    def forward(self, components: Tensor, blocks: Tensor) -> Tensor:
        """``[N, 4 C, n, n]`` and ``[N, 4, n, n]`` to what is added to the components."""
        inputs = torch.cat([components, blocks], dim=1)
        gated = self.value(inputs) * self.gate(inputs).clamp(-1.0, 1.0)
        added: Tensor = self.out(gated * _gain(self.over_finger, self.place))
        return added


class MapNet(nn.Module):
    """``[N, 1, 224, 224]`` Pa to ``[N, 1, 224, 224]`` J/m3, >= 0."""

    def __init__(self, spec: MapSpec) -> None:
        super().__init__()
        self.spec = spec
        self.levels = nn.ModuleList(Level(spec, side) for side in spec.sides)
        self.coarse_side = spec.sides[-1]
        pixels = self.coarse_side**2
        self.reach_in = nn.Parameter(torch.randn(pixels, spec.rank) / pixels**0.5)
        self.reach_out = nn.Parameter(
            torch.randn(spec.rank, spec.components * pixels) * 0.05 / spec.rank**0.5
        )
        corrected = range(len(spec.sides))[-2:] if spec.hidden else ()
        self.corrections = nn.ModuleDict(
            {str(level): Correction(spec, level) for level in corrected}
        )

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """Maps of pressure to maps of SED, also where the interface is not."""
        pressure = pressure_pa * (1.0 / PRESSURE_UNIT_PA)
        blocks = functional.pixel_unshuffle(pressure, 2)
        components = self._components(blocks)
        squares = components * components
        shape = (-1, self.spec.components, _BLOCK, *squares.shape[2:])
        sed = functional.pixel_shuffle(squares.reshape(shape).sum(dim=1), 2)
        return sed * SED_UNIT_J_PER_M3

    def _components(self, finest: Tensor) -> Tensor:
        """Components on the finest blocks."""
        blocks = [finest]
        for _ in self.spec.sides[1:]:
            blocks.append(functional.pixel_unshuffle(_mean(blocks[-1]), 2))
        coarse = _mean(blocks[-1]).flatten(1)
        shape = (-1, self.spec.components, self.coarse_side, self.coarse_side)
        above = ((coarse @ self.reach_in) @ self.reach_out).reshape(shape)
        components = above
        for index in reversed(range(len(blocks))):
            components = self.levels[index](blocks[index], above)
            if str(index) in self.corrections:
                correction = self.corrections[str(index)]
                components = components + correction(components, blocks[index])
            above = functional.pixel_shuffle(components, 2)
        return components


class ServedMapModel(nn.Module):
    """The graph that is exported: blank outside the interface patch."""

    mask: Tensor

    def __init__(self, network: MapNet, mask: Tensor) -> None:
        """``mask``: float32 ``[224, 224]``, 1 on the interface patch and 0 outside."""
        super().__init__()
        self.network = copy.deepcopy(network)
        self.network.levels = nn.ModuleList(ServedLevel(level) for level in network.levels)
        self.register_buffer("mask", mask[None, None].contiguous())

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """``[N, 1, 224, 224]`` Pa to ``[N, 1, 224, 224]`` J/m3."""
        sed: Tensor = self.network(pressure_pa) * self.mask
        return sed


def _convolution(channels_in: int, channels_out: int, kernel: int) -> nn.Conv2d:
    return nn.Conv2d(channels_in, channels_out, kernel, padding=kernel // 2, bias=False)


def _mean(blocks: Tensor) -> Tensor:
    """``[N, 4, n, n]`` to ``[N, 1, n, n]``; a convolution, which runs faster than a reduction."""
    return functional.conv2d(blocks, blocks.new_full((1, _BLOCK, 1, 1), 1.0 / _BLOCK))


def _level(blocks: Tensor, above: Tensor, weights: BlockWeights, place: Tensor) -> Tensor:
    """What blocks and the level above give: ``[N, 4, n, n]`` and ``[N, C, n, n]``."""
    near = functional.conv2d(blocks, weights.near, padding=weights.near.shape[-1] // 2)
    return near * _gain(weights.over_finger, place) + functional.conv2d(
        above, weights.above, padding=1
    )


def _taps(kernel: int) -> Tensor:
    """``[4, 4, K, K]``: the place in a pixel's kernel of each pixel of the blocks around its own.

    (2 K - 1)^2 is no place: such a pixel is further from this one than from its block's others.
    """
    width = 2 * kernel - 1
    pixel = torch.arange(2)
    block = 2 * (torch.arange(kernel) - kernel // 2)
    # Of pixel i of a block b away from pixel o: [o, i, b].
    away = block + pixel[None, :, None] - pixel[:, None, None] + width // 2
    y, x = away[:, None, :, None, :, None], away[None, :, None, :, None, :]
    inside = (y >= 0) & (y < width) & (x >= 0) & (x < width)
    tap = torch.where(inside, y * width + x, torch.tensor(width**2))
    return tap.reshape(_BLOCK, _BLOCK, kernel, kernel)


def _between() -> Tensor:
    """``[4, 1, 3, 3]``: a pixel's four of half its width, linear between middles of its like."""
    low, high = torch.tensor([0.25, 0.75, 0.0]), torch.tensor([0.0, 0.75, 0.25])
    halves = [torch.outer(y, x) for y in (low, high) for x in (low, high)]
    return torch.stack(halves)[:, None]


def _gain(weights: Tensor, place: Tensor) -> Tensor:
    """``[1, channels, n, n]`` about 1, from ``[channels, 5]`` and ``[5, n, n]``."""
    return 1.0 + torch.einsum("ck,kyx->cyx", weights, place)[None]


def _place(side: int) -> Tensor:
    """``[5, side, side]``: smooth numbers of size one, even in the mirror."""
    at = (torch.arange(side) + 0.5) / side * 2.0 - 1.0
    y, x = torch.meshgrid(at, at, indexing="ij")
    return torch.stack([y, x * x - 0.5, y * y - 0.5, x * x * y, (y * y - 0.5) * y])
