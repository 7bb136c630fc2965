"""Networks on maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from torch.nn import functional

from papilla_trainer.augment import mirrored, reach_px, varied
from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import UsageError
from papilla_trainer.export import export_run
from papilla_trainer.map_network import MapNet, MapSpec, parse_map_network
from papilla_trainer.serving import served_model
from papilla_trainer.training import Trainer

NAMES = ("map-c2-k3-r4", "map-c3-k5-r2-h4")


def build(name: str) -> MapNet:
    torch.manual_seed(5)
    network = MapNet(parse_map_network(name))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.05 * torch.randn_like(parameter)
    return network


def pressure_pa() -> torch.Tensor:
    maps = torch.zeros(2, 1, 224, 224)
    maps[0, 0, 90:100, 100:121] = 2e4
    maps[1, 0, 60:64, 70:130] = 5e3
    return maps


def test_names_are_read() -> None:
    for name in NAMES:
        assert parse_map_network(name).name == name
    assert parse_map_network("map-c6-k5-r32-h16") == MapSpec(6, 5, 32, 16)
    assert parse_map_network("map-c3-k3-r32").sides == [112, 56, 28]
    wrong_names = ("map", "map-c6", "map-c6-k4-r2", "map-c0-k3-r2", "map-c6-k3-r2-h0", "map-k3-c6")
    for wrong in (*wrong_names, "map-c6-k3-r2-p2", "map-c6-k3-r2-h4-p2"):
        with pytest.raises(UsageError, match=r"--network|unknown network"):
            parse_map_network(wrong)


@pytest.mark.parametrize("name", NAMES)
@torch.no_grad()
def test_sed_is_an_energy(name: str) -> None:
    network, pressure = build(name), pressure_pa()
    sed = network(pressure)
    assert sed.shape == pressure.shape
    assert (sed >= 0.0).all()
    assert sed.max() > 0.0
    assert (network(torch.zeros_like(pressure)) == 0.0).all()


@torch.no_grad()
def test_without_correction_sed_is_quadratic_in_pressure() -> None:
    network, pressure = build("map-c2-k3-r4"), pressure_pa()
    assert torch.allclose(network(3.0 * pressure), 9.0 * network(pressure), rtol=1e-4, atol=1e-6)


@torch.no_grad()
def test_the_correction_vanishes_faster_than_the_linear_part() -> None:
    network, pressure = build("map-c3-k5-r2-h4"), pressure_pa()
    with_it = [network(s * pressure) / s**2 for s in (1e-3, 1.0)]
    network.corrections.clear()
    bare = network(pressure)
    light, heavy = (((found - bare).norm() / bare.norm()).item() for found in with_it)
    assert light < 1e-2 < heavy


@torch.no_grad()
def test_a_pixel_is_felt_in_blocks_around_it_and_through_the_global_map_elsewhere() -> None:
    network, spot = build("map-c2-k3-r4"), torch.zeros(1, 1, 224, 224)
    spot[0, 0, 112, 112] = 1e4
    everywhere = network(spot)
    network.reach_out.zero_()
    near = network(spot)
    assert everywhere[0, 0, 20, 20] > 0.0
    assert near[0, 0, 112, 112] > 0.0
    assert near[0, 0, 20, 20] == 0.0


@torch.no_grad()
def test_the_finest_level_is_the_same_about_every_pixel_of_a_block() -> None:
    network = build("map-c2-k3-r4")
    network.reach_out.zero_()
    for level in network.levels:
        level.over_finger.zero_()
    for level in list(network.levels)[1:]:
        level.kernel.zero_()
    spots = torch.zeros(4, 1, 224, 224)
    for spot, (y, x) in zip(spots, ((112, 112), (112, 113), (113, 112), (113, 113)), strict=True):
        spot[0, y, x] = 1e4
    first, *others = network(spots)
    assert first.max() > 0.0
    # It reaches two pixels far: 2 K - 1 = 5 of them.
    assert (first[0].amax(dim=0) > 0.0).nonzero().flatten().tolist() == [110, 111, 112, 113, 114]
    for sed, step in zip(others, ((0, 1), (1, 0), (1, 1)), strict=True):
        assert torch.allclose(sed, first.roll(step, (1, 2)), rtol=1e-4, atol=1e-6 * first.max())


def spots(width_px: int, count: int) -> torch.Tensor:
    maps = torch.zeros(count, 1, 224, 224)
    heights = 1e4 * (1.0 + torch.arange(count)).reshape(-1, 1, 1, 1)
    maps[..., 100 : 100 + width_px, 90 : 90 + width_px] = heights
    return maps


def test_wide_contacts_are_moved_by_less() -> None:
    reaches = [reach_px(spots(width, 2), 3).tolist() for width in (1, 15, 25, 60, 120)]
    assert reaches == [[3, 3], [3, 3], [2, 2], [1, 1], [0, 0]]
    assert reach_px(torch.zeros(1, 1, 224, 224), 3).tolist() == [3]
    wide = spots(120, 4)
    straight, _ = varied(wide, wide, 0, torch.Generator())
    assert torch.equal(varied(wide, wide, 3, torch.Generator())[0], straight)


def test_samples_are_moved_with_their_sed() -> None:
    maps = spots(9, 5) * torch.rand(5, 1, 224, 224)
    straight, _ = varied(maps, maps, 0, torch.Generator().manual_seed(1))
    assert torch.equal(straight, torch.cat([maps[::2], mirrored(maps[1::2])]))
    pressure, sed = varied(maps, 2.0 * maps, 3, torch.Generator().manual_seed(1))
    assert torch.equal(2.0 * pressure, sed)
    steps = [(y, x) for y in range(-3, 4) for x in range(-3, 4)]
    moves = {
        step
        for step in steps
        for before, after in zip(straight, pressure, strict=True)
        if torch.equal(before.roll(step, (1, 2)), after)
    }
    assert len(moves) > 2
    again, _ = varied(maps, maps, 3, torch.Generator().manual_seed(1))
    assert torch.equal(again, pressure)


def test_shifts_are_for_maps_and_small() -> None:
    for network, shift in (("s1-base4", 2), ("map-c2-k3-r4", 8), ("map-c2-k3-r4", -1)):
        with pytest.raises(UsageError, match="--shift-px"):
            TrainConfig(network=network, shift_px=shift)


@torch.no_grad()
def test_between_the_middles_of_pixels_values_are_linear() -> None:
    between = build("map-c2-k3-r4").levels[0].get_buffer("between")
    y, x = torch.meshgrid(torch.arange(24.0), torch.arange(24.0), indexing="ij")
    plane = 3.0 * y - 2.0 * x + 100.0
    coarse = functional.avg_pool2d(plane[None, None], 2)
    drawn = functional.pixel_shuffle(functional.conv2d(coarse, between, padding=1), 2)[0, 0]
    assert torch.allclose(drawn[2:-2, 2:-2], plane[2:-2, 2:-2])


def test_what_varies_over_the_finger_is_even_in_the_mirror() -> None:
    for level in build("map-c2-k3-r4").levels:
        place = level.get_buffer("place")
        assert torch.allclose(mirrored(place), place, atol=1e-6)


@pytest.fixture(scope="module")
def config() -> TrainConfig:
    return TrainConfig(
        network="map-c2-k3-r4-h4",
        epochs=4,
        batch=4,
        learning_rate=1e-2,
        threads=1,
        seed=3,
        shift_px=2,
    )


@pytest.fixture(scope="module")
def run(
    tiny: Dataset, config: TrainConfig, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Checkpoint]:
    folder = tmp_path_factory.mktemp("map") / "run"
    return folder, Trainer(tiny, config, folder).fit()


def test_it_learns_and_resumes(
    tiny: Dataset, config: TrainConfig, run: tuple[Path, Checkpoint], tmp_path: Path
) -> None:
    straight = run[1]
    losses = [line["train_loss"] for line in straight.history]
    assert losses[-1] < 0.8 * losses[0]
    trainer = Trainer(tiny, config, tmp_path / "twice")

    def stop_after_two(_: object) -> None:
        if trainer.state.epoch == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trainer.fit(stop_after_two)
    again = Trainer(tiny, config, tmp_path / "twice", resume=True).fit()
    assert all(torch.equal(again.model[name], value) for name, value in straight.model.items())


def test_the_exported_graph_is_the_trained_network(
    tiny: Dataset, run: tuple[Path, Checkpoint], tmp_path: Path
) -> None:
    folder, checkpoint = run
    path = export_run(folder, tmp_path / "map.onnx")
    assert {p.key for p in onnx.load(path).metadata_props} >= {"papilla.network"}
    session = onnxruntime.InferenceSession(path)
    model = served_model(checkpoint)
    maps = tiny.load(tiny.test_ids).pressure_pa[:3, None]
    for one in maps:
        (found,) = session.run(None, {"pressure_pa": one[None]})
        with torch.no_grad():
            due = model(torch.from_numpy(one[None])).numpy()
        assert np.abs(found - due).max() <= 1e-5 * due.max()
        assert (found[0, 0][tiny.mask() == 0] == 0.0).all()
