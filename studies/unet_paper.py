#!/usr/bin/env python3
"""The U-Net paper's own experiment: its network, trained on a plate's states alone.

    python studies/unet_paper.py             trains what is not trained yet, then writes the report
    python studies/unet_paper.py train       trains alone
    python studies/unet_paper.py report      measures the last checkpoints, and writes the tables and
                                             pictures of studies/reports/unet-paper.md

A run that was stopped goes on at its last whole epoch. Each run has one thread; several are trained
at once by as many commands `train`, each with its own --runs. Needs the trainer's requirements, and
fe-datagen, which draws maps: FE_DATAGEN or PATH.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
import torch

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "model-export/trainer")]

from papilla_trainer.checkpoint import FILE_NAME, Checkpoint  # noqa: E402
from papilla_trainer.comparison.measures import Zones, measure  # noqa: E402
from papilla_trainer.comparison.split_by_sample import SplitBySample  # noqa: E402
from papilla_trainer.config import PRECISIONS, TrainConfig  # noqa: E402
from papilla_trainer.dataset import Dataset  # noqa: E402
from papilla_trainer.files import write_atomic  # noqa: E402
from papilla_trainer.maps import Store  # noqa: E402
from papilla_trainer.serving import predict, served_model, spread  # noqa: E402
from papilla_trainer.tasks import Samples  # noqa: E402
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
# Learnt states that are asked again, beside those for testing.
LEARNT = 100
# A pixel of the U-Net's answer depends on pressures no further than this.
SEES_PX = 22
# Splits that kernel regression is judged on, and what is added to the diagonal of its kernel.
DRAWS = 10
RIDGE = 1e-5
# A state spreads toward the nail base if so much of its SED lies there.
SPREADS = 0.05
FIGURES = (
    ("relative_l2", "relative L2"),
    ("peak_error", "peak"),
    ("far_field_relative_l2", "far field"),
    ("nail_base_error", "zone toward the nail base"),
)
# Networks in the picture of maps.
SHOWN = ("s1-base16", "nano")
REPORT = ROOT / "studies/reports/unet-paper.md"
PICTURES = ROOT / "studies/reports/pictures"


class Run:
    """One network on one split."""

    def __init__(self, name, out, precision):
        network, _, split = name.partition("/")
        if network not in NETWORKS or split not in SPLITS:
            sys.exit(f"error: no run {name!r}: NETWORK/SPLIT, of {', '.join(NETWORKS)} and {', '.join(SPLITS)}")
        self.name, self.network, self.split = name, network, split
        self.folder = out / network / split
        self.precision = precision if network.startswith("s1-") else "f32"

    def checkpoint(self):
        """The last checkpoint, none if nothing was trained yet."""
        return Checkpoint.load(self.folder) if (self.folder / FILE_NAME).is_file() else None

    def dataset(self, whole):
        return SplitBySample(whole, SEED) if self.split == "sample" else whole


def processor_seconds(state):
    return sum(line["processor_seconds"] for line in state.history)


def settings(run, epochs):
    given = {**NETWORKS[run.network], "precision": run.precision, "epochs": epochs}
    return TrainConfig(**given, seed=SEED, validation_presses=0, threads=1, device="cpu")


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
        inputs, targets = trainer.fit_samples.batch(chosen % len(trainer.fit_samples))
        trainer.loss(trainer.network(inputs.contiguous(memory_format=torch.channels_last)), targets).backward()
        trainer.optimizer.step()
        samples += config.batch
    each = (time.process_time() - began) / samples
    return max(1, round(seconds / (each * trainer.epoch_samples)))


@torch.no_grad()
def held_out_loss(trainer, dataset, batch=8):
    """Loss of the states for testing, after an epoch. Nothing is chosen by it."""
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


class Answers:
    """What a run's last checkpoint makes of states that it was tested on, and of some it learnt."""

    def __init__(self, run, state, whole, zones):
        self.run, self.state = run, state
        dataset, model = run.dataset(whole), served_model(state, "last")
        self.states = dataset.states(dataset.test_ids)
        self.found = answers_of(model, self.states)
        learnt = dataset.states(dataset.train_ids)
        learnt = [learnt[i] for i in spread(len(learnt), LEARNT)]
        self.errors = errors_of(self.found, self.states, zones)
        self.learnt = errors_of(answers_of(model, learnt), learnt, zones)
        self.history = state.history
        self.held_out = json.loads((run.folder / "held-out.json").read_text())

    @property
    def minutes(self):
        return processor_seconds(self.state) / 60.0


def answers_of(model, states, batch=8):
    pressure = [state.pressure_pa for state in states]
    return np.concatenate([predict(model, np.stack(pressure[i : i + batch])) for i in range(0, len(pressure), batch)])


def errors_of(found, states, zones):
    """``[N]`` of each figure."""
    each = [measure(map_, state.sed_j_per_m3, zones) for map_, state in zip(found, states, strict=True)]
    return {figure: np.array([errors[figure] for errors in each]) for figure in each[0]}


def percent(values, high=95):
    """Median and far percentile."""
    return f"{100 * np.nanmedian(values):.1f} / {100 * np.nanpercentile(values, high):.1f} %"


def table(*rows):
    head, *rest = ([str(cell) for cell in row] for row in rows)
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rest)]


def accuracy_table(all_answers):
    heads = ("network", "split", "epochs", "processor time", *(title for _, title in FIGURES))
    rows = [
        (
            f"`{one.run.network}`",
            f"by {one.run.split}",
            one.state.epoch,
            f"{one.minutes:.1f} min",
            *(percent(one.errors[figure]) for figure, _ in FIGURES),
        )
        for one in all_answers
    ]
    return table(heads, *rows)


def depth_table(all_answers):
    depths = sorted({round(state.depth_mm, 2) for one in all_answers for state in one.states})
    rows = []
    for one in all_answers:
        own = np.array([round(state.depth_mm, 2) for state in one.states])
        cells = (f"{100 * np.median(one.errors['relative_l2'][own == depth]):.1f} %" for depth in depths)
        rows.append((f"`{one.run.network}`", f"by {one.run.split}", *cells))
    return table(("network", "split", *(f"{depth:g} mm" for depth in depths)), *rows)


def gap(one):
    """Error of states for testing over that of learnt states, medians."""
    return np.median(one.errors["relative_l2"]) / np.median(one.learnt["relative_l2"])


def flattery_table(all_answers):
    rows = [
        (
            f"`{one.run.network}`",
            f"by {one.run.split}",
            percent(one.learnt["relative_l2"]),
            percent(one.errors["relative_l2"]),
            f"{gap(one):.2f}",
        )
        for one in all_answers
    ]
    return table(("network", "split", "states that it learnt", "states for testing", "testing / learnt"), *rows)


def flattered_by(all_answers):
    """How much smaller errors by sample look than by simulation, of each network that has both."""
    rows = []
    for network in NETWORKS:
        both = {one.run.split: one for one in all_answers if one.run.network == network}
        if len(both) == len(SPLITS):
            sample, simulation = (both[split] for split in ("sample", "simulation"))
            plain = np.median(sample.errors["relative_l2"]) / np.median(simulation.errors["relative_l2"])
            epochs = f"{sample.state.epoch} and {simulation.state.epoch}"
            rows.append(
                (
                    f"`{network}`",
                    epochs,
                    *(f"{100 * (1 - part):.0f} %" for part in (plain, gap(sample) / gap(simulation))),
                )
            )
    heads = ("network", "epochs by sample and by simulation", "median error for testing is smaller by")
    return table((*heads, "the quotient testing / learnt is smaller by"), *rows)


def draws(whole, split):
    """Rows of states for training and for testing, drawn anew ten times; the first draw is the runs' own."""
    rows = {}
    for row, press in enumerate(whole.drawn.press.tolist()):
        rows.setdefault(press, []).append(row)
    for seed in range(DRAWS):
        if split == "sample":
            own = SplitBySample(whole, seed)
            yield own.train_ids, own.test_ids
            continue
        presses = [*whole.test_ids, *whole.train_ids]
        if seed > 0:
            presses = np.random.default_rng([seed, 0x51B]).permutation(presses).tolist()
        tests = len(whole.test_ids)
        yield [row for i in presses[tests:] for row in rows[i]], [row for i in presses[:tests] for row in rows[i]]


def kernel_errors(train_rows, test_rows, squared, sed):
    """Relative L2 of kernel ridge regression, of each state for testing.

    The square root of SED at a pixel is a sum over learnt states, weighted by a Gaussian of the distance between
    pressures. Its width is the median distance of learnt states.
    """
    kernel = np.exp(squared / (-2.0 * np.median(squared[np.ix_(train_rows, train_rows)])))
    own = kernel[np.ix_(train_rows, train_rows)] + RIDGE * np.eye(len(train_rows))
    weights = np.linalg.solve(own, kernel[np.ix_(train_rows, test_rows)]).astype(np.float32)
    found = np.maximum(weights.T @ np.sqrt(sed[train_rows]), 0.0) ** 2
    return np.linalg.norm(found - sed[test_rows], axis=1) / np.linalg.norm(sed[test_rows], axis=1)


def kernel_table(whole):
    """What a learner that has converged in a second gains by a split by sample."""
    maps, mask = whole.drawn, whole.mask() > 0
    coarse = maps.pressure_pa.reshape(len(maps.press), 56, 4, 56, 4).mean(axis=(2, 4))
    coarse = coarse.reshape(len(coarse), -1).astype(np.float64)
    products = coarse @ coarse.T
    norms = np.diag(products)
    squared = np.maximum(norms[:, None] + norms[None] - 2.0 * products, 0.0)
    sed = maps.sed_j_per_m3[:, mask]
    rows, means = [], []
    for split in SPLITS:
        errors = [kernel_errors(*draw, squared, sed) for draw in draws(whole, split)]
        medians, ends = (np.array([100 * np.percentile(each, at) for each in errors]) for at in (50, 95))
        means.append(medians.mean())
        rows.append((f"by {split}", len(errors), percent(errors[0]), spanned(medians), spanned(ends)))
    rows.append(("the error by sample is smaller by", "", "", f"{100 * (1 - means[1] / means[0]):.0f} %", ""))
    return table(
        ("split", "draws", "relative L2, first draw", "median, of all draws", "95th percentile, of all draws"), *rows
    )


def spanned(values):
    return f"{values.mean():.1f} % ({values.min():.1f} to {values.max():.1f})"


def steps(one):
    """Steps of Adam."""
    samples = round(one.history[0]["samples_per_s"] * one.history[0]["seconds"])
    return one.state.epoch * -(-samples // one.state.config["batch"])


def convergence_table(all_answers):
    rows = []
    for one in all_answers:
        train = [line["train_loss"] for line in one.history]
        held_out = [line["loss"] for line in one.held_out]
        planned = one.state.config["epochs"]
        rows.append(
            (
                f"`{one.run.network}`",
                f"by {one.run.split}",
                f"{one.state.epoch}" + ("" if planned == ENDLESS else f" of {planned}"),
                steps(one),
                f"{train[-1]:.2e}",
                change(train),
                f"{held_out[-1]:.2e}",
                change(held_out),
            )
        )
    heads = ("network", "split", "epochs", "steps of Adam", "training loss", "its change an epoch")
    return table((*heads, "loss of the states for testing", "its change an epoch"), *rows)


def change(losses, epochs=3):
    """Mean change of an epoch over the last ones: from one to the next a loss goes up and down."""
    epochs = min(epochs, len(losses) - 1)
    return f"{100 * ((losses[-1] / losses[-1 - epochs]) ** (1 / epochs) - 1):+.0f} %" if epochs else ""


def reached(pressure_pa):
    """Pixels whose answer can depend on any pressure: 22 pixels around, for the published U-Net."""
    touched = torch.from_numpy((pressure_pa > 0).astype(np.float32))[None, None]
    wide = torch.nn.functional.max_pool2d(touched, 2 * SEES_PX + 1, stride=1, padding=SEES_PX)
    return wide[0, 0].numpy() > 0


def wider(sed, pressure_pa, mask, part=0.1):
    """Area where SED is above a part of its maximum, over that of pressure."""
    areas = [(map_[mask] > part * map_[mask].max()).sum() for map_ in (sed, pressure_pa)]
    return areas[0] / areas[1]


def statement_table(all_answers, zones):
    """Each statement of the paper as numbers: of FE, and of the networks on whole simulations."""
    judged = [one for one in all_answers if one.run.split == "simulation"]
    states = judged[0].states
    truth = [state.sed_j_per_m3 for state in states]
    mask, zone = zones.mask, zones.nail_base
    none = ["" for _ in judged]
    trend = ["1"]
    widths = [np.median([wider(s.sed_j_per_m3, s.pressure_pa, mask) for s in states])]
    for one in judged:
        r = [np.corrcoef(p[mask], t[mask])[0, 1] for p, t in zip(one.found, truth, strict=True)]
        trend.append(f"{np.median(r):.3f} / {np.percentile(r, 5):.3f}")
        widths.append(np.median([wider(p, s.pressure_pa, mask) for p, s in zip(one.found, states, strict=True)]))
    share = np.array([t[zone].sum() / t[mask].sum() for t in truth])
    spreads = np.flatnonzero(share >= SPREADS)
    blind = [truth[i][zone & ~reached(states[i].pressure_pa)].sum() / truth[i][zone].sum() for i in spreads]
    kept = [[one.found[i][zone].sum() / truth[i][zone].sum() for i in spreads] for one in judged]
    unseen = [mask & ~reached(state.pressure_pa) for state in states]
    beyond = [
        np.median([map_[own].mean() for map_, own in zip(maps, unseen, strict=True) if own.any()])
        for maps in (truth, *(one.found for one in judged))
    ]
    return table(
        ("the paper's statement", "measured as", "FE", *(f"`{one.run.network}`" for one in judged)),
        (
            "'overall trend well reproduced'",
            "correlation of SED with FE's over the pixels, median / 5th percentile",
            *trend,
        ),
        ("", "error of the sum over the map", "", *(percent(one.errors["total_energy_error"]) for one in judged)),
        (
            "'wider than pressure'",
            "area above a tenth of the maximum, SED over pressure, median",
            *(f"{width:.2f}" for width in widths),
        ),
        (
            "'spread toward the nail base not reproduced'",
            f"states of which at least {100 * SPREADS:.0f} % of SED lies in the zone",
            f"{len(spreads)} of {len(states)}",
            *none,
        ),
        ("", "share of SED in the zone in these states", percent(share[spreads]), *none),
        ("", "sum of SED in the zone over FE's in these states, 5 % / median / 95 %", "1", *map(three, kept)),
        (
            "",
            "relative L2 in the zone in these states",
            "",
            *(percent(one.errors["nail_base_error"][spreads]) for one in judged),
        ),
        (
            "",
            "part of the zone's SED in these states that lies further from any pressure than the U-Net sees",
            percent(blind),
            *none,
        ),
        (
            "",
            "mean SED wherever the U-Net sees no pressure, J/m3, median of all states",
            *(f"{value:.1f}" for value in beyond),
        ),
    )


def three(values):
    return " / ".join(f"{value:.2f}" for value in np.nanpercentile(values, (5, 50, 95)))


def draw_maps(all_answers, whole, zones):
    """As the paper's figure 4: pressure, FE's SED, the network's, and the difference."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    judged = {one.run.network: one for one in all_answers if one.run.split == "simulation"}
    shown = [judged[name] for name in SHOWN if name in judged]
    poses = {press["id"]: press for press in json.loads((whole.directory / "manifest.json").read_text())["presses"]}
    deepest = {}
    for row, state in enumerate(shown[0].states):
        if state.press_id not in deepest or state.depth_mm > shown[0].states[deepest[state.press_id]].depth_mm:
            deepest[state.press_id] = row
    chosen = [min(deepest, key=lambda i: abs(poses[i]["pitch_deg"] - pitch)) for pitch in (0.0, 22.5, 45.0)]
    titles = ["pressure, kPa", "SED, FE (truth), kJ/m³"]
    for one in shown:
        titles += [f"SED, {one.run.network}, kJ/m³", f"{one.run.network} - FE, kJ/m³"]
    figure, axes = plt.subplots(3, len(titles), figsize=(2.9 * len(titles), 8.1), layout="constrained")
    blank = np.where(zones.mask, 1.0, np.nan)
    rows, columns = (np.flatnonzero(zones.mask.any(axis=axis)) for axis in (1, 0))
    for line, press in zip(axes, chosen, strict=True):
        state = shown[0].states[deepest[press]]
        truth = 1e-3 * state.sed_j_per_m3
        maps = [(1e-3 * state.pressure_pa, "magma", 0.0, None), (truth, "viridis", 0.0, truth.max())]
        for one in shown:
            found = 1e-3 * one.found[deepest[press]]
            maps += [
                (found, "viridis", 0.0, truth.max()),
                (found - truth, "RdBu_r", -0.3 * truth.max(), 0.3 * truth.max()),
            ]
        for axis, (map_, colours, low, high) in zip(line, maps, strict=True):
            image = axis.imshow(map_ * blank, cmap=colours, vmin=low, vmax=high)
            axis.contour(zones.nail_base, levels=[0.5], colors="0.6", linewidths=0.8, linestyles="dotted")
            axis.set(xticks=[], yticks=[], xlim=(columns[0], columns[-1]), ylim=(rows[-1], rows[0]))
            figure.colorbar(image, ax=axis, shrink=0.75)
        line[0].set_ylabel(
            f"pitch {poses[press]['pitch_deg']:.0f}°, roll {poses[press]['roll_deg']:.0f}°, {state.depth_mm:g} mm"
        )
        for k, one in enumerate(shown):
            line[3 + 2 * k].set_xlabel(
                f"relative L2 {100 * one.errors['relative_l2'][deepest[press]]:.1f} %", fontsize=9
            )
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title, fontsize=10)
    figure.savefig(PICTURES / "unet-paper-maps.png", dpi=90)


def draw_losses(all_answers):
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    titles = {"mse": "mean squared error of normalised maps", "relative": "relative loss of our networks"}
    panels = {loss: [one for one in all_answers if NETWORKS[one.run.network]["loss"] == loss] for loss in titles}
    panels = {loss: own for loss, own in panels.items() if own}
    figure, axes = plt.subplots(1, len(panels), figsize=(5.5 * len(panels), 4.2), layout="constrained", squeeze=False)
    for axis, (loss, own) in zip(axes[0], panels.items(), strict=True):
        for k, one in enumerate(own):
            used = np.cumsum([line["processor_seconds"] for line in one.history]) / 60.0
            label = f"{one.run.network}, by {one.run.split}"
            axis.semilogy(
                used,
                [line["train_loss"] for line in one.history],
                "o-",
                ms=4,
                color=f"C{k}",
                label=f"{label}: training",
            )
            at = [used[int(line["epoch"]) - 1] for line in one.held_out]
            axis.semilogy(
                at, [line["loss"] for line in one.held_out], "s:", ms=4, color=f"C{k}", label=f"{label}: testing"
            )
        axis.set(title=titles[loss], xlabel="processor time, min", ylabel="loss")
        axis.grid(visible=True, which="both", alpha=0.25)
        axis.legend(fontsize=8)
    figure.savefig(PICTURES / "unet-paper-losses.png", dpi=100)


def fill(page, name, lines):
    """Put lines between the page's marks of this name."""
    begin, end = f"<!-- begin: {name}; studies/unet_paper.py writes it -->", f"<!-- end: {name} -->"
    text = page.read_text()
    if text.count(begin) != 1 or text.count(end) != 1:
        sys.exit(f"error: {page} has no lines '{begin}' and '{end}', between which the table belongs")
    before, rest = text.split(begin)
    page.write_text(before + begin + "\n\n" + "\n".join(lines) + "\n\n" + end + rest.split(end)[1])


def report(runs, whole):
    """Measure the last checkpoints, and write tables and pictures."""
    zones = Zones.of(whole)
    found = [(run, run.checkpoint()) for run in runs]
    for run, state in found:
        if state is None:
            print(f"{run.name}: not trained, left out", file=sys.stderr)
    all_answers = [Answers(run, state, whole, zones) for run, state in found if state is not None]
    if not any(one.run.split == "simulation" for one in all_answers):
        sys.exit("error: no run by simulation is trained yet: run the command `train` first")
    tables = {
        "accuracy": accuracy_table(all_answers),
        "split": flattery_table(all_answers),
        "flattery": flattered_by(all_answers),
        "kernel": kernel_table(whole),
        "depth": depth_table(all_answers),
        "statements": statement_table(all_answers, zones),
        "convergence": convergence_table(all_answers),
    }
    for name, lines in tables.items():
        print(f"\n{name}\n" + "\n".join(lines))
        fill(REPORT, name, lines)
    draw_maps(all_answers, whole, zones)
    draw_losses(all_answers)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("all", "train", "report"), nargs="?", default="all")
    parser.add_argument("--runs", nargs="+", default=DEFAULT_RUNS, metavar="NETWORK/SPLIT")
    parser.add_argument("--minutes", type=float, default=30.0, help="processor time of each run (30)")
    parser.add_argument(
        "--precision",
        choices=PRECISIONS,
        default="f32",
        help="of the steps of the published U-Net (f32); its weights are f32 in any case. bf16 halves the time "
        "of an epoch on processors with instructions for it",
    )
    parser.add_argument("--until", metavar="HH:MM", help="train no longer than this time of today")
    parser.add_argument("--dataset", type=Path, default=ROOT / "data/s1-graded")
    parser.add_argument("--maps", type=Path, help="where the maps of the dataset are (as of papilla_trainer)")
    parser.add_argument("--out", type=Path, default=ROOT / "out/unet-paper", help="the runs (out/unet-paper)")
    options = parser.parse_args()
    whole = Dataset(options.dataset, Store(options.maps))
    runs = [Run(name, options.out, options.precision) for name in options.runs]
    until = None
    if options.until:
        clock = time.strptime(options.until, "%H:%M")
        now = time.localtime()
        until = time.mktime((*now[:3], clock.tm_hour, clock.tm_min, 0, 0, 0, -1))
    if options.what != "report":
        for run in runs:
            train(run, whole, options.minutes, until)
    if options.what != "train":
        report(runs, whole)


if __name__ == "__main__":
    main()
