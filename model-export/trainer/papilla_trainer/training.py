"""The training loop: Adam and a checkpoint after each epoch."""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from papilla_trainer.augment import varied
from papilla_trainer.checkpoint import FILE_NAME, Checkpoint, Served, copy_weights
from papilla_trainer.config import TrainConfig, make_deterministic, pick_device
from papilla_trainer.dataset import Dataset, fewer, validation_split
from papilla_trainer.draw import draw, drawn
from papilla_trainer.errors import RunError, TrainerError
from papilla_trainer.map_network import MapNet
from papilla_trainer.report import write_history
from papilla_trainer.start import Start
from papilla_trainer.tasks import make_task

BEST_LOSS_AT_START = math.inf
_LARGEST_GRADIENT = 1.0


@dataclass
class Progress:
    """Told to the caller: samples done since the last call, or the line of a finished epoch."""

    samples: int = 0
    epoch: dict[str, float] | None = None


Listener = Callable[[Progress], None]
Enough = Callable[[Checkpoint], bool]


class Trainer:
    """One run: build or resume, then ``fit``."""

    def __init__(
        self,
        dataset: Dataset,
        config: TrainConfig,
        run_dir: Path,
        *,
        resume: bool = False,
        start: Start | None = None,
    ) -> None:
        exists = (run_dir / FILE_NAME).is_file()
        if exists and not resume:
            raise RunError(
                f"{run_dir} already holds a run: add --resume to go on with it, "
                "or give another --out"
            )
        self.config = config
        self.run_dir = run_dir
        self.device = pick_device(config.device)
        threads = make_deterministic(config.seed, config.threads)
        count = config.validation_count(len(dataset.train_ids))
        fit_ids, validation_ids = validation_split(dataset.train_ids, count, config.seed)
        fit_ids = fewer(fit_ids, config.train_presses, config.seed)
        task = make_task(dataset, config, fit_ids, validation_ids, self.device)
        self.network, self.loss = task.network, task.loss
        if start is not None:
            start.give(self.network, config.network)
        self.fit_samples, self.validation = task.fit, task.validation
        self.most = task.fit.most(config)
        self.epoch_samples = drawn(task.fit.source, self.most)
        self.on_pixels = isinstance(self.network, MapNet)
        self.optimizer = torch.optim.Adam(
            self.network.parameters(), lr=config.learning_rate, fused=True
        )
        self.state = Checkpoint(
            config=config.as_json(),
            served=Served.of(dataset),
            splits={"fit": fit_ids, "validation": validation_ids, "test": dataset.test_ids},
            epoch=0,
            model=copy_weights(self.network.state_dict()),
            optimizer=self.optimizer.state_dict(),
            best_epoch=0,
            best_loss=BEST_LOSS_AT_START,
            best_model=copy_weights(self.network.state_dict()),
            environment=_environment(self.device, threads),
        )
        if exists:
            self._resume()

    def fit(
        self, listener: Listener = lambda _: None, enough: Enough = lambda _: False
    ) -> Checkpoint:
        """Train up to the epochs asked for, or until the last checkpoint is ``enough``; returns it.

        ``processor_seconds`` of an epoch is what the process itself used: on a busy machine less
        than ``seconds``.
        """
        while self.state.epoch < self.config.epochs and not enough(self.state):
            began, processor_began = time.perf_counter(), time.process_time()
            epoch = self.state.epoch + 1
            rate = self._learning_rate(epoch)
            for group in self.optimizer.param_groups:
                group["lr"] = rate
            train_loss = self._train_epoch(epoch, listener)
            validation_loss = self._validate()
            seconds = time.perf_counter() - began
            processor_seconds = time.process_time() - processor_began
            line = {
                "epoch": epoch,
                "train_loss": train_loss,
                "validation_loss": validation_loss,
                "learning_rate": rate,
                "seconds": seconds,
                "processor_seconds": processor_seconds,
                "samples_per_s": self.epoch_samples / seconds,
            }
            self._finish_epoch(line)
            listener(Progress(epoch=line))
        return self.state

    def _train_epoch(self, epoch: int, listener: Listener) -> float:
        self.network.train()
        total = 0.0
        # By seed and epoch alone, so a resumed run sees the same samples.
        generator = torch.Generator().manual_seed(self.config.seed * 1_000_003 + epoch)
        for chosen in self._batches(generator):
            inputs, targets = self.fit_samples.batch(chosen)
            if self.on_pixels:
                inputs, targets = varied(inputs, targets, self.config.shift_px, generator)
            self.optimizer.zero_grad()
            loss = self.loss(self._forward(inputs), targets)
            loss.backward()
            if self.on_pixels:
                # Squares of squares: a first step too far would throw everything away.
                torch.nn.utils.clip_grad_norm_(self.network.parameters(), _LARGEST_GRADIENT)
            self.optimizer.step()
            total += loss.item() * len(chosen)
            listener(Progress(samples=len(chosen)))
        mean = total / self.epoch_samples
        if not math.isfinite(mean):
            raise TrainerError(
                f"training diverged in epoch {epoch} (loss {mean}); the checkpoint before it is "
                "kept. Try a smaller --learning-rate or --precision f32"
            )
        return mean

    def _batches(self, generator: torch.Generator) -> tuple[Tensor, ...]:
        order = draw(self.fit_samples.source, self.most, generator)
        return order.split(self.config.batch)

    def _forward(self, inputs: Tensor) -> Tensor:
        bf16 = self.config.precision == "bf16"
        with torch.autocast(self.device.type, dtype=torch.bfloat16, enabled=bf16):
            output: Tensor = self.network(inputs.contiguous(memory_format=torch.channels_last))
        return output.float()

    @torch.no_grad()
    def _validate(self) -> float:
        if self.validation is None:
            return math.nan
        self.network.eval()
        total = 0.0
        for chosen in torch.arange(len(self.validation)).split(self.config.batch):
            inputs, targets = self.validation.batch(chosen)
            loss = self.loss(self._forward(inputs), targets)
            total += loss.item() * len(chosen)
        return total / len(self.validation)

    def _learning_rate(self, epoch: int) -> float:
        if self.config.schedule == "constant":
            return self.config.learning_rate
        done = (epoch - 1) / self.config.epochs
        return self.config.learning_rate * 0.5 * (1.0 + math.cos(math.pi * done))

    def _finish_epoch(self, line: dict[str, float]) -> None:
        state = self.state
        state.epoch = int(line["epoch"])
        state.model = copy_weights(self.network.state_dict())
        state.optimizer = self.optimizer.state_dict()
        loss = line["validation_loss"]
        # Without validation indentations there is nothing to choose by: the last epoch is the best.
        if math.isnan(loss) or loss < state.best_loss:
            state.best_epoch, state.best_loss = state.epoch, loss
            state.best_model = state.model
        state.history = [*state.history, line]
        state.seconds += line["seconds"]
        state.rng_torch = torch.get_rng_state()
        state.config = self.config.as_json()
        state.save(self.run_dir)
        write_history(self.run_dir, state.history)

    def _resume(self) -> None:
        earlier = Checkpoint.load(self.run_dir)
        self.config.require_same(earlier.config)
        if earlier.served.dataset_sha256 != self.state.served.dataset_sha256:
            raise RunError(
                f"{self.run_dir} was trained on another dataset "
                f"({earlier.served.dataset_sha256[:12]}...): give that one, or another --out"
            )
        if earlier.splits != self.state.splits:
            raise RunError(f"{self.run_dir} was trained on another split of the presses")
        self.network.load_state_dict(earlier.model)
        self.optimizer.load_state_dict(earlier.optimizer)
        torch.set_rng_state(earlier.rng_torch)
        earlier.environment = self.state.environment
        self.state = earlier


def _environment(device: torch.device, threads: int) -> dict[str, Any]:
    name = torch.cuda.get_device_name(device) if device.type == "cuda" else platform.machine()
    return {
        "torch": str(torch.__version__),
        "python": platform.python_version(),
        "device": f"{device.type} ({name})",
        "threads": threads,
    }
