#!/usr/bin/env python3
"""What presses of a finger buy: errors of its networks against the number of presses learnt from.

    python studies/fingers.py solve [NAME...]     solves the presses of studies/fingers/NAME.toml: core hours
    python studies/fingers.py measure [NAME...]   teaches each finger with the first 10, 25, 50 and 100 of those
                                                  that are solved, and writes the table and the plot

A finger's bundle stands in --out (out/fingers) and goes on where it was stopped. `solve` may be done
by `fe-datagen generate` on a cluster instead: the campaign is OUT/NAME/teach/campaign.toml. `measure`
may run beside it: it works on copies of the presses that are there, in OUT/NAME-COUNT.

All networks of a finger are judged on the same held-out presses: those of as many as are solved. Before
the first one is learnt from, they are the default finger's networks by similarity alone. Errors are
those of the network that is served: from pressure the default for pressure, from poses the default.

Needs numpy, matplotlib, the trainer's requirements, and the programs fe-datagen and model-export:
FE_DATAGEN and MODEL_EXPORT, or PATH. Run it in the root of the repository.
"""

import argparse
import csv
import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FINGERS = ROOT / "studies/fingers"
MODELS = ROOT / "models"
COUNTS = (10, 25, 50, 100)
# As `finger teach` judges poses, and as models/contact.json calls it.
METHOD = ("second order, pixels", "pixels")
BAR = 1.3
KINDS = ("pressure_to_sed", "pose_to_sed")


def program(variable: str, name: str) -> str:
    found = shutil.which(os.environ.get(variable, name))
    if found is None:
        sys.exit(f"there is no program {name}: build it, and name it by {variable}")
    return found


def run(*words, keep: bool = False) -> str:
    words = [str(word) for word in words]
    print("+", *words, file=sys.stderr, flush=True)
    stdout = subprocess.PIPE if keep else None
    return subprocess.run(words, check=True, cwd=ROOT, stdout=stdout, text=True).stdout


def asked(*words):
    """What a command prints as JSON."""
    return json.loads(run(*words, keep=True))


def defaults() -> dict:
    """The networks that are served by default, by what they turn into SED."""
    index = json.loads((MODELS / "index.json").read_text())
    pose = index["default"]
    return {"pressure_to_sed": index.get("default_for_pressure", pose), "pose_to_sed": pose}


def own_errors(networks: dict) -> dict:
    """What the default finger's networks err on held-out presses of their own finger."""
    card = json.loads((MODELS / f"{networks['pressure_to_sed']}.json").read_text())
    contact = json.loads((MODELS / "contact.json").read_text())
    if contact["network"] != networks["pose_to_sed"]:
        sys.exit(f"models/contact.json is of {contact['network']}, not of {networks['pose_to_sed']}")
    (method,) = (of for of in contact["methods"] if of["name"] == METHOD[1])
    # The first set is that of the card: presses of the shapes that were learnt.
    return {
        "pressure_to_sed": card["metrics"]["relative_l2"],
        "pose_to_sed": method["errors"][0]["sed_relative_l2"],
    }


def bundle(out: Path, name: str) -> Path:
    """The finger's folder, with its file."""
    folder = out / name
    file = folder / "finger.toml"
    if not file.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(FINGERS / f"{name}.toml", file)
    return folder


def solved(folder: Path) -> int:
    """How many presses are solved from the first one on."""
    progress = folder / "teach/presses/progress"
    count = 0
    # The record is written after the press.
    while (progress / f"press-{count:05}.json").is_file():
        count += 1
    return count


def copied(folder: Path, presses: int, contact: bool) -> Path:
    """A bundle with the first presses of another one alone, ready to be taught with them."""
    own = folder.with_name(f"{folder.name}-{presses}")
    names = ["finger.toml", "teach/presses/progress/campaign.json"]
    names += [f"teach/presses/{name}" for name in ("atlas.json", "raster.npz")]
    names += ["skin.json"]
    names += ["atlas.json", "finger.contact"] if contact else []
    for press in range(presses):
        names += [f"teach/presses/shards/press-{press:05}.npz"]
        names += [f"teach/presses/progress/press-{press:05}.json"]
    # A press that failed has no shard, and not every finger has a skin of its own.
    for name in (name for name in names if (folder / name).is_file()):
        (own / name).parent.mkdir(parents=True, exist_ok=True)
        if not (own / name).is_file():
            shutil.copyfile(folder / name, own / name)
    return own


def presses_hours(folder: Path, presses: int) -> float:
    """Core hours of the first presses."""
    records = (folder / f"teach/presses/progress/press-{i:05}.json" for i in range(presses))
    read = (json.loads(record.read_text()) for record in records)
    return sum(r.get("processor_s") or r["seconds"] for r in read) / 3600.0


def training_hours(folder: Path, networks: dict) -> float:
    """Core hours of all epochs that stand in a taught bundle."""
    seconds = 0.0
    for name in set(networks.values()):
        (history,) = (folder / "teach/runs").glob(f"{name}-????????????/history.csv")
        with history.open() as lines:
            seconds += sum(float(line["processor_seconds"]) for line in csv.DictReader(lines))
    return seconds / 3600.0


def built(folder: Path) -> float:
    """Makes atlas and contact model, unless they are there; core hours that this took."""
    note = folder / "built.json"
    if not (folder / "finger.contact").is_file() or not note.is_file():
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run(program("FE_DATAGEN", "fe-datagen"), "finger", "build", folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        note.write_text(json.dumps({"processor_s": took}) + "\n")
    return json.loads(note.read_text())["processor_s"] / 3600.0


def errors(models: dict, judge: Path, contact: bool, similarity: bool) -> dict:
    """Errors of networks on the held-out presses of a bundle."""
    export, presses = program("MODEL_EXPORT", "model-export"), judge / "teach/presses"
    also = ["--similarity"] if similarity else []
    card = asked(export, "--json", "evaluate", models["pressure_to_sed"], presses, *also)["card"]
    found = {"states": card["metrics"]["samples"], "pressure_to_sed": card["metrics"]["relative_l2"]}
    found |= {"pose_to_sed": None, "pose_to_pressure": None}
    if contact:
        words = ("contact", judge / "finger.contact", presses, "--finger", judge)
        words += ("--method", METHOD[0], "--network", models["pose_to_sed"])
        (row,) = asked(export, "--json", *words, *also)
        for key, of in (("pose_to_sed", "sed"), ("pose_to_pressure", "pressure")):
            found[key] = dict(zip(("median", "p95"), row[of], strict=True))
    return found


def solve(options) -> None:
    datagen = program("FE_DATAGEN", "fe-datagen")
    for name in options.fingers:
        folder = bundle(options.out, name)
        run(datagen, "finger", "teach", folder, "--plan", "--presses", options.presses)
        campaign = folder / "teach/campaign.toml"
        run(datagen, "generate", campaign, "--out", folder / "teach/presses", "--threads", options.threads)


def measured(options, name: str) -> dict:
    datagen = program("FE_DATAGEN", "fe-datagen")
    networks, contact = defaults(), not options.without_contact
    if not contact:
        networks["pose_to_sed"] = networks["pressure_to_sed"]
    folder = bundle(options.out, name)
    there = solved(folder)
    counts = [count for count in COUNTS if count <= min(there, options.presses)]
    if not counts:
        sys.exit(f"{folder}: {there} presses are solved, and {COUNTS[0]} are the fewest")
    contact_hours = built(folder) if contact else 0.0
    # The held-out presses of all that is solved are the judge.
    judge = copied(folder, counts[-1], contact)
    run(datagen, "finger", "teach", judge, "--plan", "--presses", counts[-1])
    run(datagen, "generate", judge / "teach/campaign.toml", "--out", judge / "teach/presses", "--threads", "1")
    start = {kind: MODELS / f"{network}.onnx" for kind, network in networks.items()}
    nothing = {"presses": 0, "contact": contact_hours, "training": 0.0}
    rows = [{"presses": 0, "learnt": 0, "core_hours": nothing, **errors(start, judge, contact, True)}]
    for count in counts:
        part = copied(folder, count, contact)
        words = ["--presses", count, "--threads", options.threads, "--json"]
        for network in sorted(set(networks.values())):
            words += ["--network", network]
        words += [] if contact else ["--without-contact"]
        report = asked(datagen, "finger", "teach", part, *words)
        own = {kind: part / f"{network}.onnx" for kind, network in networks.items()}
        took = {
            "presses": presses_hours(folder, count),
            "contact": contact_hours,
            "training": training_hours(part, networks),
        }
        learnt = report["presses"] - report["held_out"]
        rows.append({"presses": count, "learnt": learnt, "core_hours": took, **errors(own, judge, contact, False)})
    default = own_errors(networks)
    return {"finger": name, "networks": networks, "default_finger": default, "rows": rows}


def percent(spread, key: str) -> str:
    return "-" if spread is None else f"{100 * spread[key]:.1f}"


def table(found: list[dict]) -> str:
    """Markdown: one row for each finger and number of presses."""
    heads = ["finger", "presses", "of these learnt from", "core h: presses", "core h: contact", "core h: training"]
    for what in ("pressure to SED", "pose to SED"):
        heads += [f"{what}: median, %", f"{what}: 95th percentile, %", f"{what}: times the default finger's"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for of in found:
        for row in of["rows"]:
            took = row["core_hours"]
            cells = [of["finger"], str(row["presses"]), str(row["learnt"])]
            cells += [f"{took[part]:.2f}" for part in ("presses", "contact", "training")]
            for kind in KINDS:
                cells += [percent(row[kind], "median"), percent(row[kind], "p95")]
                own = of["default_finger"][kind]["median"]
                cells += ["-" if row[kind] is None else f"{row[kind]['median'] / own:.2f}"]
            lines.append("| " + " | ".join(cells) + " |")
        default = of["default_finger"]
        cells = ["default", "", "", "", "", ""]
        for kind in KINDS:
            cells += [percent(default[kind], "median"), percent(default[kind], "p95"), "1.00"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def plot(found: list[dict], path: Path) -> None:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 4.2), layout="constrained")
    FigureCanvasSVG(figure)
    left, right = figure.subplots(1, 2, sharey=True)
    for k, of in enumerate(found):
        for kind, style in zip(KINDS, ("o-", "s:"), strict=True):
            rows = [row for row in of["rows"] if row[kind] is not None]
            if not rows:
                continue
            medians = [100 * row[kind]["median"] for row in rows]
            label = f"{of['finger']}, {kind.replace('_', ' ').replace('sed', 'SED')}"
            left.plot([row["presses"] for row in rows], medians, style, color=f"C{k}", label=label)
            took = [sum(row["core_hours"].values()) for row in rows]
            right.plot(took, medians, style, color=f"C{k}", label=label)
    for kind, line in zip(KINDS, ("--", ":"), strict=True):
        bar = 100 * BAR * found[0]["default_finger"][kind]["median"]
        label = f"{BAR} times the default finger's, {kind.replace('_', ' ').replace('sed', 'SED')}"
        for axes in (left, right):
            axes.axhline(bar, color="0.6", linestyle=line, label=label)
    for axes, words in ((left, "presses"), (right, "core hours")):
        axes.set(xlabel=words, ylim=(0, None))
        axes.grid(visible=True, alpha=0.25)
    left.set(ylabel="error of SED, relative L2, median, %")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize="small", loc="outside upper center", ncols=2)
    figure.savefig(path, format="svg", metadata={"Date": None})


def measure(options) -> None:
    found = [measured(options, name) for name in options.fingers]
    for path, text in (("fingers.json", json.dumps(found, indent=2) + "\n"), ("fingers.md", table(found))):
        (options.out / path).write_text(text)
    plot(found, options.out / "fingers.svg")
    print(table(found))


def main() -> None:
    names = sorted(path.stem for path in FINGERS.glob("*.toml"))
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("command", choices=("solve", "measure"))
    parser.add_argument("fingers", nargs="*", default=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--out", type=Path, default=ROOT / "out/fingers", help="folder of bundles, older ones go on")
    parser.add_argument("--presses", type=int, default=COUNTS[-1], help="solve so many; measure at most so many")
    parser.add_argument("--threads", default="1", help="presses at a time, and threads of a training")
    parser.add_argument("--without-contact", action="store_true", help="pressure to SED alone")
    options = parser.parse_args()
    options.out = options.out.resolve()
    {"solve": solve, "measure": measure}[options.command](options)


if __name__ == "__main__":
    main()
