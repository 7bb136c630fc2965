"""The mean of several runs' networks as one model: what each errs by itself partly cancels.

What they all err by does not: networks learn from many indentations of a coarser mesh. A few of a
finer one tell by which factor its SED is off for the same pressure, and the mean is put right.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor, nn

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError, RunError
from papilla_trainer.export import properties, to_onnx, training_record, write_model
from papilla_trainer.serving import predict, served_model


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


@dataclass(frozen=True)
class Correction:
    """What brings a model's answers closest to the SED of a finer mesh, and what that is worth."""

    dataset_sha256: str
    factor: float
    samples: int
    relative_l2_plain: dict[str, float]
    relative_l2_corrected: dict[str, float]
    """Of each sample with the factor of the others."""


def correction(model: nn.Module, finer: Dataset) -> Correction:
    """From all samples of a finer mesh; of one sample the factor is ``p . t / p . p``.

    The median of them decides, so that no single one does.
    """
    inside = finer.mask() > 0
    pairs = []
    for state in finer.states(finer.train_ids + finer.test_ids):
        t = state.sed_j_per_m3[inside].astype(np.float64)
        p = predict(model, state.pressure_pa[None].copy())[0][inside].astype(np.float64)
        if t.any() and p.any():
            pairs.append((p, t))
    if len(pairs) < 2:
        raise DatasetError(f"{finer.directory}: fewer than two samples with SED: nothing to fit")
    factors = np.array([(p @ t) / (p @ p) for p, t in pairs])
    others = [float(np.median(np.delete(factors, i))) for i in range(len(pairs))]

    def spread(by: list[float]) -> dict[str, float]:
        errors = [
            float(np.linalg.norm(f * p - t) / np.linalg.norm(t))
            for f, (p, t) in zip(by, pairs, strict=True)
        ]
        return {"median": float(np.median(errors)), "p95": float(np.percentile(errors, 95.0))}

    return Correction(
        dataset_sha256=finer.dataset_sha256,
        factor=float(np.median(factors)),
        samples=len(pairs),
        relative_l2_plain=spread([1.0] * len(pairs)),
        relative_l2_corrected=spread(others),
    )


def mean_record(runs: list[dict[str, Any]], finer: Correction | None = None) -> dict[str, Any]:
    """How a mean was trained. It knows contact's pressure if all of its runs do."""
    record: dict[str, Any] = {"mean_of": runs}
    if finer is not None:
        record["finer"] = asdict(finer)
    if all("contact" in run for run in runs):
        record["contact"] = runs[0]["contact"]
    if all(run.get("contact_alone") for run in runs):
        record["contact_alone"] = True
    return record


def write_mean(
    run_dirs: list[Path], dataset: Dataset, finer: Dataset | None, out: Path, name: str | None
) -> dict[str, Any]:
    """Write the mean of the runs' networks to ``out``.

    All of them must have learnt ``dataset``; ``finer`` puts the mean right, see `correction`.
    """
    if len(run_dirs) < 2:
        raise RunError("a mean is of two runs or more: use `export` for one")
    checkpoints = [Checkpoint.load(run) for run in run_dirs]
    for run, checkpoint in zip(run_dirs, checkpoints, strict=True):
        if checkpoint.served.dataset_sha256 != dataset.dataset_sha256:
            raise RunError(f"{run} was trained on another dataset than {dataset.directory}")
    if finer is not None and finer.atlas_hash != dataset.atlas_hash:
        raise DatasetError(f"{finer.directory}: of another atlas than {dataset.directory}")
    found = finer and correction(mean_model(checkpoints), finer)
    model = mean_model(checkpoints, found.factor if found else 1.0)
    network = {
        "kind": "mean",
        "of": [TrainConfig(**checkpoint.config).spec.as_json() for checkpoint in checkpoints],
    }
    runs = [training_record(checkpoint, "best") for checkpoint in checkpoints]
    training = mean_record(runs, found)
    props = properties(checkpoints[0].served, name or out.stem, network, training)
    write_model(to_onnx(model), props, out)
    result: dict[str, Any] = {"model": str(out), "bytes": out.stat().st_size}
    return {**result, "finer": training["finer"]} if found else result
