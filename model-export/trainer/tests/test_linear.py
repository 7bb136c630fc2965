"""Operators as networks at the vertices."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import tiny_dataset
import torch

from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.comparison.compression import start_from_operator
from papilla_trainer.comparison.layout import Layout, frames
from papilla_trainer.comparison.linear_network import LinearNet, LinearSpec
from papilla_trainer.comparison.linear_operator import Operator
from papilla_trainer.comparison.raster import Raster
from papilla_trainer.comparison.sampling import vertex_sampler
from papilla_trainer.comparison.untrained import vertex_pressures
from papilla_trainer.comparison.vertex_served import MapFrame, ServedVertexModel
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError

SPECS = (LinearSpec(8, 0, "test"), LinearSpec(8, 12, "test"))


@pytest.fixture(scope="module")
def atlas(tiny: Dataset) -> Atlas:
    return Atlas.read(tiny.directory / "atlas.json", tiny.atlas_hash)


@pytest.fixture(scope="module")
def operator(operator_file: Path, atlas: Atlas) -> Operator:
    return Operator.read(operator_file, atlas)


@pytest.fixture(scope="module")
def skin(tiny: Dataset) -> Raster:
    return Raster.read(tiny.directory, "skin", tiny.vertex_count)


@pytest.fixture(scope="module")
def interface(tiny: Dataset) -> Raster:
    return Raster.read(tiny.directory, "interface", tiny.vertex_count)


def drawn(values: np.ndarray, raster: Raster) -> np.ndarray:
    return tiny_dataset.drawn(values, raster.pixel, raster.vertex, raster.weight)


def build(spec: LinearSpec, atlas: Atlas, operator: Operator) -> LinearNet:
    torch.manual_seed(3)
    network = LinearNet(spec, Layout.of(atlas, operator, spec.near))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.2 * torch.randn_like(parameter)
    return network


def started(spec: LinearSpec, tiny: Dataset, atlas: Atlas, operator: Operator) -> LinearNet:
    network = LinearNet(spec, Layout.of(atlas, operator, spec.near))
    pressure = torch.from_numpy(tiny_dataset.vertex_pressures(tiny.directory, tiny.train_ids))
    start_from_operator(network, atlas, operator, pressure, torch.ones(atlas.vertex_count))
    return network


def dense(operator: Operator, pressure: torch.Tensor) -> np.ndarray:
    """SED ``[N, V]`` by the definition."""
    e = np.einsum("fkj,nj->nfk", operator.g.astype(np.float64), pressure.numpy())
    return ((e**2).sum(axis=2)[:, operator.vertex_face] * operator.vertex_weight).sum(axis=2)


@pytest.mark.parametrize("spec", SPECS)
def test_zero_stays_zero_and_nothing_is_negative(
    spec: LinearSpec, atlas: Atlas, operator: Operator
) -> None:
    network = build(spec, atlas, operator)
    pressure = 1e5 * torch.rand(3, atlas.vertex_count)
    pressure[0] = 0.0
    with torch.no_grad():
        sed = network(pressure)
    assert not sed[0].any()
    assert (sed[1:] >= 0).all()
    assert sed[1:].max() > 0
    assert torch.isfinite(sed).all()


@pytest.mark.parametrize("spec", SPECS)
def test_the_mirror_image_is_answered_by_the_mirror_image(
    spec: LinearSpec, atlas: Atlas, operator: Operator
) -> None:
    network, mirror = build(spec, atlas, operator), torch.from_numpy(atlas.mirror)
    pressure = 1e4 * torch.rand(2, atlas.vertex_count)
    with torch.no_grad():
        ours, theirs = network(pressure)[:, mirror], network(pressure[:, mirror])
    assert (ours - theirs).abs().max() <= 1e-5 * ours.max()


def test_sed_is_quadratic(atlas: Atlas, operator: Operator) -> None:
    network = build(SPECS[1], atlas, operator)
    pressure = 1e4 * torch.rand(1, atlas.vertex_count)
    with torch.no_grad():
        torch.testing.assert_close(network(3.0 * pressure), 9.0 * network(pressure))


def test_the_sampler_inverts_the_raster(tiny: Dataset, skin: Raster, interface: Raster) -> None:
    pixels, weights = vertex_sampler(skin, tiny.vertex_count)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-9)
    assert np.abs(weights).sum(axis=1).max() < 3.0  # noise is not blown up
    values = tiny_dataset.vertex_pressures(tiny.directory, tiny.test_ids)
    maps = drawn(values, skin).reshape(len(values), -1)
    back = (maps[:, pixels] * weights).sum(axis=2)
    error = np.linalg.norm(back - values, axis=1) / np.linalg.norm(values, axis=1)
    assert error.max() < 2e-3
    # So a model is told the pressures of the training states.
    frame = MapFrame.of(skin, interface, tiny.vertex_count)
    told = vertex_pressures(tiny, frame).numpy()
    values = tiny_dataset.vertex_pressures(tiny.directory, tiny.train_ids)
    assert np.linalg.norm(told - values) < 2e-3 * np.linalg.norm(values)
    # Any smooth map, not only rasterised ones: near its own value at the vertex.
    rows, columns = np.divmod(np.arange(224 * 224), 224)
    wave = 2.0 + np.sin(columns / 40.0) * np.cos(rows / 30.0)
    own = np.array([wave[p[0]] for p in pixels])
    assert np.abs((wave[pixels] * weights).sum(axis=1) - own).max() < 0.1


def test_the_frame_draws_what_the_raster_says(
    tiny: Dataset, skin: Raster, interface: Raster
) -> None:
    frame = MapFrame.of(skin, interface, tiny.vertex_count)
    values = tiny_dataset.vertex_pressures(tiny.directory, tiny.test_ids[:1])[:1]
    found = frame.draw(torch.from_numpy(values)).numpy()[0]
    np.testing.assert_allclose(found, drawn(values, interface), atol=1e-5 * values.max())
    assert not found[0][tiny.mask() == 0].any()


def test_served_maps_are_the_networks_vertex_values(
    tiny: Dataset, atlas: Atlas, operator: Operator, skin: Raster, interface: Raster
) -> None:
    network = build(SPECS[1], atlas, operator)
    frame = MapFrame.of(skin, interface, tiny.vertex_count)
    pressure = tiny_dataset.vertex_pressures(tiny.directory, tiny.test_ids)
    maps = torch.from_numpy(drawn(pressure, skin))[:, None]
    with torch.no_grad():
        served = ServedVertexModel(network, frame)(maps)[:, 0].numpy()
        expected = drawn(network(torch.from_numpy(pressure)).numpy(), interface)
    # What sampling the map loses is all that may differ.
    assert np.linalg.norm(served - expected) < 3e-3 * np.linalg.norm(expected)


@pytest.mark.parametrize("near", [0, 6])
def test_a_full_rank_start_is_the_operator(
    near: int, tiny: Dataset, atlas: Atlas, operator: Operator
) -> None:
    network = started(LinearSpec(2 * atlas.vertex_count, near, "test"), tiny, atlas, operator)
    trial = 1e4 * torch.rand(3, atlas.vertex_count)
    with torch.no_grad():
        sed = network(trial).numpy()
    np.testing.assert_allclose(sed, dense(operator, trial), rtol=2e-3)


def test_an_operator_of_the_vertices_works_alike(tiny: Dataset, atlas: Atlas) -> None:
    """Faces on the middle line are their own mirror images: the half-space's are."""
    apart = np.linalg.norm(atlas.skin_mm[:, None] - atlas.skin_mm[None], axis=2)
    scales = 0.5 + 0.5 * np.arange(6)
    g = 1e-3 * np.exp(-((apart[:, None] / scales[None, :, None]) ** 2))
    operator = Operator.at_vertices(g.astype(np.float32))
    network = started(LinearSpec(2 * atlas.vertex_count, 0, "test"), tiny, atlas, operator)
    trial = 1e4 * torch.rand(3, atlas.vertex_count)
    with torch.no_grad():
        sed = network(trial).numpy()
    np.testing.assert_allclose(sed, dense(operator, trial), rtol=2e-3)


def test_a_stencil_makes_a_low_rank_better(tiny: Dataset, atlas: Atlas, operator: Operator) -> None:
    trial = 1e4 * torch.rand(20, atlas.vertex_count)
    errors = []
    for near in (0, 16):
        network = started(LinearSpec(16, near, "test"), tiny, atlas, operator)
        with torch.no_grad():
            errors.append(np.linalg.norm(network(trial).numpy() - dense(operator, trial)))
    assert errors[1] < 0.5 * errors[0]


def test_frames_are_rotations(atlas: Atlas, operator: Operator) -> None:
    turn = frames(atlas, operator)
    np.testing.assert_allclose(
        turn @ turn.transpose(0, 2, 1), np.broadcast_to(np.eye(6), turn.shape), atol=1e-12
    )
    # On a flat patch the frame is the finger's own up to the side that the skin is on.
    np.testing.assert_allclose(np.abs(turn), np.broadcast_to(np.eye(6), turn.shape), atol=1e-12)


def test_a_foreign_or_broken_operator_is_refused(
    atlas: Atlas, operator: Operator, tmp_path: Path
) -> None:
    path = tmp_path / "operator.npz"
    with pytest.raises(DatasetError, match="fe-datagen operator"):
        Operator.read(path, atlas)
    whole = {
        "face_g": operator.g,
        "vertex_face": operator.vertex_face,
        "vertex_weight": operator.vertex_weight,
    }
    np.savez(path, **whole)
    path.with_suffix(".json").write_text(json.dumps({"atlas_hash": "0" * 64}))
    with pytest.raises(DatasetError, match="of atlas 0000"):
        Operator.read(path, atlas)
    path.with_suffix(".json").write_text(json.dumps({"atlas_hash": atlas.hash}))
    assert Operator.read(path, atlas).g.shape == operator.g.shape
    for name, value, fault in (
        ("face_g", operator.g[:, :5], "shape"),
        ("face_g", np.where(operator.g > 0, np.nan, 0.0), "finite"),
        ("vertex_face", operator.vertex_face + 1, "beyond"),
        ("vertex_weight", 2.0 * operator.vertex_weight, "mean"),
    ):
        np.savez(path, **{**whole, name: value})
        with pytest.raises(DatasetError, match=fault):
            Operator.read(path, atlas)


def test_an_atlas_without_mirror_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    data = json.loads((tiny.directory / "atlas.json").read_text())
    with pytest.raises(DatasetError, match="expected"):
        Atlas.read(tiny.directory / "atlas.json", "0" * 64)
    data["skin"]["positions_mm"][0][1] += 0.05
    (tmp_path / "atlas.json").write_text(json.dumps(data))
    with pytest.raises(DatasetError, match="mirror"):
        Atlas.read(tmp_path / "atlas.json")
