"""The mean of several runs' networks as one model: what each errs by itself partly cancels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from torch import Tensor, nn

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import RunError
from papilla_trainer.evaluation import measure, served_model
from papilla_trainer.export import properties, to_onnx, training_record, write_model


class MeanModel(nn.Module):
    """``[N, 1, 224, 224]`` Pa to the mean of what the models answer, J/m3."""

    def __init__(self, models: list[nn.Module]) -> None:
        super().__init__()
        self.models = nn.ModuleList(models)

    def forward(self, pressure_pa: Tensor) -> Tensor:
        """As each of the models."""
        first, *others = self.models
        total: Tensor = first(pressure_pa)
        for model in others:
            total = total + model(pressure_pa)
        return total * (1.0 / len(self.models))


def mean_model(checkpoints: list[Checkpoint]) -> nn.Module:
    """The model as it is exported, on the CPU."""
    return MeanModel([served_model(checkpoint) for checkpoint in checkpoints]).eval()


def mean_record(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """How a mean was trained. It knows contact's pressure if all of its runs do."""
    record: dict[str, Any] = {"mean_of": runs}
    if all("contact" in run for run in runs):
        record["contact"] = runs[0]["contact"]
    return record


def write_mean(
    run_dirs: list[Path], dataset: Dataset, out: Path, name: str | None
) -> dict[str, Any]:
    """Write the mean of the runs' networks to ``out``; returns its test errors.

    All of them must have learnt ``dataset``.
    """
    if len(run_dirs) < 2:
        raise RunError("a mean is of two runs or more: use `export` for one")
    checkpoints = [Checkpoint.load(run) for run in run_dirs]
    for run, checkpoint in zip(run_dirs, checkpoints, strict=True):
        if checkpoint.served.dataset_sha256 != dataset.dataset_sha256:
            raise RunError(f"{run} was trained on another dataset than {dataset.directory}")
    model = mean_model(checkpoints)
    metrics, _ = measure(model, dataset)
    network = {
        "kind": "mean",
        "of": [TrainConfig(**checkpoint.config).spec.as_json() for checkpoint in checkpoints],
    }
    training = mean_record([training_record(checkpoint, "best") for checkpoint in checkpoints])
    props = properties(checkpoints[0].served, name or out.stem, network, training, metrics)
    write_model(to_onnx(model), props, out)
    return {"model": str(out), "bytes": out.stat().st_size, "metrics": metrics}
