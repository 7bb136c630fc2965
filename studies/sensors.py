#!/usr/bin/env python3
"""What a sensor's pitch and noise cost in accuracy: virtual arrays read finite-element states.

    python studies/sensors.py choose [--url URL]   compares ways from readings to pressure, on training states
    python studies/sensors.py measure [--url URL]  measures the chosen way on test states, and writes
                                                   studies/reports/sensors.md, its picture, and the table
                                                   that papilla.sensors.expected and docs/guides/sensors.md have

Needs a running papilla-server, numpy, matplotlib, and fe-datagen, which draws maps: FE_DATAGEN or PATH. `measure` takes some ten minutes on two busy cores.
"""

import argparse
import json
import os
import platform
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "clients/python"), str(ROOT / "model-export/trainer")]

import papilla  # noqa: E402
from papilla.sensors import Taxels, field  # noqa: E402
from papilla_trainer.dataset import Dataset  # noqa: E402

PITCHES_MM = (1.0, 2.0, 4.0)
NOISES = (0.0, 0.02, 0.05)
TIER = "small-maps"
REPORT = ROOT / "studies/reports/sensors.md"
PICTURE = ROOT / "studies/reports/pictures/sensors.png"
TABLE = ROOT / "clients/python/papilla/sensors/accuracy.json"
GUIDE = ROOT / "docs/guides/sensors.md"
BEGIN, END = "<!-- begin: studies/sensors.py writes this table -->", "<!-- end -->"
# Shapes of indenters without edges or detail finer than a contact.
WIDE = {"plate", "ball of 12 mm", "ball of 6 mm"}
# The pad as it is seen from below, mm.
LENGTH_MM, WIDTH_MM, MIDDLE_MM = 24.0, 16.0, (12.5, 0.0, -6.5)
QUANTITIES = ("sed_relative_l2", "force_relative", "sa1_relative")
# The defaults of the effect `afferents`.
E_REF_KPA, THETA_KPA, PER_MM2 = 80.0, 8.0, 0.7


class States:
    """Finite-element states: pressure and SED."""

    def __init__(self, folder, which, every=1):
        data = Dataset(ROOT / "data" / folder)
        ids = {"train": data.train_ids, "test": data.test_ids, "all": sorted(data.presses)}[which][::every]
        maps = data.load(ids)
        manifest = json.loads((data.directory / "manifest.json").read_text())
        names = {press["id"]: press["indenter"] for press in manifest["presses"]}
        self.pressure_pa, self.sed = maps.pressure_pa, maps.sed_j_per_m3
        self.names = [names[int(press)] for press in maps.press_id]

    def __len__(self):
        return len(self.names)


class Judge:
    """Errors of fields of pressure against finite elements."""

    def __init__(self, url):
        self.url = url
        self.atlas = papilla.Atlas.load(url)
        below = json.loads((ROOT / "models/atlas.json").read_text())
        assert below["hash"] == self.atlas.hash
        self.interface = papilla.Atlas({**below, "skin": below["interface"]})

    def sa1(self, sed):
        """Sum of the static rates of all SA1 afferents, spikes a second."""
        flat = sed.reshape(len(sed), -1)[:, self.interface.pixels]
        stress_kpa = 1e-3 * np.sqrt(2e3 * E_REF_KPA * np.maximum(flat, 0.0))
        return PER_MM2 * (np.maximum(stress_kpa - THETA_KPA, 0.0) * self.interface.areas_mm2).sum(axis=1)

    def forces(self, pressure_pa):
        return np.array([self.atlas.force_n(each) for each in pressure_pa])

    def errors(self, states, pressure_pa):
        """The three errors of each state."""
        answers = papilla.render(pressure_pa, unit="Pa", url=self.url, tier=TIER, effects=["summary", "afferents"])
        found, truth = (each.reshape(len(states), -1).astype(np.float64) for each in (answers.sed, states.sed))
        force, sa1 = self.forces(states.pressure_pa), self.sa1(states.sed)
        rate = answers["summary_sa1_rate_hz"]
        with np.errstate(divide="ignore", invalid="ignore"):
            sa1_error = np.where(sa1 > 1.0, np.abs(rate - sa1) / sa1, np.nan)
        return {
            "sed_relative_l2": np.linalg.norm(found - truth, axis=1) / np.linalg.norm(truth, axis=1),
            "force_relative": np.abs(self.forces(pressure_pa) - force) / force,
            "sa1_relative": sa1_error,
        }


def array(atlas, pitch_mm, **more):
    """A sensor that covers the pad from below."""
    rows, columns = round(LENGTH_MM / pitch_mm), round(WIDTH_MM / pitch_mm)
    return Taxels.grid(rows, columns, pitch_mm=pitch_mm, centre_mm=MIDDLE_MM, atlas=atlas, unit="Pa", **more)


def read(sensor, states, noise):
    """Readings with noise of so large a share of each state's greatest reading, and that noise, Pa."""
    rng = np.random.default_rng(7)
    clean = sensor.read(states.pressure_pa).reshape(len(states), -1)
    clean = np.where(sensor.live, clean, 0.0)
    sigma = noise * clean.max(axis=1)
    return clean + sigma[:, None] * rng.standard_normal(clean.shape), sigma


def smooth(sensor, states, noise):
    """The way of `papilla.sensors`."""
    readings, sigma = read(sensor, states, noise)
    found = np.zeros_like(states.pressure_pa)
    for number, (row, own) in enumerate(zip(readings, sigma, strict=True)):
        sensor.noise = float(own)
        found[number] = sensor.pressure(row)
    return found


def nearest(sensor, states, noise):
    """Each pixel has the reading of the taxel that covers it."""
    readings, sigma = read(sensor, states, noise)
    readings = np.where(readings > 2 * sigma[:, None], readings, 0.0)
    flat = np.zeros((len(states), papilla.SIDE_PX**2), np.float32)
    for taxel, pixels in enumerate(sensor.footprints):
        flat[:, sensor.atlas.pixels[pixels]] = readings[:, taxel, None]
    return flat.reshape(-1, papilla.SIDE_PX, papilla.SIDE_PX)


def bilinear(sensor, states, noise):
    """Linear between the middles of taxels, along and across the array."""
    readings, sigma = read(sensor, states, noise)
    grid = np.where(readings > 2 * sigma[:, None], readings, 0.0).reshape(len(states), *sensor.shape)
    grid = np.pad(grid, ((0, 0), (1, 1), (1, 1)), mode="edge")
    covered = np.unique(np.concatenate(sensor.footprints))
    places = (sensor.atlas.places_mm[covered] - MIDDLE_MM) / sensor.pitch_mm
    along, across = (places[:, i] + (sensor.shape[i] - 1) / 2 + 1 for i in (0, 1))
    row, column = np.floor(along).astype(int), np.floor(across).astype(int)
    u, v = along - row, across - column
    values = (
        grid[:, row, column] * (1 - u) * (1 - v)
        + grid[:, row + 1, column] * u * (1 - v)
        + grid[:, row, column + 1] * (1 - u) * v
        + grid[:, row + 1, column + 1] * u * v
    )
    flat = np.zeros((len(states), papilla.SIDE_PX**2), np.float32)
    flat[:, sensor.atlas.pixels[covered]] = values
    return flat.reshape(-1, papilla.SIDE_PX, papilla.SIDE_PX)


WAYS = {"nearest": nearest, "bilinear": bilinear, "smooth": smooth}
SAID = {"nearest": "nearest taxel", "bilinear": "bilinear", "smooth": "smoothest field"}


def spread(errors):
    """Median and 95th percentile of each quantity."""
    return {
        name: {"median": float(np.nanmedian(values)), "p95": float(np.nanpercentile(values, 95))}
        for name, values in errors.items()
    }


def shown(error):
    return f"{100 * error['median']:.0f} / {100 * error['p95']:.0f} %"


def choose(url):
    """Prints the errors of all ways, and of the smooth one by its constants, on training states."""
    judge = Judge(url)
    states = States("broad-graded", "train", every=5)
    print(f"{len(states)} training states; median / 95th percentile of SED, force, SA1")
    ways = [("nearest", None), ("bilinear", None)]
    ways += [("smooth", (width, near)) for width in (0.4, 0.6, 0.9) for near in (0.05, 0.1, 0.5)]
    for pitch_mm in PITCHES_MM[:2]:
        for noise in (0.0, 0.05):
            for way, constants in ways:
                if constants is not None:
                    field.WIDTH, field.NEAR = constants
                    if noise == 0.0 and constants[1] != 0.1:
                        continue
                begin = time.perf_counter()
                found = WAYS[way](array(judge.atlas, pitch_mm), states, noise)
                seconds = (time.perf_counter() - begin) / len(states)
                errors = spread(judge.errors(states, found))
                words = "  ".join(shown(errors[name]) for name in QUANTITIES)
                print(f"{pitch_mm:g} mm, {100 * noise:g} %, {way} {constants or ''}: {words}; {seconds:.3f} s", flush=True)


def measure(url):
    """All of the report."""
    judge = Judge(url)
    sets = {"other simulations": States("broad-graded", "test"), "unseen shapes": States("heldout-graded", "all")}
    perfect = {name: judge.errors(states, states.pressure_pa) for name, states in sets.items()}
    rows = []
    for pitch_mm in PITCHES_MM:
        sensor = array(judge.atlas, pitch_mm)
        taxels = int(sensor.live.sum())
        for noise in NOISES:
            for way, make in WAYS.items():
                errors = {name: judge.errors(states, make(sensor, states, noise)) for name, states in sets.items()}
                rows.append({"pitch_mm": pitch_mm, "noise": noise, "way": way, "taxels": taxels, "errors": errors})
                sed = {name: shown(spread(each)["sed_relative_l2"]) for name, each in errors.items()}
                print(pitch_mm, noise, way, sed, flush=True)
    write(sets, perfect, rows)


def together(errors):
    """Over both sets."""
    return {name: np.concatenate([each[name] for each in errors.values()]) for name in QUANTITIES}


def write(sets, perfect, rows):
    kept = [
        {"pitch_mm": row["pitch_mm"], "noise": row["noise"], **spread(together(row["errors"]))}
        for row in rows
        if row["way"] == "smooth"
    ]
    about = "errors against finite elements over the states of heldout-graded and the held-out ones of broad-graded"
    table = {"about": about, "tier": TIER, "perfect": spread(together(perfect)), "rows": kept}
    TABLE.write_text(json.dumps(table, indent=1) + "\n")
    machine = f"{platform.machine()}, {os.cpu_count()} cores"
    lines = [HEAD.format(date=time.strftime("%Y-%m-%d"), machine=machine, states=sum(map(len, sets.values())))]
    for name, states in sets.items():
        lines += [f"## {name.capitalize()}\n", f"{len(states)} states. Each cell: median / 95th percentile.\n"]
        lines += ["| pitch | taxels on the finger | noise | way | SED, relative L2 | force | SA1 |", "|---|---|---|---|---|---|---|"]
        best = spread(perfect[name])
        lines.append("| true pressure | | 0 % | | " + " | ".join(shown(best[each]) for each in QUANTITIES) + " |")
        for row in rows:
            errors = spread(row["errors"][name])
            cells = [f"{row['pitch_mm']:g} mm", str(row["taxels"]), f"{100 * row['noise']:g} %", SAID[row["way"]]]
            lines.append("| " + " | ".join(cells + [shown(errors[each]) for each in QUANTITIES]) + " |")
        lines.append("")
    lines.append(by_shape(sets, perfect, rows))
    REPORT.write_text("\n".join(lines))
    draw(perfect, rows)
    tell(sets, perfect, rows)


def tell(sets, perfect, rows):
    """The short table of the guide."""
    wide = {name: [i for i, each in enumerate(states.names) if each in WIDE] for name, states in sets.items()}

    def cells(errors):
        every = spread(together(errors))
        own = np.concatenate([errors[name]["sed_relative_l2"][places] for name, places in wide.items()])
        medians = [every["sed_relative_l2"], {"median": float(np.median(own))}, every["force_relative"], every["sa1_relative"]]
        return " | ".join(f"{100 * each['median']:.0f} %" for each in medians)

    lines = ["| pitch, noise | SED, all shapes | SED, only plates, and balls of 6 mm radius or more | force | SA1 |", "|---|---|---|---|---|"]
    lines.append(f"| pressure known everywhere | {cells(perfect)} |")
    for row in rows:
        if row["way"] == "smooth":
            lines.append(f"| {row['pitch_mm']:g} mm, {100 * row['noise']:g} % | {cells(row['errors'])} |")
    before, rest = GUIDE.read_text().split(BEGIN)
    GUIDE.write_text(before + BEGIN + "\n\n" + "\n".join(lines) + "\n\n" + END + rest.split(END)[1])


def by_shape(sets, perfect, rows):
    """Error of SED by what presses, without noise."""
    clean = {row["pitch_mm"]: row["errors"] for row in rows if row["way"] == "smooth" and row["noise"] == 0.0}
    heads = " | ".join(f"{pitch:g} mm" for pitch in PITCHES_MM)
    lines = ["## By what presses\n", SHAPES, f"| shape | states | true pressure | {heads} |", "|---|---|---|" + "---|" * len(PITCHES_MM)]
    table = []
    for name, states in sets.items():
        for shape in sorted(set(states.names)):
            own = [i for i, each in enumerate(states.names) if each == shape]
            every = (perfect, *(clean[pitch] for pitch in PITCHES_MM))
            medians = [float(np.median(errors[name]["sed_relative_l2"][own])) for errors in every]
            table.append((medians[1], f"| {shape} | {len(own)} | " + " | ".join(f"{100 * m:.0f} %" for m in medians) + " |"))
    return "\n".join([*lines, *(line for _, line in sorted(table)), ""])


def draw(perfect, rows):
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
    titles = ("SED, relative L2", "force, relative", "all SA1 afferents, relative")
    colours = {0.0: "tab:blue", 0.02: "tab:orange", 0.05: "tab:red"}
    for axis, quantity, title in zip(axes, QUANTITIES, titles, strict=True):
        for way, line in (("smooth", "-"), ("nearest", ":")):
            for noise in NOISES:
                own = [row for row in rows if row["way"] == way and row["noise"] == noise]
                medians = [100 * spread(together(row["errors"]))[quantity]["median"] for row in own]
                label = f"{SAID[way]}, {100 * noise:g} % noise"
                axis.plot([row["pitch_mm"] for row in own], medians, line, marker="o", color=colours[noise], label=label)
        floor = 100 * spread(together(perfect))[quantity]["median"]
        axis.axhline(floor, color="0.4", linestyle="--", label="true pressure")
        axis.set_xscale("log", base=2)
        axis.set_xticks(PITCHES_MM, [f"{pitch:g}" for pitch in PITCHES_MM])
        axis.set(xlabel="pitch, mm", title=title, ylim=(0, None))
    axes[0].set_ylabel("median error against finite elements, %")
    axes[0].legend(fontsize=8)
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE, dpi=110)


HEAD = """\
# What a sensor costs in accuracy

**Question.** Strain energy density (SED), force and the firing of SA1 afferents (slowly adapting nerve fibres of
type 1) can be computed from pressure. How wrong are they if pressure is not known everywhere, but was read by an
array of taxels (the cells of a pressure sensor)? The [glossary](../../docs/glossary.md) explains terms.

**What it means.** The pitch of the taxels matters most. Even at 1 mm the error of SED is several times that of the
network alone. Under wide plates and balls it is about half as large as the median over all shapes. The
smoothest field has the least error of SED, and the nearest taxel in most rows the least error of force. Noise adds to the error of force and hardly to that of SED.
From a pitch of 2 mm on, most SA1 afferents seem silent: an error of 100 % says that none seems to fire.

**Method.** {states} states of the finite-element (FE) solver are read by virtual arrays. No network was trained on these
states, the test sets [*other simulations* and *unseen shapes*](../../docs/concepts/accuracy.md#test-sets). An array
covers the pad from below, without gaps. A reading is the mean pressure over a taxel. Noise is normal and independent;
its standard deviation is a share of the state's greatest reading. Then a map of pressure is made from the readings, in
one of three ways:

| way | what it does |
|---|---|
| nearest taxel | each point of the skin has the reading of the taxel that covers it |
| bilinear | linear between the middles of the taxels |
| smoothest field | the way of `papilla.sensors`: the smoothest field that is nowhere negative and has the readings as its means |

The first two ignore readings below two standard deviations of the noise. The constants of the third were chosen on
training states (`sensors.py choose`). The network `{tier}` computes SED from the map. The truth is the FE state
itself, so all errors contain that of the network. The row *true pressure* has the error of the network alone.

| column | meaning |
|---|---|
| pitch | distance between the middles of neighbouring taxels |
| noise | standard deviation of the noise, as a share of the state's greatest reading |
| SED | relative L2 norm of the error over the map; 100 % is as wrong as a map of zeros |
| force | error of the integral of pressure over the undeformed skin |
| SA1 | error of the sum of the rates of all SA1 afferents under a constant stress, by the formula of the effect [`afferents`](../../docs/reference/protocol-effects.md#afferents) |

This command writes the page, beside a running `papilla-server`, in some ten minutes on two busy cores. It was written on {date}, on {machine}.

```sh
python studies/sensors.py measure
```

![errors by pitch and noise](pictures/sensors.png)

The picture has medians over all states. Grey dashes: the true pressure, known everywhere.
""".replace("{tier}", TIER)

SHAPES = """\
Median relative L2 error of SED with the smoothest field and without noise, by shape and pitch. The names of the
shapes are those of their campaign; the rows are in the order of the error at 1 mm.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["choose", "measure"])
    parser.add_argument("--url", default=papilla.DEFAULT_URL)
    options = parser.parse_args()
    {"choose": choose, "measure": measure}[options.what](options.url)


if __name__ == "__main__":
    main()
