"""The published U-Net (docs/glossary.md, sources) and the wrapper that is exported."""

from __future__ import annotations

import re
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from papilla_trainer.errors import UsageError

_NAME = re.compile(r"s1-base(\d{1,3})")


@dataclass(frozen=True)
class NetworkSpec:
    """What has to be known to build a network again: its kind and base width (channels)."""

    kind: str
    base: int

    @property
    def name(self) -> str:
        """The name of the rung of the ladder, such as ``s1-base8``."""
        return f"s1-base{self.base}"

    def as_json(self) -> dict[str, str | int]:
        """The form that the model's metadata carry."""
        return {"kind": self.kind, "base": self.base}


def parse_network(name: str) -> NetworkSpec:
    """Read a network's name (``s1-base4``, ``s1-base8``, ``s1-base16``, ...)."""
    match = _NAME.fullmatch(name)
    if match is None or int(match.group(1)) < 1:
        raise UsageError(
            f"unknown network '{name}': give s1-baseN, where N is the channels of the first "
            "stage, e.g. s1-base4, s1-base8, s1-base16; or map-c6-k5-r32-h16 and "
            "the like"
        )
    return NetworkSpec(kind="s1_unet", base=int(match.group(1)))


def _double_conv(channels_in: int, channels_out: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(channels_in, channels_out, kernel_size=3, padding=1),
        nn.ReLU(),
        nn.Conv2d(channels_out, channels_out, kernel_size=3, padding=1),
        nn.ReLU(),
    )


class S1UNet(nn.Module):
    """The U-Net of the paper: two encoding and two decoding stages.

    Two 3 x 3 convolutions with ReLU in each stage, 2 x 2 max-pool down, 2 x 2 transposed
    convolution up, skips by concatenation, width doubled from stage to stage (the paper prints
    neither width nor head: base is a parameter here, the head is a linear 1 x 1 convolution).

    Input and output: float32 ``[N, 1, H, W]``, max-normalised, H and W multiples of 4.
    """

    def __init__(self, base: int) -> None:
        super().__init__()
        self.encode_1 = _double_conv(1, base)
        self.encode_2 = _double_conv(base, 2 * base)
        self.pool = nn.MaxPool2d(kernel_size=2, stride=2)
        self.bottleneck = _double_conv(2 * base, 4 * base)
        self.up_2 = nn.ConvTranspose2d(4 * base, 2 * base, kernel_size=2, stride=2)
        self.decode_2 = _double_conv(4 * base, 2 * base)
        self.up_1 = nn.ConvTranspose2d(2 * base, base, kernel_size=2, stride=2)
        self.decode_1 = _double_conv(2 * base, base)
        self.head = nn.Conv2d(base, 1, kernel_size=1)

    def forward(self, pressure: Tensor) -> Tensor:
        """Normalised pressure maps to normalised SED maps (may dip below zero)."""
        full = self.encode_1(pressure)
        half = self.encode_2(self.pool(full))
        quarter = self.bottleneck(self.pool(half))
        up_half = self.decode_2(torch.cat([self.up_2(quarter), half], dim=1))
        up_full = self.decode_1(torch.cat([self.up_1(up_half), full], dim=1))
        return self.head(up_full)


class ServedModel(nn.Module):
    """The graph that is exported: pressure in Pa to SED in J/m3.

    Scales in, runs the network, clamps at zero (SED is an energy; training itself sees the bare
    network, as the paper's did), scales out and blanks what lies outside the interface patch.
    Networks with biases leave a residue where there is no pressure; the graph blanks that case.
    """

    gain: Tensor

    def __init__(
        self, network: nn.Module, mask: Tensor, pressure_max_pa: float, sed_max_j_per_m3: float
    ) -> None:
        """``mask``: float32 ``[H, W]``, 1 on the interface patch and 0 outside."""
        super().__init__()
        self.network = network
        self.pressure_scale = 1.0 / pressure_max_pa
        # Mask and output scale are one constant, so serving pays one multiplication for both.
        self.register_buffer("gain", (mask * sed_max_j_per_m3)[None, None].contiguous())

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """``[N, 1, H, W]`` Pa to ``[N, 1, H, W]`` J/m3, >= 0, 0 outside the mask."""
        normalised = self.network(pressure_pa * self.pressure_scale)
        return torch.relu(normalised) * self.gain * _any(pressure_pa)


def _any(pressure_pa: Tensor) -> Tensor:
    """``[N, 1, 1, 1]``: 0 where a map has no pressure, exactly 1 beyond 1e-20 Pa anywhere."""
    return (pressure_pa.amax(dim=(2, 3), keepdim=True) * 1e20).clamp(0.0, 1.0)


def build_network(spec: NetworkSpec, seed: int) -> S1UNet:
    """A freshly initialised network; the same seed gives the same weights."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = S1UNet(spec.base)
        for module in network.modules():
            if isinstance(module, nn.Conv2d | nn.ConvTranspose2d):
                _initialise(module)
    return network


def _initialise(layer: nn.Conv2d | nn.ConvTranspose2d) -> None:
    """He's normal initialisation (2015) with zero biases.

    The U-Net paper prints none. PyTorch's default shrinks the signal by about two at each of the
    eleven layers: narrow networks then learn their biases first and stay on a plateau for many
    epochs.
    """
    if isinstance(layer, nn.ConvTranspose2d):
        # Kernel and stride are equal: each output pixel is reached by one tap of each channel.
        nn.init.normal_(layer.weight, std=layer.in_channels**-0.5)
    elif layer.kernel_size == (1, 1):
        nn.init.kaiming_normal_(layer.weight, nonlinearity="linear")
    else:
        nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
    if layer.bias is not None:
        nn.init.zeros_(layer.bias)
