from __future__ import annotations

import pytest
import torch

from papilla_trainer.comparison.unet import NetworkSpec, S1UNet, build_network, parse_network
from papilla_trainer.errors import UsageError


def test_names_are_read() -> None:
    assert parse_network("s1-base16") == NetworkSpec("s1_unet", 16)
    assert parse_network("s1-base16").name == "s1-base16"
    for wrong in ("s1-base", "s1-base0", "unet", "s1-base8x"):
        with pytest.raises(UsageError, match="unknown network"):
            parse_network(wrong)


def test_layers_are_those_of_s1() -> None:
    convolutions = [m for m in S1UNet(8).modules() if isinstance(m, torch.nn.Conv2d)]
    upsamplings = [m for m in S1UNet(8).modules() if isinstance(m, torch.nn.ConvTranspose2d)]
    widths = [(c.in_channels, c.out_channels) for c in convolutions if c.kernel_size == (3, 3)]
    assert widths == [
        (1, 8), (8, 8), (8, 16), (16, 16), (16, 32), (32, 32), (32, 16), (16, 16), (16, 8), (8, 8),
    ]  # fmt: skip
    assert [(u.in_channels, u.out_channels) for u in upsamplings] == [(32, 16), (16, 8)]


def test_receptive_field_is_44_px() -> None:
    """The published U-Net sees 44 of 224 px.

    The field is the union over the four phases of the two poolings. All weights are made
    positive, so that no path cancels, and the input is uniform, so that max-pool passes gradients.
    """
    network = S1UNet(2).double()
    for parameter in network.parameters():
        parameter.data = parameter.data.abs() + 0.1
    torch.manual_seed(0)
    extents = []
    for pixel in range(60, 64):
        reached = torch.zeros(128, dtype=torch.bool)
        for _ in range(24):  # which pixel of a pool wins varies with the input
            inputs = torch.rand(1, 1, 128, 128, dtype=torch.double, requires_grad=True)
            network(inputs)[0, 0, pixel, pixel].backward()
            assert inputs.grad is not None
            reached |= (inputs.grad[0, 0] != 0).any(dim=0)
        columns = torch.nonzero(reached)
        extents.append(int(columns.max() - columns.min()) + 1)
    assert max(extents) <= 44
    assert min(extents) >= 40


def test_same_seed_same_weights() -> None:
    spec = parse_network("s1-base4")
    a, b, c = (build_network(spec, seed).state_dict() for seed in (3, 3, 4))
    assert all(torch.equal(a[name], b[name]) for name in a)
    assert not all(torch.equal(a[name], c[name]) for name in a)


def test_signal_neither_dies_nor_explodes_at_the_start() -> None:
    """The reason for He's initialisation: what comes out still varies with what goes in."""
    torch.manual_seed(0)
    inputs = torch.rand(2, 1, 64, 64)
    for seed in range(5):
        with torch.no_grad():
            outputs = build_network(parse_network("s1-base8"), seed)(inputs)
        assert 0.1 < float(outputs.std() / inputs.std()) < 10
