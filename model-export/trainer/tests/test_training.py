from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.cli import main
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.draw import draw, drawn
from papilla_trainer.errors import RunError
from papilla_trainer.training import Trainer

LOSSES = ("epoch", "train_loss", "validation_loss", "learning_rate")


def assert_same(a: Checkpoint, b: Checkpoint) -> None:
    """Equal to the last bit: weights, optimiser and losses (times differ, of course)."""
    assert a.epoch == b.epoch
    assert a.best_epoch == b.best_epoch
    for ours, theirs in ((a.model, b.model), (a.best_model, b.best_model)):
        assert all(torch.equal(ours[name], theirs[name]) for name in ours)
    for index, state in a.optimizer["state"].items():
        for name in ("exp_avg", "exp_avg_sq", "step"):
            assert torch.equal(state[name], b.optimizer["state"][index][name])
    for ours, theirs in zip(a.history, b.history, strict=True):
        assert [ours[key] for key in LOSSES] == [theirs[key] for key in LOSSES]


def test_the_loss_goes_down(finished: Checkpoint, config: TrainConfig) -> None:
    losses = [line["train_loss"] for line in finished.history]
    assert len(losses) == config.epochs
    assert losses[-1] < 0.7 * losses[0]
    assert finished.best_epoch >= 1
    assert finished.best_loss == min(line["validation_loss"] for line in finished.history)


def test_the_same_seed_gives_the_same_weights(
    tiny: Dataset, config: TrainConfig, finished: Checkpoint, tmp_path: Path
) -> None:
    assert_same(Trainer(tiny, config, tmp_path / "again").fit(), finished)
    other = dataclasses.replace(config, seed=8, epochs=1)
    another = Trainer(tiny, other, tmp_path / "other").fit()
    assert another.history[0]["train_loss"] != finished.history[0]["train_loss"]


def test_killed_and_resumed_equals_straight_through(
    tiny: Dataset, config: TrainConfig, finished: Checkpoint, tmp_path: Path
) -> None:
    out = tmp_path / "killed"
    command = [
        *("train", "--dataset", str(tiny.directory), "--network", config.network),
        *("--out", str(out), "--epochs", str(config.epochs), "--seed", str(config.seed)),
        *("--batch", str(config.batch), "--threads", "1", "--device", "cpu"),
        *("--resume", "--json"),
    ]
    package = Path(__file__).resolve().parents[1]
    process = subprocess.Popen(
        [sys.executable, "-m", "papilla_trainer", *command],
        env={**os.environ, "PYTHONPATH": str(package)},
        stdout=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 600
    try:
        while not (out / "checkpoint.pt").exists() and process.poll() is None:
            assert time.monotonic() < deadline, "no checkpoint within ten minutes"
            time.sleep(0.01)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert 1 <= Checkpoint.load(out).epoch <= config.epochs
    assert main(command) == 0
    assert_same(Checkpoint.load(out), finished)


def test_a_run_stopped_early_goes_on_to_more_epochs(
    tiny: Dataset, config: TrainConfig, finished: Checkpoint, tmp_path: Path
) -> None:
    short = dataclasses.replace(config, epochs=2)
    assert Trainer(tiny, short, tmp_path / "run").fit().epoch == 2
    longer = Trainer(tiny, config, tmp_path / "run", resume=True)
    assert longer.state.epoch == 2
    assert_same(longer.fit(), finished)


def test_a_run_is_not_overwritten_or_mixed(
    tiny: Dataset, config: TrainConfig, run_dir: Path
) -> None:
    with pytest.raises(RunError, match="--resume"):
        Trainer(tiny, config, run_dir)
    with pytest.raises(RunError, match="batch was 1, now 2"):
        Trainer(tiny, dataclasses.replace(config, batch=2), run_dir, resume=True)
    cosine = dataclasses.replace(config, schedule="cosine")
    with pytest.raises(RunError, match="schedule"):
        Trainer(tiny, cosine, run_dir, resume=True)


def test_training_never_sees_a_test_press(
    tiny: Dataset, config: TrainConfig, finished: Checkpoint, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    loaded: list[int] = []
    states = tiny.states

    def spy(ids: list[int]) -> object:
        loaded.extend(ids)
        return states(ids)

    monkeypatch.setattr(tiny, "states", spy)
    Trainer(tiny, dataclasses.replace(config, epochs=1), tmp_path / "run").fit()
    assert sorted(loaded) == sorted(tiny.train_ids)
    assert finished.splits["test"] == tiny.test_ids


def test_mixed_precision_trains_too(tiny: Dataset, config: TrainConfig, tmp_path: Path) -> None:
    bf16 = dataclasses.replace(config, precision="bf16", epochs=2)
    history = Trainer(tiny, bf16, tmp_path / "bf16").fit().history
    assert history[-1]["train_loss"] < history[0]["train_loss"]


def test_smoke_on_the_shipped_dataset(
    shipped: Dataset, config: TrainConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped, "train_ids", shipped.train_ids[:4])
    small = dataclasses.replace(config, network="s1-base4", epochs=4, threads=2)
    history = Trainer(shipped, small, tmp_path / "run").fit().history
    assert history[-1]["train_loss"] < history[0]["train_loss"]


def test_of_a_large_dataset_an_epoch_sees_a_part_and_of_a_small_one_all() -> None:
    source = torch.tensor([0] * 50 + [1] * 3)
    assert drawn(source, None) == 53
    assert drawn(source, 5) == 8
    generator = torch.Generator().manual_seed(1)
    assert sorted(draw(source, None, generator).tolist()) == list(range(53))
    seen: set[int] = set()
    for _ in range(100):
        chosen = draw(source, 5, generator).tolist()
        assert len(chosen) == len(set(chosen)) == 8
        assert {50, 51, 52} <= set(chosen)
        seen |= set(chosen)
    assert len(seen) == 53
