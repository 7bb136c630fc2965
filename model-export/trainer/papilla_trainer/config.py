"""The settings of a training run, and how they are applied to PyTorch."""

from __future__ import annotations

import os
import random
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import torch

from papilla_trainer.comparison.unet import NetworkSpec, parse_network
from papilla_trainer.errors import RunError, UsageError
from papilla_trainer.losses import LOSSES
from papilla_trainer.map_network import MapSpec, parse_map_network

PRECISIONS = ("f32", "bf16")
SCHEDULES = ("constant", "cosine")
LOSS_CHOICES = ("auto", *LOSSES)
# A millimetre.
LARGEST_SHIFT_PX = 7


@dataclass(frozen=True)
class TrainConfig:
    """Everything that decides the trained weights, besides the dataset."""

    network: str = "s1-base8"
    epochs: int = 40
    seed: int = 0
    batch: int = 4
    learning_rate: float = 1e-3
    schedule: str = "constant"
    precision: str = "f32"
    validation_presses: int | None = None
    threads: int | None = None
    device: str = "auto"
    loss: str = "auto"
    far_weight: float = 0.2
    train_presses: int | None = None
    dataset_samples: int | None = None
    shift_px: int = 0
    contact: list[str] = field(default_factory=list)
    contact_alone: bool = False
    # Name and hash of the model whose weights are the first; none: random ones.
    start: dict[str, str] | None = None
    pseudo_labels: list[str] = field(default_factory=list)
    pseudo_samples: int | None = None

    def __post_init__(self) -> None:
        if self.shift_px and not isinstance(self.spec, MapSpec):
            raise UsageError("--shift-px is for networks on maps (map-...) alone")
        if self.contact and not isinstance(self.spec, MapSpec):
            raise UsageError("--contact is for networks on maps (map-...) alone")
        if self.contact_alone and not self.contact:
            raise UsageError("--contact-alone: give contact's pressure by --contact")
        if self.contact_alone and self.pseudo_labels:
            raise UsageError(
                "--contact-alone: not with --pseudo-labels, which are of FE's pressure"
            )
        if self.pseudo_labels and not isinstance(self.spec, MapSpec):
            raise UsageError("--pseudo-labels is for networks on maps (map-...) alone")
        if self.pseudo_samples is not None and (self.pseudo_samples < 1 or not self.pseudo_labels):
            raise UsageError(
                f"--pseudo-samples {self.pseudo_samples}: at least 1, with --pseudo-labels"
            )
        if not 0 <= self.shift_px <= LARGEST_SHIFT_PX:
            raise UsageError(
                f"--shift-px must lie between 0 and {LARGEST_SHIFT_PX}, not {self.shift_px}: "
                "further away the finger is another"
            )
        if self.loss not in LOSS_CHOICES or self.far_weight < 0.0:
            raise UsageError(f"--loss {self.loss} --far-weight {self.far_weight}: not a loss")
        if self.train_presses is not None and self.train_presses < 2:
            raise UsageError("--train-presses must be at least 2")
        if self.dataset_samples is not None and self.dataset_samples < 1:
            raise UsageError(f"--dataset-samples must be at least 1, not {self.dataset_samples}")
        for name, least in (("epochs", 1), ("batch", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise UsageError(f"--{name} must be at least {least}, not {getattr(self, name)}")
        if not 0.0 < self.learning_rate < 1.0:
            raise UsageError(f"--learning-rate must lie between 0 and 1, not {self.learning_rate}")
        if self.threads is not None and self.threads < 1:
            raise UsageError(f"--threads must be at least 1, not {self.threads}")

    @property
    def spec(self) -> NetworkSpec | MapSpec:
        """The network asked for."""
        if self.network.startswith("map-"):
            return parse_map_network(self.network)
        return parse_network(self.network)

    @property
    def loss_name(self) -> str:
        """The loss in use: the U-Net paper's for its network, else what models are judged by."""
        if self.loss != "auto":
            return self.loss
        return "mse" if isinstance(self.spec, NetworkSpec) else "relative"

    def validation_count(self, train_presses: int) -> int:
        """How many training indentations to set aside: as asked, else a tenth (at least one)."""
        if self.validation_presses is not None:
            return self.validation_presses
        return max(1, round(train_presses / 10)) if train_presses > 1 else 0

    def as_json(self) -> dict[str, Any]:
        """Plain values, for the checkpoint and the metadata."""
        return asdict(self)

    def require_same(self, earlier: dict[str, Any]) -> None:
        """Refuse to resume a run whose weights came from other settings.

        More epochs are welcome where the learning rate does not depend on their number; threads
        and device may differ (the sums then round otherwise, and equality to the last bit goes).
        """
        free = {"threads", "device"} | ({"epochs"} if self.schedule == "constant" else set())
        ours = self.as_json()
        # A setting that an older run does not know had its default.
        theirs = {**TrainConfig().as_json(), **earlier}
        differing = [
            f"{key} was {theirs[key]}, now {value}"
            for key, value in ours.items()
            if key not in free and theirs[key] != value
        ]
        if differing:
            raise RunError(
                "the run there was made with other settings ("
                + "; ".join(differing)
                + "): give the same ones, or another --out"
            )


def pick_device(name: str) -> torch.device:
    """``auto`` is the first CUDA device where there is one, else the CPU."""
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    if name.startswith("cuda") and not torch.cuda.is_available():
        raise UsageError(f"--device {name}: PyTorch sees no CUDA device here; use --device cpu")
    try:
        return torch.device(name)
    except RuntimeError as error:
        raise UsageError(f"--device {name}: not a device that PyTorch knows") from error


def make_deterministic(seed: int, threads: int | None) -> int:
    """Fix seeds, thread count and algorithms; returns the threads in use.

    The same seed on the same kind of CPU with as many threads gives the same weights, bit for bit.
    """
    # cuBLAS reads this when it first starts; without it a deterministic CUDA run is refused.
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    count = threads or available_cpus()
    torch.set_num_threads(count)
    torch.use_deterministic_algorithms(True)
    # Filling fresh buffers guards against reading uninitialised memory, which nothing here does.
    torch.utils.deterministic.fill_uninitialized_memory = False
    torch.backends.cudnn.benchmark = False
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002 (libraries may draw from the global one)
    torch.manual_seed(seed)
    return count


def available_cpus() -> int:
    """The CPUs that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
