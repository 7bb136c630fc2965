"""Measures a run on the held-out indentations and writes what it found beside the checkpoint."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.comparison.unet import ServedModel
from papilla_trainer.config import TrainConfig, make_deterministic
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import RunError
from papilla_trainer.files import write_json
from papilla_trainer.map_network import MapSpec, ServedMapModel
from papilla_trainer.metrics import F32, METRICS, evaluate, summarise
from papilla_trainer.report import write_csv
from papilla_trainer.tasks import trained_network

METRICS_FILE = "metrics.json"
SAMPLES_FILE = "metrics.csv"


def served_model(checkpoint: Checkpoint, weights: str = "best") -> nn.Module:
    """The model as it is exported, on the CPU; ``weights`` is ``best`` or ``last``."""
    spec = TrainConfig(**checkpoint.config).spec
    chosen = checkpoint.best_model if weights == "best" else checkpoint.model
    network, served = trained_network(spec, chosen), checkpoint.served
    if isinstance(spec, MapSpec):
        return ServedMapModel(network, served.mask.float()).eval()
    model = ServedModel(
        network, served.mask.float(), served.pressure_max_pa, served.sed_max_j_per_m3
    )
    return model.eval()


def chosen_epoch(checkpoint: Checkpoint, weights: str) -> int:
    """The epoch whose weights ``best`` or ``last`` names."""
    return checkpoint.best_epoch if weights == "best" else checkpoint.epoch


@torch.no_grad()
def predict(model: nn.Module, pressure_pa: F32) -> F32:
    """``[B, 224, 224]`` Pa to ``[B, 224, 224]`` J/m3."""
    inputs = (
        torch.from_numpy(pressure_pa).unsqueeze(1).contiguous(memory_format=torch.channels_last)
    )
    output: F32 = model.to(memory_format=torch.channels_last)(inputs).squeeze(1).numpy()
    return output


def evaluate_run(run_dir: Path, dataset: Dataset, weights: str = "best") -> dict[str, Any]:
    """Errors on the test indentations; writes ``metrics.json`` and, per sample, ``metrics.csv``."""
    checkpoint = Checkpoint.load(run_dir)
    if checkpoint.served.dataset_sha256 != dataset.dataset_sha256:
        raise RunError(f"{run_dir} was trained on another dataset than {dataset.directory}")
    # The run's own thread count: another one sums in another order, and the last bits differ.
    config = TrainConfig(**checkpoint.config)
    make_deterministic(config.seed, config.threads)
    metrics, rows = measure(served_model(checkpoint, weights), dataset)
    metrics |= {"weights": weights, "epoch": chosen_epoch(checkpoint, weights)}
    write_csv(run_dir / SAMPLES_FILE, rows)
    write_json(run_dir / METRICS_FILE, metrics)
    return metrics


def measure(
    model: nn.Module, dataset: Dataset, ids: list[int] | None = None
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Errors through the whole graph on test indentations (or ``ids``): summary, sample rows."""
    maps = dataset.load(dataset.test_ids if ids is None else ids)
    mask = dataset.interface.mask()
    results = evaluate(lambda p: predict(model, p), maps.pressure_pa, maps.sed_j_per_m3, mask)
    rows = [
        {
            "press": int(press),
            "depth_mm": round(float(depth), 4),
            "pitch_deg": dataset.presses[int(press)].pitch_deg,
            "roll_deg": dataset.presses[int(press)].roll_deg,
            "sed_max_j_per_m3": float(truth.max()),
            **(sample or dict.fromkeys(METRICS, float("nan"))),
        }
        for press, depth, truth, sample in zip(
            maps.press_id, maps.depth_mm, maps.sed_j_per_m3, results, strict=True
        )
    ]
    measured = [sample for sample in results if sample is not None]
    metrics: dict[str, Any] = {
        "split": "test",
        "presses": len(np.unique(maps.press_id)),
        "samples": len(measured),
        "samples_without_sed": len(results) - len(measured),
        **summarise(measured),
    }
    return metrics, rows


def read_metrics(run_dir: Path, checkpoint: Checkpoint, weights: str) -> dict[str, Any]:
    """The metrics of exactly these weights, or an error that says how to get them."""
    path = run_dir / METRICS_FILE
    advice = f"run `python -m papilla_trainer evaluate {run_dir} --dataset DIR` first"
    try:
        metrics: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunError(f"{path}: no readable metrics ({error}); {advice}") from error
    if metrics.get("epoch") != chosen_epoch(checkpoint, weights):
        raise RunError(
            f"{path} was measured at epoch {metrics.get('epoch')}, the weights '{weights}' are of "
            f"epoch {chosen_epoch(checkpoint, weights)}; {advice}"
        )
    return metrics


def spread(indices: int, count: int) -> list[int]:
    """``count`` indices spread evenly over ``range(indices)``."""
    return [int(i) for i in np.unique(np.linspace(0, indices - 1, min(count, indices)).round())]
