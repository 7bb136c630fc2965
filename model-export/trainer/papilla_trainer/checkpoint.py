"""The one file of a run from which it resumes and from which a model is exported."""

from __future__ import annotations

import io
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import RunError
from papilla_trainer.files import write_atomic

FILE_NAME = "checkpoint.pt"
FORMAT = 1

Weights = dict[str, Tensor]


@dataclass(frozen=True)
class Served:
    """What the exported graph needs from the dataset, so that export works without it."""

    mask: Tensor
    pressure_max_pa: float
    sed_max_j_per_m3: float
    atlas_hash: str
    effects: list[str]
    dataset_sha256: str
    # The hashes of several datasets that were trained on together.
    datasets: list[str] = field(default_factory=list)
    # Hash of dimensions and tissues of the finger; None: the default one.
    finger_sha256: str | None = None

    @staticmethod
    def of(dataset: Dataset) -> Served:
        """Mask (uint8 ``[224, 224]``), scales and identities of a dataset."""
        return Served(
            mask=torch.from_numpy(dataset.mask()).to(torch.uint8),
            pressure_max_pa=dataset.pressure_max_pa,
            sed_max_j_per_m3=dataset.sed_max_j_per_m3,
            atlas_hash=dataset.atlas_hash,
            effects=list(dataset.effects),
            dataset_sha256=dataset.dataset_sha256,
            datasets=dataset.hashes,
            finger_sha256=dataset.finger_sha256,
        )


@dataclass
class Checkpoint:
    """The state of a run after a whole number of epochs."""

    config: dict[str, Any]
    served: Served
    splits: dict[str, list[int]]
    epoch: int
    model: Weights
    optimizer: dict[str, Any]
    best_epoch: int
    best_loss: float
    best_model: Weights
    history: list[dict[str, float]] = field(default_factory=list)
    seconds: float = 0.0
    environment: dict[str, Any] = field(default_factory=dict)
    rng_torch: Tensor = field(default_factory=torch.get_rng_state)

    def save(self, run_dir: Path) -> None:
        """Write whole or not at all: a kill leaves the checkpoint before."""
        state = {f: getattr(self, f) for f in self.__dataclass_fields__}
        state["served"] = asdict(self.served)
        buffer = io.BytesIO()
        torch.save({"format": FORMAT, **state}, buffer)
        write_atomic(run_dir / FILE_NAME, buffer.getvalue())

    @staticmethod
    def load(run_dir: Path) -> Checkpoint:
        """Read a run's checkpoint (tensors and plain values only, nothing is executed)."""
        path = run_dir / FILE_NAME
        if not path.is_file():
            raise RunError(f"{path} does not exist: is {run_dir} the --out of a training run?")
        try:
            state = torch.load(path, map_location="cpu", weights_only=True)
        except Exception as error:  # torch raises many kinds for a damaged file
            raise RunError(
                f"{path}: not a readable checkpoint ({str(error).splitlines()[0]})"
            ) from error
        if not isinstance(state, dict) or state.pop("format", None) != FORMAT:
            raise RunError(f"{path}: not a checkpoint of format {FORMAT}")
        try:
            state["served"] = Served(**state["served"])
            return Checkpoint(**state)
        except (KeyError, TypeError) as error:
            raise RunError(f"{path}: the checkpoint lacks an entry ({error})") from error


def copy_weights(weights: Weights) -> Weights:
    """A copy on the CPU, in plain layout, that later steps do not change."""
    return {
        name: value.detach().to("cpu", copy=True).contiguous() for name, value in weights.items()
    }
