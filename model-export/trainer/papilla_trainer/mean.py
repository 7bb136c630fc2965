"""The mean of several runs' networks as one model: what each errs by itself partly cancels.

What they all err by does not: networks learn from many indentations of a coarser mesh. A few of a
finer one tell by which factor its SED is off for the same pressure, and the mean is put right.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor, nn

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError, RunError
from papilla_trainer.evaluation import measure, predict, served_model
from papilla_trainer.export import properties, to_onnx, training_record, write_model


class MeanModel(nn.Module):
    """``[N, 1, 224, 224]`` Pa to ``factor`` times the mean of what the models answer, J/m3."""

    def __init__(self, models: list[nn.Module], factor: float = 1.0) -> None:
        super().__init__()
        self.models = nn.ModuleList(models)
        self.factor = factor

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """As each of the models."""
        first, *others = self.models
        total: Tensor = first(pressure_pa)
        for model in others:
            total = total + model(pressure_pa)
        return total * (self.factor / len(self.models))


def mean_model(checkpoints: list[Checkpoint], factor: float = 1.0) -> nn.Module:
    """The model as it is exported, on the CPU."""
    return MeanModel([served_model(checkpoint) for checkpoint in checkpoints], factor).eval()


def fitted_factor(model: nn.Module, finer: Dataset) -> float:
    """What brings a model's answers closest to the SED of all samples of a finer mesh.

    The median over samples of ``p . t / p . p``, so that no single one decides.
    """
    maps = finer.load(finer.train_ids + finer.test_ids)
    inside = finer.interface.mask() > 0
    factors = []
    for pressure, truth in zip(maps.pressure_pa, maps.sed_j_per_m3, strict=True):
        t = truth[inside].astype(np.float64)
        p = predict(model, pressure[None])[0][inside].astype(np.float64)
        if t.any() and p.any():
            factors.append(float(p @ t) / float(p @ p))
    if not factors:
        raise DatasetError(f"{finer.directory}: no sample has both SED and an answer of the mean")
    return float(np.median(factors))


def mean_record(
    runs: list[dict[str, Any]], finer: Dataset | None = None, factor: float = 1.0
) -> dict[str, Any]:
    """How a mean was trained. It knows contact's pressure if all of its runs do."""
    record: dict[str, Any] = {"mean_of": runs}
    if finer is not None:
        record["finer"] = {"dataset_sha256": finer.dataset_sha256, "factor": factor}
    if all("contact" in run for run in runs):
        record["contact"] = runs[0]["contact"]
    return record


def write_mean(
    run_dirs: list[Path], dataset: Dataset, finer: Dataset | None, out: Path, name: str | None
) -> dict[str, Any]:
    """Write the mean of the runs' networks to ``out``; returns its test errors.

    All of them must have learnt ``dataset``; ``finer`` puts the mean right, see `fitted_factor`.
    """
    if len(run_dirs) < 2:
        raise RunError("a mean is of two runs or more: use `export` for one")
    checkpoints = [Checkpoint.load(run) for run in run_dirs]
    for run, checkpoint in zip(run_dirs, checkpoints, strict=True):
        if checkpoint.served.dataset_sha256 != dataset.dataset_sha256:
            raise RunError(f"{run} was trained on another dataset than {dataset.directory}")
    if finer is not None and finer.atlas_hash != dataset.atlas_hash:
        raise DatasetError(f"{finer.directory}: of another atlas than {dataset.directory}")
    factor = 1.0 if finer is None else fitted_factor(mean_model(checkpoints), finer)
    model = mean_model(checkpoints, factor)
    metrics, _ = measure(model, dataset)
    network = {
        "kind": "mean",
        "of": [TrainConfig(**checkpoint.config).spec.as_json() for checkpoint in checkpoints],
    }
    runs = [training_record(checkpoint, "best") for checkpoint in checkpoints]
    training = mean_record(runs, finer, factor)
    props = properties(checkpoints[0].served, name or out.stem, network, training, metrics)
    write_model(to_onnx(model), props, out)
    return {"model": str(out), "bytes": out.stat().st_size, "factor": factor, "metrics": metrics}
