#!/usr/bin/env python3
"""One network for a family of fingers: the dimensions of a finger decide the weights.

    python studies/family.py solve      draws fingers at random, and solves two presses of each
    python studies/family.py train      trains the network on these, with and without the dimensions
    python studies/family.py measure    writes it as ONNX for the fingers of studies/fingers.py, none of
                                        which it has seen, and measures it there
    python studies/family.py            all three

The network begins as the default finger's `small-maps`, from pressure of finite elements to SED. Each
weight becomes w + sum_i t_i d_i, where t are the finger's numbers (see `numbers`) and the d_i are learnt.
For one finger this is a network like any other, so nothing new is served. A finger has the same maps as
its copy in another size, so only ratios of lengths matter.

Fingers are drawn within `spread` about the default finger. Some are set aside: they choose the number of
epochs and the penalty on the d_i. The judges are the fingers of studies/fingers.py, with the presses that
`studies/fingers.py solve` left in its folder (--judges).

Needs the trainer's requirements and the programs fe-datagen and model-export: FE_DATAGEN, MODEL_EXPORT,
or PATH. Every step goes on where it was stopped. Run it in the root of the repository.
"""

import argparse
import json
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import torch
from fingers import JUDGES as DEFAULT_DATA
from fingers import program
from torch import nn
from torch.func import functional_call

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "model-export/trainer")]

from papilla_trainer.augment import varied  # noqa: E402
from papilla_trainer.checkpoint import Served  # noqa: E402
from papilla_trainer.dataset import Dataset  # noqa: E402
from papilla_trainer.export import properties, to_onnx, write_model  # noqa: E402
from papilla_trainer.losses import make_loss  # noqa: E402
from papilla_trainer.map_network import MapNet, ServedMapModel  # noqa: E402
from papilla_trainer.maps import Store  # noqa: E402
from papilla_trainer.start import Start  # noqa: E402

SEQUENCE = ROOT / "campaigns/teach.toml"
START = ROOT / "models/small-maps.onnx"
JUDGES = ("child", "index", "thumb")
# Fingers that are drawn, and how many of them choose.
FINGERS, CHOOSING = 36, 6
# Presses of a finger, and seconds after which the rest of a finger is given up: hard plates on a
# large finger take ten minutes.
PRESSES, PATIENCE_S = 2, 300
# Of the training. VARIANTS: name, whether the numbers decide the weights, whether little else is learnt,
# and the penalty on what they change.
EPOCHS, RATE, SHIFT_PX, FAR_WEIGHT, LOOK = 120, 1e-3, 3, 0.2, 10
VARIANTS = (
    ("pooled", False, False, 0.0),
    ("numbers", True, False, 1e-4),
    ("numbers-held", True, False, 1e-2),
    ("numbers-few", True, True, 1e-2),
)
# Of a level what it takes over from the one above, and how its kernels vary over the finger.
FEW = ("mix", "over_finger")
NUMBERS = ("epidermis", "dermis", "pulp", "height", "length", "bone width", "bone tip", "nail width", "tip's shape")


def drawn(seed: int) -> dict:
    """Dimensions of a finger, mm: the default finger's, each times a factor drawn at random."""
    lot = np.random.default_rng([71, seed])

    def spread(by: float) -> float:
        return float(np.exp(lot.uniform(-by, by)))

    size = float(np.exp(lot.uniform(np.log(0.65), np.log(1.4))))
    height, bone, tip = spread(0.2), spread(0.2), spread(0.2)

    def mm(usual: float, *factors: float) -> float:
        return round(usual * size * float(np.prod(factors)), 3)

    return {
        "shape": {
            "length_mm": mm(25.0, spread(0.12)),
            "width_mm": mm(17.44),
            "height_mm": mm(13.06, height),
            "cap_length_mm": mm(11.25, spread(0.15)),
            "cap_exponent": round(lot.uniform(2.0, 2.5), 3),
            "crease_depth_mm": mm(2.5, height, lot.uniform(0.0, 1.2)),
        },
        "layers": {"epidermis_mm": mm(0.2, spread(0.35)), "dermis_mm": mm(1.0, spread(0.25))},
        "bone": {
            "tip_mm": mm(3.5, tip),
            "cap_mm": mm(5.0, tip),
            "offset_mm": mm(2.0, height, lot.uniform(0.6, 1.3)),
            "tuft_mm": [mm(7.5, bone), mm(3.0, height)],
            "waist_mm": [mm(5.5, bone), mm(4.0, height)],
            "base_mm": [mm(10.0, bone), mm(6.5, height)],
        },
        "nail": {"size_mm": [mm(11.0, spread(0.15)), mm(12.0, spread(0.1))], "tip_mm": mm(2.0, spread(0.1))},
        "source": {"who": f"drawn at random by studies/family.py, number {seed}"},
    }


def explained(folder: Path) -> dict | None:
    """What `finger explain` says, or nothing of a finger that cannot be meshed."""
    words = [program("FE_DATAGEN", "fe-datagen"), "finger", "explain", str(folder), "--json"]
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else None


def value(of: dict, key: str, place: int | None = None) -> float:
    (text,) = (number["value"] for number in of["numbers"] if number["key"] == key)
    found = json.loads(text)
    return found if place is None else found[place]


def lengths(of: dict) -> np.ndarray:
    """The finger's NUMBERS before they are compared with the default finger's: lengths over the width."""
    width = value(of, "shape.width_mm")
    epidermis, dermis, fat = of["below_pad_mm"]
    mm = [
        epidermis,
        dermis,
        epidermis + dermis + fat,
        value(of, "shape.height_mm"),
        value(of, "shape.length_mm"),
        value(of, "bone.tuft_mm", 0),
        value(of, "bone.tip_mm"),
        value(of, "nail.size_mm", 0),
        width * value(of, "shape.cap_exponent"),
    ]
    return np.array(mm) / width


def numbers(of: dict, usual: dict) -> np.ndarray:
    """t: logarithms of the ratios to the default finger, in units of .2; 0 for any size of that finger."""
    return np.log(lengths(of) / lengths(usual)) / 0.2


def toml(value) -> str:
    return "{ " + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + " }" if isinstance(value, dict) else json.dumps(value)


def campaign(seed: int, of: dict, usual: dict) -> str:
    """Presses as `finger teach` takes them: depths in proportion to the pulp, offsets to the width."""
    spec = tomllib.loads(SEQUENCE.read_text())
    pulp = sum(of["below_pad_mm"]) / sum(usual["below_pad_mm"])
    width = value(of, "shape.width_mm") / value(usual, "shape.width_mm")
    spec |= {"name": f"family-{seed}", "seed": 1000 + seed, "presses": PRESSES, "test_one_in": PRESSES, "finger": "."}
    for part in (spec, *spec["indenters"]):
        if "depths" in part:
            part["depths"]["deepest_mm"] = [round(pulp * mm, 2) for mm in part["depths"]["deepest_mm"]]
        if "offset_mm" in part:
            part["offset_mm"] = [[round(width * mm, 2) for mm in of] for of in part["offset_mm"]]
    lines = [f"{key} = {toml(v)}" for key, v in spec.items() if key != "indenters"]
    for indenter in spec["indenters"]:
        lines += ["[[indenters]]", *(f"{key} = {toml(v)}" for key, v in indenter.items())]
    return "\n".join(lines) + "\n"


def solve(options) -> None:
    """Fingers in turn: 0, 1, 2, ...; a number that gives no finger that can be meshed is passed over."""
    datagen = program("FE_DATAGEN", "fe-datagen")
    usual = explained(ROOT / "models")
    done, seed = 0, -1
    while done < options.fingers:
        seed += 1
        folder = options.out / f"{seed:03}"
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / "refused").is_file():
            continue
        if not (folder / "maps").is_dir():
            text = "\n".join(
                f"[{table}]\n" + "\n".join(f"{key} = {toml(v)}" for key, v in rows.items())
                for table, rows in drawn(seed).items()
            )
            (folder / "finger.toml").write_text(text + "\n")
            of = explained(folder)
            if of is None:
                (folder / "refused").write_text("cannot be meshed\n")
                continue
            (folder / "campaign.toml").write_text(campaign(seed, of, usual))
            words = [datagen, "generate", folder / "campaign.toml", "--out", folder / "presses", "--threads", "1"]
            print("+", *words, file=sys.stderr, flush=True)
            began = time.perf_counter()
            with (folder / "log").open("w") as log:
                try:
                    ended = subprocess.run(words, check=False, timeout=PATIENCE_S, stdout=log, stderr=log).returncode
                except subprocess.TimeoutExpired:
                    ended = -1
            if not (folder / "presses/manifest.json").is_file():
                (folder / "refused").write_text(f"ended with {ended} after {time.perf_counter() - began:.0f} s\n")
                continue
            subprocess.run([datagen, "dataset", "maps", folder / "presses", "--out", folder / "maps"], check=True)
        done += 1
        print(f"fingers: {done} of {options.fingers}", file=sys.stderr, flush=True)


class Family(nn.Module):
    """A network on maps whose weights depend on the numbers t of a finger.

    Each weight is w + sum_i t_i d_i. The global map is a product of two large matrices: its ranks are
    multiplied by 1 + sum_i t_i g_i. Begins as `start` for every finger. With `few`, w stays as it is, and
    of the d_i only those of the layers in FEW are learnt.
    """

    def __init__(self, start: Start, by_numbers: bool, few: bool) -> None:
        super().__init__()
        self.network = MapNet(start.spec)
        self.network.load_state_dict(start.weights)
        self.network.requires_grad_(not few)
        self.by_numbers = by_numbers
        count = len(NUMBERS) if by_numbers else 0
        self.change = nn.ParameterDict(
            {
                name.replace(".", "/"): nn.Parameter(torch.zeros(count, *weight.shape))
                for name, weight in self.network.named_parameters()
                if not name.startswith("reach_") and (not few or name.endswith(FEW))
            }
        )
        self.ranks = nn.Parameter(torch.zeros(count, start.spec.rank))

    def weights(self, t: torch.Tensor) -> dict[str, torch.Tensor]:
        """The network's for one finger."""
        found = dict(self.network.named_parameters())
        if self.by_numbers:
            for name, change in self.change.items():
                plain = name.replace("/", ".")
                found[plain] = found[plain] + torch.tensordot(t, change, 1)
            found["reach_in"] = found["reach_in"] * (1.0 + t @ self.ranks)
        return found

    def forward(self, pressure_pa: torch.Tensor, t: torch.Tensor) -> torch.Tensor:
        return functional_call(self.network, self.weights(t), (pressure_pa,))

    def penalty(self) -> torch.Tensor:
        """Mean square of the changes over that of the weights, summed over the layers."""
        total = (self.ranks**2).mean()
        for name, change in self.change.items():
            weight = self.network.get_parameter(name.replace("/", "."))
            total = total + (change**2).mean() / (weight.detach() ** 2).mean().clamp_min(1e-12)
        return total


class FingerMaps:
    """Maps of one finger's states, with its numbers and the loss over its interface."""

    def __init__(self, t: np.ndarray, pressure_pa: np.ndarray, sed: np.ndarray, interface: np.ndarray) -> None:
        self.t = torch.from_numpy(t).float()
        self.pressure_pa, self.sed = (torch.from_numpy(np.array(of)).unsqueeze(1) for of in (pressure_pa, sed))
        self.interface = torch.from_numpy(interface.astype(np.float32))
        self.loss = make_loss("relative", self.interface, FAR_WEIGHT)

    @staticmethod
    def drawn(folder: Path, usual: dict) -> "FingerMaps":
        read = [np.load(folder / f"maps/{name}.npy") for name in ("pressure_pa", "sed_j_per_m3", "interface")]
        touched = read[1].any(axis=(1, 2))
        return FingerMaps(numbers(explained(folder), usual), read[0][touched], read[1][touched], read[2])

    @torch.no_grad()
    def errors(self, family: Family) -> np.ndarray:
        """Relative L2 norm of each state."""
        off = (family(self.pressure_pa, self.t) - self.sed) * self.interface
        norms = [(of * self.interface).square().sum(dim=(1, 2, 3)).sqrt() for of in (off, self.sed)]
        return (norms[0] / norms[1]).numpy()


def all_fingers(options) -> tuple[list[FingerMaps], list[FingerMaps], FingerMaps]:
    """To learn from, to choose by, and the default finger."""
    usual = explained(ROOT / "models")
    folders = sorted(path.parent for path in options.out.glob("[0-9][0-9][0-9]/maps"))[: options.fingers]
    found = [FingerMaps.drawn(folder, usual) for folder in folders]
    default = Dataset(DEFAULT_DATA, Store())
    maps = default.load(default.train_ids)
    own = FingerMaps(np.zeros(len(NUMBERS)), maps.pressure_pa, maps.sed_j_per_m3, default.mask())
    return found[CHOOSING:], found[:CHOOSING], own


def epoch(family: Family, optimizer, learnt: list[FingerMaps], own: FingerMaps, penalty: float, lot) -> None:
    """Each finger once, in turn with as many states of the default finger for every fourth."""
    for place in torch.randperm(len(learnt), generator=lot).tolist():
        batches = [(learnt[place], learnt[place].pressure_pa, learnt[place].sed)]
        if place % 4 == 0:
            rows = torch.randint(len(own.sed), (4,), generator=lot)
            batches.append((own, own.pressure_pa[rows], own.sed[rows]))
        optimizer.zero_grad()
        for finger, pressure_pa, sed in batches:
            rows = torch.randperm(len(sed), generator=lot)
            seen, due = varied(pressure_pa[rows], sed[rows], SHIFT_PX, lot)
            finger.loss(family(seen, finger.t), due).backward()
        if penalty > 0.0:
            (penalty * family.penalty()).backward()
        nn.utils.clip_grad_norm_(family.parameters(), 1.0)
        optimizer.step()


def train(options) -> None:
    torch.set_num_threads(1)
    learnt, choosing, own = all_fingers(options)
    rows = {"fingers": len(learnt), "states": sum(len(of.sed) for of in learnt), "choosing": len(choosing)}
    print(rows, file=sys.stderr)
    table = []
    for name, by_numbers, few, penalty in VARIANTS:
        note = options.out / f"{name}.json"
        if note.is_file():
            table.append(json.loads(note.read_text()))
            continue
        torch.manual_seed(0)
        lot = torch.Generator().manual_seed(0)
        family = Family(Start.read(START), by_numbers, few)
        optimizer = torch.optim.Adam(family.parameters(), lr=RATE, fused=True)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, options.epochs)
        best, began = None, time.process_time()
        for at in range(options.epochs + 1):
            if at % LOOK == 0:
                chosen = float(np.median(np.concatenate([of.errors(family) for of in choosing])))
                print(f"{name}: epoch {at}, {100 * chosen:.1f} % on fingers to choose by", file=sys.stderr, flush=True)
                if best is None or chosen < best["chosen_by"]:
                    torch.save(family.state_dict(), options.out / f"{name}.pt")
                    best = {"variant": name, "by_numbers": by_numbers, "few": few, "penalty": penalty, "epoch": at, "chosen_by": chosen}
                if at == 0:
                    before = chosen
            if at < options.epochs:
                epoch(family, optimizer, learnt, own, penalty, lot)
                schedule.step()
        best |= {"before": before, "processor_s": time.process_time() - began, **rows}
        note.write_text(json.dumps(best, indent=2) + "\n")
        table.append(best)
    print(json.dumps(table, indent=2))


def served(folder: Path) -> Served:
    """What a model has to know of the finger that a dataset is of; `Dataset` refuses one without training."""
    manifest = json.loads((folder / "manifest.json").read_text())
    return Served(
        mask=torch.from_numpy(Store().maps_of(folder).interface.astype(np.uint8)),
        finger_sha256=manifest["campaign"].get("finger_sha256"),
        **{key: manifest[key] for key in ("pressure_max_pa", "sed_max_j_per_m3", "atlas_hash", "effects", "dataset_sha256")},
    )


def written(family: Family, judge: Served, t: np.ndarray, out: Path, training: dict) -> Path:
    """The family's network for one finger, as ONNX: the same format as any other network."""
    network = MapNet(family.network.spec)
    network.load_state_dict({name: of.detach() for name, of in family.weights(torch.from_numpy(t).float()).items()})
    model = ServedMapModel(network, judge.mask.float()).eval()
    props = properties(judge, "family", family.network.spec.as_json(), training)
    return write_model(to_onnx(model), props, out)


def relative_l2(model: Path, folder: Path, *more: str) -> dict:
    """Median and 95th percentile on the held-out presses of a dataset."""
    words = [program("MODEL_EXPORT", "model-export"), "--json", "evaluate", str(model), str(folder), *more]
    done = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout)["card"]["metrics"]["relative_l2"]


def measure(options) -> None:
    """On presses of fingers that no variant has seen; the variant is the one that chose best."""
    usual = explained(ROOT / "models")
    judges = {name: options.judges / f"{name}-held-out/judge" for name in JUDGES}
    alone = {name: relative_l2(START, folder, "--similarity") for name, folder in judges.items()}
    notes = [json.loads((options.out / f"{name}.json").read_text()) for name, *_ in VARIANTS]
    best = min(notes, key=lambda note: note["chosen_by"])["variant"]
    found = []
    for note in notes:
        family = Family(Start.read(START), note["by_numbers"], note["few"])
        family.load_state_dict(torch.load(options.out / f"{note['variant']}.pt", weights_only=True))
        for name in JUDGES:
            folder = judges[name]
            t = numbers(explained(options.judges / name), usual)
            training = {"start": Start.read(START).record(), "family": note}
            onnx = written(family, served(folder), t, options.out / f"{note['variant']}-{name}.onnx", training)
            row = {"variant": note["variant"], "chosen": note["variant"] == best, "finger": name}
            row |= {"family": relative_l2(onnx, folder), "similarity": alone[name]}
            found.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
    (options.out / "family.json").write_text(json.dumps({"variants": notes, "judges": found}, indent=2) + "\n")
    print(json.dumps(found, indent=2))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", nargs="?", choices=("solve", "train", "measure"), help="one step alone")
    parser.add_argument("--out", type=Path, default=ROOT / "out/family", help="folder of fingers and networks")
    parser.add_argument("--fingers", type=int, default=FINGERS, help="how many are drawn")
    parser.add_argument("--epochs", type=int, default=EPOCHS, help="passes over all fingers")
    parser.add_argument("--judges", type=Path, default=ROOT / "out/fingers", help="folder of studies/fingers.py")
    options = parser.parse_args()
    options.out = options.out.resolve()
    steps = {"solve": solve, "train": train, "measure": measure}
    for name in [options.step] if options.step else steps:
        steps[name](options)


if __name__ == "__main__":
    main()
