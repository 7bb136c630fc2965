"""The model of a run as it is exported, and what it answers."""

from __future__ import annotations

import numpy as np
import torch
from torch import nn

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.comparison.unet import ServedModel
from papilla_trainer.config import TrainConfig
from papilla_trainer.map_network import MapSpec, ServedMapModel
from papilla_trainer.maps import F32
from papilla_trainer.tasks import trained_network


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


def spread(indices: int, count: int) -> list[int]:
    """``count`` indices spread evenly over ``range(indices)``."""
    return [int(i) for i in np.unique(np.linspace(0, indices - 1, min(count, indices)).round())]
