"""Models that need no training: the finger's linear operator and the half-space, as ONNX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from papilla_trainer import __version__
from papilla_trainer.atlas import Atlas
from papilla_trainer.checkpoint import Served
from papilla_trainer.dataset import Dataset
from papilla_trainer.evaluation import measure
from papilla_trainer.export import properties, to_onnx, write_model
from papilla_trainer.face_init import start_from_operator
from papilla_trainer.face_layout import FaceLayout
from papilla_trainer.face_network import FaceNet, FaceSpec
from papilla_trainer.halfspace import HalfSpace
from papilla_trainer.linear_operator import Operator
from papilla_trainer.tasks import pixels_of_vertices
from papilla_trainer.vertex_served import MapFrame, ServedVertexModel


def write_operator(
    operator_file: Path, dataset: Dataset, rank: int, near: int, out: Path, name: str | None
) -> dict[str, Any]:
    """The finger's operator at small strain, compressed; returns its test errors."""
    atlas = Atlas.read(dataset.directory / "atlas.json", dataset.atlas_hash)
    operator = Operator.read(operator_file, atlas)
    spec = FaceSpec(rank=rank, near=near, kind="fe_operator")
    return _write(operator, atlas, dataset, spec, out, name, {"operator_sha256": operator.sha256})


def write_half_space(
    body: HalfSpace, dataset: Dataset, rank: int, near: int, out: Path, name: str | None
) -> dict[str, Any]:
    """The closed form, compressed alike; returns its test errors."""
    atlas = Atlas.read(dataset.directory / "atlas.json", dataset.atlas_hash)
    operator = Operator.at_vertices(body.operator(atlas))
    spec = FaceSpec(rank=rank, near=near, kind="half_space")
    return _write(operator, atlas, dataset, spec, out, name, {"half_space": vars(body)})


def _write(
    operator: Operator,
    atlas: Atlas,
    dataset: Dataset,
    spec: FaceSpec,
    out: Path,
    name: str | None,
    origin: dict[str, Any],
) -> dict[str, Any]:
    network = FaceNet(spec, FaceLayout.of(atlas, operator, spec.near))
    pressure, _ = dataset.load_vertices(dataset.train_ids)
    weights = torch.from_numpy(pixels_of_vertices(dataset))
    start_from_operator(network, atlas, operator, torch.from_numpy(pressure), weights)
    frame = MapFrame.of(dataset.skin, dataset.interface, dataset.vertex_count)
    model = ServedVertexModel(network, frame).eval()
    metrics, _ = measure(model, dataset)
    # Its training is nothing; which directions of pressure matter was taken from the dataset.
    training = {"epochs": 0, "compressed_for": "training pressures", "trainer": __version__}
    props = properties(
        Served.of(dataset), name or out.stem, spec.as_json(), training | origin, metrics
    )
    write_model(to_onnx(model), props, out)
    return {"model": str(out), "bytes": out.stat().st_size, "metrics": metrics}
