#!/usr/bin/env python3
"""What a third and a fourth state of a simulation are worth to a network.

    python studies/states.py            trains what is not trained yet, then measures and writes the table

A simulation of a press stores two states, at half of its depth and at the whole. More cost less than a
further simulation does: by the counts of studies/reports/guide.md a third one 35 % of a simulation with two,
a third and a fourth together 70 %. Here `nano` learns from the plates of data/s1-graded, of which eight
states are stored, and keeps some of them. All trainings see as many samples. Each is judged by all states of
the plates that are set aside. Once the plates are as many for any number of states, and once the processor
time is: then more states mean fewer plates. As in the campaigns of the shipped networks, each plate has a
deepest state of its own, drawn by lot, and the others are evenly spaced above it.

A run that was stopped goes on at its last whole epoch. Each has one thread. Needs the trainer's requirements,
and fe-datagen, which draws maps: FE_DATAGEN or PATH. Run it in the root of the repository.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "model-export/trainer")]

from papilla_trainer.comparison.measures import Zones, measure  # noqa: E402
from papilla_trainer.config import TrainConfig  # noqa: E402
from papilla_trainer.dataset import Dataset, Press, State, View  # noqa: E402
from papilla_trainer.maps import Store  # noqa: E402
from papilla_trainer.serving import predict, served_model  # noqa: E402
from papilla_trainer.training import Trainer  # noqa: E402

PLATES = ROOT / "data/s1-graded"
# The states are 0.25, 0.5, ..., 2 mm deep. A plate's deepest one is one of these, counted from 1.
DEEPEST = (2, 4, 6, 8)
# What each state beyond the second costs: a simulation with two is 1.
ONE_MORE = 0.35
STATES = (2, 3, 4)
ALL = 100
SAMPLES = 20_000
SETTINGS = {"network": "map-c4-k3-r32-h4", "loss": "relative", "learning_rate": 3e-3, "schedule": "cosine", "batch": 8, "shift_px": 3}


class Kept(View):
    """So many simulations of a dataset with some of their states. The simulations for testing keep all."""

    def __init__(self, whole: Dataset, simulations: int, states: int, seed: int) -> None:
        super().__init__(whole)
        deepest = np.random.default_rng([seed, 0xDEE9]).choice(DEEPEST, len(whole.train_ids))
        self.kept = {i: kept(states, deepest[k]) for k, i in enumerate(whole.train_ids)}
        lot = np.random.default_rng([seed, 0x57A7]).permutation(len(whole.train_ids))
        # Of two counts the larger has the smaller.
        self.train_ids = sorted(whole.train_ids[i] for i in lot[:simulations])
        few = {i: Press(i, sum(s.state in self.kept[i] for s in whole.states([i]))) for i in self.train_ids}
        self.presses = {**{i: whole.presses[i] for i in whole.test_ids}, **few}

    def cost(self) -> float:
        """Processor time of its simulations, that of ALL with two states being 1."""
        return sum(1.0 + ONE_MORE * (self.presses[i].samples - 2) for i in self.train_ids) / ALL

    def states(self, ids: list[int]) -> list[State]:
        own = set(self.train_ids)
        return [s for s in self.whole.states(ids) if s.press_id not in own or s.state in self.kept[s.press_id]]


def kept(states: int, deepest: int) -> set[int]:
    """Which states are kept: evenly spaced down to the deepest, as far as so many are stored."""
    return {round(deepest * k / states) - 1 for k in range(1, states + 1)} - {-1}


def runs() -> list[tuple[str, int, int]]:
    """Name, simulations, and states of each."""
    fewer = {k: round(ALL / (1.0 + ONE_MORE * (k - 2))) for k in STATES}
    counts = {(count, states) for states in STATES for count in (ALL, fewer[states])}
    return [(f"own-{count}x{states}", count, states) for count, states in sorted(counts, key=lambda of: (of[1], of[0]))]


def errors(trainer: Trainer, whole: Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Relative L2 norm of each state that is set aside, and its depth, mm."""
    model, zones = served_model(trainer.state, "last"), Zones.of(whole)
    states = whole.states(whole.test_ids)
    maps = ((predict(model, state.pressure_pa[None].copy())[0], state.sed_j_per_m3) for state in states)
    found = [measure(map_, truth, zones)["relative_l2"] for map_, truth in maps]
    return np.array(found), np.array([state.depth_mm for state in states])


def measured(whole: Dataset, out: Path, seed: int, name: str, simulations: int, states: int) -> dict:
    note = out / f"{name}-{seed}.json"
    if note.is_file():
        return json.loads(note.read_text())
    view = Kept(whole, simulations, states, seed)
    epochs = round(SAMPLES / sum(view.presses[i].samples for i in view.train_ids))
    config = TrainConfig(**SETTINGS, epochs=epochs, seed=seed, validation_presses=0, threads=1, device="cpu")
    trainer = Trainer(view, config, out / f"{name}-{seed}", resume=True)
    trainer.fit()
    off, depth = errors(trainer, whole)
    parts = {"all": depth > 0, "to_1_mm": depth < 1.01, "deeper": depth > 1.01}
    spread = {key: [float(np.percentile(off[rows], q)) for q in (50, 95)] for key, rows in parts.items()}
    seconds = sum(line["processor_seconds"] for line in trainer.state.history)
    row = {"run": name, "seed": seed, "simulations": simulations, "states": states, "cost": view.cost(), **spread, "processor_s": seconds}
    note.write_text(json.dumps(row) + "\n")
    print(json.dumps(row), file=sys.stderr, flush=True)
    return row


def table(rows: list[dict]) -> str:
    head = ["simulations", "states of each", "processor time of FE, 100 simulations with two states being 1", "seed", "all states: median", "95th percentile", "to 1 mm: median", "deeper: median"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in rows:
        cells = [str(row["simulations"]), str(row["states"]), f"{row['cost']:.2f}", str(row["seed"])]
        cells += [f"{100 * value:.1f} %" for value in (*row["all"], row["to_1_mm"][0], row["deeper"][0])]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "out/states", help="folder of the runs")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="each a training of every kind")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    whole = Dataset(PLATES, Store())
    rows = [measured(whole, options.out, seed, *run) for seed in options.seeds for run in runs()]
    (options.out / "states.md").write_text(table(rows))
    print(table(rows))


if __name__ == "__main__":
    main()
