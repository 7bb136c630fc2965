"""Models that need no training: the finger's linear operator and the half-space, as ONNX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from papilla_trainer import __version__
from papilla_trainer.checkpoint import Served
from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.comparison.compression import start_from_operator
from papilla_trainer.comparison.half_space import HalfSpace
from papilla_trainer.comparison.layout import Layout
from papilla_trainer.comparison.linear_network import LinearNet, LinearSpec
from papilla_trainer.comparison.linear_operator import Operator
from papilla_trainer.comparison.raster import Raster
from papilla_trainer.comparison.vertex_served import MapFrame, ServedVertexModel
from papilla_trainer.dataset import Dataset
from papilla_trainer.export import properties, to_onnx, write_model
from papilla_trainer.maps import F32


def write_operator(
    operator_file: Path, dataset: Dataset, rank: int, near: int, out: Path, name: str | None
) -> dict[str, Any]:
    """The finger's operator at small strain, compressed."""
    atlas = Atlas.read(dataset.directory / "atlas.json", dataset.atlas_hash)
    operator = Operator.read(operator_file, atlas)
    spec = LinearSpec(rank=rank, near=near, kind="fe_operator")
    return _write(operator, atlas, dataset, spec, out, name, {"operator_sha256": operator.sha256})


def write_half_space(
    body: HalfSpace, dataset: Dataset, rank: int, near: int, out: Path, name: str | None
) -> dict[str, Any]:
    """The closed form, compressed alike."""
    atlas = Atlas.read(dataset.directory / "atlas.json", dataset.atlas_hash)
    operator = Operator.at_vertices(body.operator(atlas))
    spec = LinearSpec(rank=rank, near=near, kind="half_space")
    return _write(operator, atlas, dataset, spec, out, name, {"half_space": vars(body)})


def _write(
    operator: Operator,
    atlas: Atlas,
    dataset: Dataset,
    spec: LinearSpec,
    out: Path,
    name: str | None,
    origin: dict[str, Any],
) -> dict[str, Any]:
    network = LinearNet(spec, Layout.of(atlas, operator, spec.near))
    skin, interface = (
        Raster.read(dataset.directory, patch, dataset.vertex_count)
        for patch in ("skin", "interface")
    )
    frame = MapFrame.of(skin, interface, dataset.vertex_count)
    pressure = vertex_pressures(dataset, frame)
    weights = torch.from_numpy(pixels_of_vertices(interface, dataset.vertex_count))
    start_from_operator(network, atlas, operator, pressure, weights)
    model = ServedVertexModel(network, frame).eval()
    # Its training is nothing; which directions of pressure matter was taken from the dataset.
    training = {"epochs": 0, "compressed_for": "training pressures", "trainer": __version__}
    props = properties(Served.of(dataset), name or out.stem, spec.as_json(), training | origin)
    write_model(to_onnx(model), props, out)
    return {"model": str(out), "bytes": out.stat().st_size}


def vertex_pressures(dataset: Dataset, frame: MapFrame) -> Tensor:
    """``[N, V]``: the training pressures, Pa, at the skin's vertices as the model samples them."""
    states = dataset.states(dataset.train_ids)
    maps = (torch.from_numpy(state.pressure_pa.copy()).flatten() for state in states)
    return torch.cat([frame.sample(one) for one in maps]).clamp(min=0.0)


def pixels_of_vertices(interface: Raster, vertex_count: int) -> F32:
    """``[V]``: the pixels that each interface vertex stands for, which is what its error counts."""
    counts = np.bincount(
        interface.vertex.ravel(), weights=interface.weight.ravel(), minlength=vertex_count
    )
    return counts.astype(np.float32)
