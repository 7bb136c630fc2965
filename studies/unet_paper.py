#!/usr/bin/env python3
"""The U-Net paper's own experiment: its network, trained on a plate's states alone.

    python studies/unet_paper.py             trains what is not trained yet, then writes the report
    python studies/unet_paper.py train       trains alone (a stopped run goes on at its last epoch)
    python studies/unet_paper.py report      measures the last checkpoints and writes the report
"""

import argparse
import dataclasses
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import torch

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "model-export/trainer")]

from papilla_trainer.checkpoint import FILE_NAME, Checkpoint  # noqa: E402
from papilla_trainer.comparison.split_by_sample import SplitBySample  # noqa: E402
from papilla_trainer.config import TrainConfig  # noqa: E402
from papilla_trainer.dataset import Dataset  # noqa: E402
from papilla_trainer.files import write_atomic  # noqa: E402
from papilla_trainer.maps import Store  # noqa: E402
from papilla_trainer.training import Trainer  # noqa: E402

# More epochs than any budget of processor time allows.
ENDLESS = 100_000
STEPS_TO_TIME = 12
PAPER = {"loss": "mse", "learning_rate": 1e-3, "schedule": "constant", "batch": 4}
OURS = {"loss": "relative", "learning_rate": 3e-3, "schedule": "cosine", "batch": 8, "shift_px": 3}
NETWORKS = {
    "s1-base16": {"network": "s1-base16", **PAPER},
    "s1-base32": {"network": "s1-base32", **PAPER},
    "s1-base64": {"network": "s1-base64", **PAPER},
    "nano": {"network": "map-c4-k3-r32-h4", **OURS},
    "small": {"network": "map-c6-k3-r32-h8", **OURS},
}
SPLITS = ("simulation", "sample")
DEFAULT_RUNS = ["s1-base16/simulation", "s1-base16/sample", "small/simulation", "nano/simulation"]
SEED = 0


class Run:
    """One network on one split."""

    def __init__(self, name, out):
        network, _, split = name.partition("/")
        if network not in NETWORKS or split not in SPLITS:
            sys.exit(f"error: no run {name!r}: NETWORK/SPLIT, of {', '.join(NETWORKS)} and {', '.join(SPLITS)}")
        self.name, self.network, self.split = name, network, split
        self.folder = out / network / split

    def checkpoint(self):
        """The last checkpoint, none if nothing was trained yet."""
        return Checkpoint.load(self.folder) if (self.folder / FILE_NAME).is_file() else None

    def dataset(self, whole):
        return SplitBySample(whole, SEED) if self.split == "sample" else whole


def processor_seconds(state):
    return sum(line["processor_seconds"] for line in state.history)


def settings(run, epochs):
    return TrainConfig(
        **NETWORKS[run.network], epochs=epochs, seed=SEED, validation_presses=0, threads=1, device="cpu"
    )


def epochs_within(run, whole, seconds):
    """How many epochs a budget of processor time allows: of a schedule that has to know its end."""
    if NETWORKS[run.network]["schedule"] == "constant":
        return ENDLESS
    state = run.checkpoint()
    if state is not None:
        return state.config["epochs"]
    config = settings(run, 1)
    trainer = Trainer(run.dataset(whole), config, run.folder)
    samples, began = 0, 0.0
    for step in range(STEPS_TO_TIME + 2):
        if step == 2:  # the first steps build what the others reuse
            samples, began = 0, time.process_time()
        chosen = torch.arange(config.batch) + config.batch * step
        inputs, targets = trainer.fit_samples.batch(chosen)
        trainer.loss(trainer.network(inputs.contiguous(memory_format=torch.channels_last)), targets).backward()
        trainer.optimizer.step()
        samples += config.batch
    each = (time.process_time() - began) / samples
    return max(1, round(seconds / (each * trainer.epoch_samples)))


@torch.no_grad()
def held_out_loss(trainer, dataset, batch=8):
    """Loss of the states for testing, after an epoch. Nothing is chosen by it."""
    from papilla_trainer.tasks import Samples

    paper = trainer.config.loss_name == "mse"
    units = (dataset.pressure_max_pa, dataset.sed_max_j_per_m3) if paper else (1.0, 1.0)
    samples = Samples(dataset.states(dataset.test_ids), trainer.device, units)
    trainer.network.eval()
    total = 0.0
    for chosen in torch.arange(len(samples)).split(batch):
        inputs, targets = samples.batch(chosen)
        found = trainer.network(inputs.contiguous(memory_format=torch.channels_last))
        total += trainer.loss(found, targets).item() * len(chosen)
    return total / len(samples)


def train(run, whole, minutes, until):
    """Train until the budget of processor time is used up, or the clock says so."""
    budget = 60.0 * minutes
    dataset = run.dataset(whole)
    trainer = Trainer(dataset, settings(run, epochs_within(run, whole, budget)), run.folder, resume=True)
    endless = trainer.config.epochs == ENDLESS
    curve_file = run.folder / "held-out.json"
    curve = json.loads(curve_file.read_text()) if curve_file.is_file() else []
    curve = [line for line in curve if line["epoch"] <= trainer.state.epoch]

    def enough(state):
        return (until is not None and time.time() > until) or (endless and processor_seconds(state) >= budget)

    def listen(progress):
        line = progress.epoch
        if line is None:
            return
        curve.append({"epoch": line["epoch"], "loss": held_out_loss(trainer, dataset)})
        write_atomic(curve_file, json.dumps(curve).encode())
        used = processor_seconds(trainer.state)
        whole_time = used / line["epoch"] * trainer.config.epochs if not endless else budget
        left = (whole_time - used) * line["seconds"] / line["processor_seconds"] / 60.0
        print(
            f"{run.name}: epoch {line['epoch']}, loss {line['train_loss']:.3e}, held out {curve[-1]['loss']:.3e}; "
            f"{used / 60:.1f} of {whole_time / 60:.0f} min of processor time, about {max(left, 0):.0f} min left",
            file=sys.stderr,
            flush=True,
        )

    trainer.fit(listen, enough)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("all", "train", "report"), nargs="?", default="all")
    parser.add_argument("--runs", nargs="+", default=DEFAULT_RUNS, metavar="NETWORK/SPLIT")
    parser.add_argument("--minutes", type=float, default=30.0, help="processor time of each run (30)")
    parser.add_argument("--until", metavar="HH:MM", help="train no longer than this time of today")
    parser.add_argument("--jobs", type=int, default=1, help="runs that are trained at once (1)")
    parser.add_argument("--dataset", type=Path, default=ROOT / "data/s1-graded")
    parser.add_argument("--maps", type=Path, help="where the maps of the dataset are (as of papilla_trainer)")
    parser.add_argument("--out", type=Path, default=ROOT / "out/unet-paper", help="the runs (out/unet-paper)")
    options = parser.parse_args()
    whole = Dataset(options.dataset, Store(options.maps))
    runs = [Run(name, options.out) for name in options.runs]
    until = None
    if options.until:
        clock = time.strptime(options.until, "%H:%M")
        now = time.localtime()
        until = time.mktime((*now[:3], clock.tm_hour, clock.tm_min, 0, 0, 0, -1))
    if options.what != "report":
        for run in runs:
            train(run, whole, options.minutes, until)


if __name__ == "__main__":
    main()
