from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from papilla_trainer.atlas import Atlas
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError, UsageError
from papilla_trainer.losses import relative_loss
from papilla_trainer.sampling import vertex_sampler
from papilla_trainer.vertex_init import Operator, start_from_operator
from papilla_trainer.vertex_network import (
    VertexLayout,
    VertexNet,
    VertexSpec,
    parse_vertex_network,
)
from papilla_trainer.vertex_served import MapFrame, ServedVertexModel

NAMES = ("vertex-r8", "vertex-r8-c7-h6x2", "vertex-r8-n5", "vertex-r8-n5-g-h6")


@pytest.fixture(scope="module")
def atlas(tiny: Dataset) -> Atlas:
    return Atlas.read(tiny.directory / "atlas.json", tiny.atlas_hash)


def build(name: str, atlas: Atlas) -> VertexNet:
    spec = parse_vertex_network(name)
    torch.manual_seed(3)
    network = VertexNet(spec, VertexLayout.of(atlas, spec.near))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.2 * torch.randn_like(parameter)
    return network


def operator_of(atlas: Atlas) -> np.ndarray:
    """A made-up operator that knows the mirror: smooth in distance, six components."""
    apart = np.linalg.norm(atlas.skin_mm[:, None] - atlas.skin_mm[None], axis=2)
    scales = 0.5 + 0.5 * np.arange(6)
    g = np.exp(-((apart[:, None] / scales[None, :, None]) ** 2)) / scales[None, :, None]
    return (1e-3 * g).astype(np.float32)


def test_names_are_read() -> None:
    for name in (*NAMES, "vertex-r128-n16-g-h128x2"):
        assert parse_vertex_network(name).name == name
    assert parse_vertex_network("vertex-r64-h32") == VertexSpec(rank=64, hidden=32, layers=1)
    for wrong in ("vertex", "vertex-r7", "vertex-r0", "vertex-r8-g", "vertex-r8-n0", "vertex-r8-x"):
        with pytest.raises(UsageError, match=r"--network|unknown network"):
            parse_vertex_network(wrong)


@pytest.mark.parametrize("name", NAMES)
def test_zero_stays_zero_and_nothing_is_negative(name: str, atlas: Atlas) -> None:
    network = build(name, atlas)
    pressure = 1e5 * torch.rand(3, atlas.vertex_count)
    pressure[0] = 0.0
    with torch.no_grad():
        sed = network(pressure)
    assert not sed[0].any()
    assert (sed[1:] >= 0).all()
    assert sed[1:].max() > 0
    assert torch.isfinite(sed).all()


@pytest.mark.parametrize("name", NAMES)
def test_the_mirror_image_is_answered_by_the_mirror_image(name: str, atlas: Atlas) -> None:
    network, mirror = build(name, atlas), torch.from_numpy(atlas.mirror)
    pressure = 1e4 * torch.rand(2, atlas.vertex_count)
    with torch.no_grad():
        ours, theirs = network(pressure)[:, mirror], network(pressure[:, mirror])
    assert (ours - theirs).abs().max() <= 1e-5 * ours.max()


def test_without_gated_layers_sed_is_quadratic(atlas: Atlas) -> None:
    network = build("vertex-r8-n5", atlas)
    pressure = 1e4 * torch.rand(1, atlas.vertex_count)
    with torch.no_grad():
        torch.testing.assert_close(network(3.0 * pressure), 9.0 * network(pressure))


def test_the_sampler_inverts_the_rasteriser(tiny: Dataset) -> None:
    pixels, weights = vertex_sampler(tiny.skin, tiny.vertex_count)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-9)
    assert np.abs(weights).sum(axis=1).max() < 3.0  # noise is not blown up
    values, _ = tiny.load_vertices(tiny.test_ids)
    maps = tiny.skin.rasterise(values).reshape(len(values), -1)
    back = (maps[:, pixels] * weights).sum(axis=2)
    error = np.linalg.norm(back - values, axis=1) / np.linalg.norm(values, axis=1)
    assert error.max() < 2e-3
    # Any smooth map, not only rasterised ones: near its own value at the vertex.
    rows, columns = np.divmod(np.arange(224 * 224), 224)
    wave = 2.0 + np.sin(columns / 40.0) * np.cos(rows / 30.0)
    own = np.array([wave[p[0]] for p in pixels])
    assert np.abs((wave[pixels] * weights).sum(axis=1) - own).max() < 0.1


def test_the_frame_draws_what_the_rasteriser_draws(tiny: Dataset) -> None:
    frame = MapFrame.of(tiny.skin, tiny.interface, tiny.vertex_count)
    _, sed = tiny.load_vertices(tiny.test_ids[:1])
    drawn = frame.draw(torch.from_numpy(sed[:1])).numpy()[0]
    np.testing.assert_allclose(drawn, tiny.interface.rasterise(sed[:1]), atol=1e-5 * sed.max())
    assert not drawn[0][tiny.interface.mask() == 0].any()


def test_served_maps_are_the_networks_vertex_values(tiny: Dataset, atlas: Atlas) -> None:
    network = build("vertex-r8-n5-g-h6", atlas)
    frame = MapFrame.of(tiny.skin, tiny.interface, tiny.vertex_count)
    pressure, _ = tiny.load_vertices(tiny.test_ids)
    maps = torch.from_numpy(tiny.skin.rasterise(pressure))[:, None]
    with torch.no_grad():
        served = ServedVertexModel(network, frame)(maps)[:, 0].numpy()
        expected = tiny.interface.rasterise(network(torch.from_numpy(pressure)).numpy())
    # What sampling the map loses is all that may differ.
    assert np.linalg.norm(served - expected) < 3e-3 * np.linalg.norm(expected)


@pytest.mark.parametrize("near", [0, 6])
def test_a_full_rank_start_is_the_operator(near: int, tiny: Dataset, atlas: Atlas) -> None:
    g, count = operator_of(atlas), atlas.vertex_count
    network = VertexNet(VertexSpec(2 * count, near=near), VertexLayout.of(atlas, near))
    pressure = torch.from_numpy(tiny.load_vertices(tiny.train_ids)[0])
    start_from_operator(network, Operator(g, ""), pressure, torch.ones(count))
    trial = 1e4 * torch.rand(3, count)
    expected = np.einsum("vkj,nj->nvk", g.astype(np.float64), trial.numpy()) ** 2
    with torch.no_grad():
        sed = network(trial).numpy()
    np.testing.assert_allclose(sed, expected.sum(axis=2), rtol=2e-3)


def test_a_stencil_makes_a_low_rank_better(tiny: Dataset, atlas: Atlas) -> None:
    g, pressure = operator_of(atlas), torch.from_numpy(tiny.load_vertices(tiny.train_ids)[0])
    trial = 1e4 * torch.rand(20, atlas.vertex_count)
    expected = (np.einsum("vkj,nj->nvk", g, trial.numpy()) ** 2).sum(axis=2)
    errors = []
    for near in (0, 9):
        network = VertexNet(VertexSpec(16, near=near), VertexLayout.of(atlas, near))
        start_from_operator(network, Operator(g, ""), pressure, torch.ones(len(g)))
        with torch.no_grad():
            errors.append(np.linalg.norm(network(trial).numpy() - expected))
    assert errors[1] < 0.5 * errors[0]


def test_a_foreign_or_broken_operator_is_refused(atlas: Atlas, tmp_path: Path) -> None:
    path = tmp_path / "operator.npz"
    with pytest.raises(DatasetError, match="fe-datagen operator"):
        Operator.read(path, atlas)
    np.savez(path, g=operator_of(atlas))
    path.with_suffix(".json").write_text(json.dumps({"atlas_hash": "0" * 64}))
    with pytest.raises(DatasetError, match="of atlas 0000"):
        Operator.read(path, atlas)
    path.with_suffix(".json").write_text(json.dumps({"atlas_hash": atlas.hash}))
    assert Operator.read(path, atlas).g.shape == (atlas.vertex_count, 6, atlas.vertex_count)


def test_an_atlas_without_mirror_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    data = json.loads((tiny.directory / "atlas.json").read_text())
    with pytest.raises(DatasetError, match="expected"):
        Atlas.read(tiny.directory / "atlas.json", "0" * 64)
    data["skin"]["positions_mm"][0][1] += 0.05
    (tmp_path / "atlas.json").write_text(json.dumps(data))
    with pytest.raises(DatasetError, match="mirror"):
        Atlas.read(tmp_path / "atlas.json")


def test_relative_loss_is_what_it_says() -> None:
    target = torch.tensor([[10.0, 0.5, 0.5], [0.0, 0.0, 0.0]])
    weights = torch.tensor([[1.0, 2.0, 0.0]])
    output = target + torch.tensor([[1.0, 0.1, 99.0], [0.0, 0.0, 0.0]])
    whole = (1.0 + 2 * 0.01) / (100.0 + 2 * 0.25)
    far = 2 * 0.01 / (2 * 0.25 + 1e-4 * 100.5)
    expected = 0.5 * (whole + 0.3 * far)  # the empty sample counts nothing
    assert float(relative_loss(output, target, weights, 0.3)) == pytest.approx(expected, rel=1e-5)
