#!/usr/bin/env python3
"""What presses of a finger buy: errors of its networks against the number of presses learnt from.

    python studies/fingers.py solve [NAME...]     solves the presses of studies/fingers/NAME.toml: core hours
    python studies/fingers.py measure [NAME...]   teaches each finger with the first 10, 25, 50 and 100 of those
                                                  that are solved
    python studies/fingers.py report [NAME...]    writes the table and the plot of what is measured

A finger's bundle stands in --out (out/fingers) and goes on where it was stopped. Whoever puts a bundle
there before, such as studies/hand_model.py, has it measured too. `solve` may be done by `fe-datagen
generate` on a cluster instead: the campaign is OUT/NAME/teach/campaign.toml. `measure` may run beside
it: it works on copies of the presses that are there, in OUT/NAME-COUNT.

All fingers are judged on the same presses, which no network learns from: every second or third of those
that the default finger's networks are judged on, with depths in proportion to the soft tissue below
the pad and offsets in proportion to the width. So the default finger's own error on them stands beside
each. Before the first press of a finger is learnt from, its networks are the default finger's by similarity
alone. Errors are those of the network that is served: from pressure the default for pressure, from
poses the default.

Needs numpy, matplotlib, the trainer's requirements, and the programs fe-datagen and model-export:
FE_DATAGEN, MODEL_EXPORT and PYTHON, or PATH. Run it in the root of the repository.
"""

import argparse
import csv
import json
import os
import resource
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
FINGERS = ROOT / "studies/fingers"
MODELS = ROOT / "models"
COUNTS = (10, 25, 50, 100)
# Presses that are solved by one call.
TOGETHER = 5
# Where the held-out presses come from, with the campaign of that dataset, and how many are taken.
JUDGES, JUDGES_CAMPAIGN, JUDGED_BY = ROOT / "data/broad-graded", ROOT / "campaigns/broad-graded.toml", 8
# As `finger teach` judges poses.
METHOD = "second order, pixels"
# `fe-datagen generate` ends with it where a state was dropped, which the dataset then lists.
DROPPED = 3
BAR = 1.3
KINDS = ("pressure_to_sed", "pose_to_sed")


def program(variable: str, name: str) -> str:
    found = shutil.which(os.environ.get(variable, name))
    if found is None:
        sys.exit(f"there is no program {name}: build it, and name it by {variable}")
    return found


def run(*words, keep: bool = False, accepted: tuple[int, ...] = (0,)) -> str:
    words = [str(word) for word in words]
    print("+", *words, file=sys.stderr, flush=True)
    stdout = subprocess.PIPE if keep else None
    done = subprocess.run(words, check=False, cwd=ROOT, stdout=stdout, text=True)
    if done.returncode not in accepted:
        sys.exit(f"{words[0]} {words[1]}: ended with {done.returncode}; the same command goes on from here")
    return done.stdout


def asked(*words):
    """What a command prints as JSON."""
    return json.loads(run(*words, keep=True))


def defaults() -> dict:
    """The networks that are served by default, by what they turn into SED."""
    index = json.loads((MODELS / "index.json").read_text())
    pose = index["default"]
    return {"pressure_to_sed": index.get("default_for_pressure", pose), "pose_to_sed": pose}


def judges() -> list[dict]:
    """Some of the presses that the default finger's networks are judged on, evenly spaced among them."""
    manifest = json.loads((JUDGES / "manifest.json").read_text())
    held_out = [press for press in manifest["presses"] if press["split"] == "test"]
    return [held_out[k * len(held_out) // JUDGED_BY] for k in range(JUDGED_BY)]


def judges_campaign(out: Path) -> Path:
    """A campaign of these presses, for the default finger: an indenter for each, in one pose alone."""
    campaign = tomllib.loads(JUDGES_CAMPAIGN.read_text())
    indenters = {of["name"]: of["indenter"] for of in campaign["indenters"]}
    lines = ['name = "held-out"', "seed = 1", f"presses = {JUDGED_BY}", "test_fraction = 0.0"]
    lines += [f"{key} = {json.dumps(campaign[key])}" for key in ("density", "order", "effects")]
    lines += ["depths = { deepest_mm = [1.0, 1.0], states = 2 }"]
    alone = "pitch_deg = [{0}, {0}], roll_deg = [{1}, {1}], yaw_deg = [{2}, {2}]"
    lines += ["pose = { " + alone.format(0.0, 0.0, 0.0) + " }"]
    for press in judges():
        with np.load(JUDGES / press["file"]) as shard:
            deepest = float(shard["depth_mm"].max())
        pose = alone.format(*(press[angle] for angle in ("pitch_deg", "roll_deg", "yaw_deg")))
        shape = ", ".join(f"{key} = {json.dumps(value)}" for key, value in indenters[press["indenter"]].items())
        lines += ["[[indenters]]", f'name = "{press["indenter"]}, {press["id"]}"', f"indenter = {{ {shape} }}"]
        lines += [f"pose = {{ {pose} }}", f"offset_mm = {[[by, by] for by in press['offset_mm']]}"]
        lines += [f"depths = {{ deepest_mm = [{deepest}, {deepest}], states = 2 }}"]
    path = out / "held-out.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def judge(dataset: Path, ids: list[int], view: Path) -> Path:
    """A view of a dataset in which these presses are held out, and no others."""
    manifest = json.loads((dataset / "manifest.json").read_text())
    for press in manifest["presses"]:
        press["split"] = "test" if press["id"] in ids else "train"
    manifest["splits"] = {
        split: [press["id"] for press in manifest["presses"] if press["split"] == split] for split in ("train", "test")
    }
    shutil.rmtree(view, ignore_errors=True)
    view.mkdir(parents=True)
    for name in ("atlas.json", "raster.npz", "shards"):
        (view / name).symlink_to(dataset / name)
    (view / "manifest.json").write_text(json.dumps(manifest))
    return view


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


def copied(folder: Path, presses: int, contact: bool, suffix: str = "") -> Path:
    """A bundle with the first presses of another one alone, ready to be taught with them."""
    own = folder.with_name(f"{folder.name}-{suffix or presses}")
    names = ["finger.toml"]
    if presses:
        names += [f"teach/presses/{name}" for name in ("atlas.json", "raster.npz", "progress/campaign.json")]
    names += ["skin.json", "fit.json"]
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
        # Of several trainings the newest: presses that were solved later change what is learnt.
        runs = (folder / "teach/runs").glob(f"{name}-????????????/history.csv")
        history = max(runs, key=lambda path: path.stat().st_mtime)
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


def errors(models: dict, presses: Path, contact: Path | None, finger: Path | None, similarity: bool) -> dict:
    """Errors of networks on the held-out presses of a dataset; without a finger, of the default one."""
    export = program("MODEL_EXPORT", "model-export")
    also = ["--similarity"] if similarity else []
    card = asked(export, "--json", "evaluate", models["pressure_to_sed"], presses, *also)["card"]
    found = {"states": card["metrics"]["samples"], "pressure_to_sed": card["metrics"]["relative_l2"]}
    found |= {"pose_to_sed": None, "pose_to_pressure": None}
    if contact:
        words = ["contact", contact, presses, *(["--finger", finger] if finger else [])]
        words += ["--method", METHOD, "--network", models["pose_to_sed"]]
        (row,) = asked(export, "--json", *words, *also)
        for key, of in (("pose_to_sed", "sed"), ("pose_to_pressure", "pressure")):
            found[key] = dict(zip(("median", "p95"), row[of], strict=True))
    return found


def planned(folder: Path, presses: int, *more) -> Path:
    """The campaign of a bundle, of at least so many presses."""
    campaign = folder / "teach/campaign.toml"
    if not campaign.is_file() or tomllib.loads(campaign.read_text())["presses"] < presses:
        run(program("FE_DATAGEN", "fe-datagen"), "finger", "teach", folder, "--plan", "--presses", presses, *more)
    return campaign


def held_out(options, name: str) -> Path:
    """The held-out presses of a finger, solved."""
    folder = copied(bundle(options.out, name), 0, contact=False, suffix="held-out")
    campaign = planned(folder, JUDGED_BY, "--campaign", judges_campaign(options.out))
    presses = folder / "teach/presses"
    words = ("generate", campaign, "--out", presses, "--threads", options.threads)
    run(program("FE_DATAGEN", "fe-datagen"), *words, accepted=(0, DROPPED))
    return judge(presses, list(range(JUDGED_BY)), folder / "judge")


def solve(options) -> None:
    for name in options.fingers:
        held_out(options, name)
        folder = bundle(options.out, name)
        if not options.presses:
            continue
        campaign = planned(folder, max(COUNTS[-1], options.presses))
        slices = tomllib.loads(campaign.read_text())["presses"] // TOGETHER
        for k in range(-(-options.presses // TOGETHER)):
            words = ("--out", folder / "teach/presses", "--threads", options.threads, "--slice", f"{k + 1}/{slices}")
            run(program("FE_DATAGEN", "fe-datagen"), "generate", campaign, *words, accepted=(0, DROPPED))


def measured(options, name: str) -> dict:
    datagen = program("FE_DATAGEN", "fe-datagen")
    networks, contact = defaults(), not options.without_contact
    if not contact:
        networks["pose_to_sed"] = networks["pressure_to_sed"]
    folder = bundle(options.out, name)
    counts = [count for count in COUNTS if count <= min(solved(folder), options.presses)]
    contact_hours = built(folder) if contact else 0.0
    on = (held_out(options, name), folder / "finger.contact" if contact else None, folder)
    start = {kind: MODELS / f"{network}.onnx" for kind, network in networks.items()}
    nothing = {"presses": 0, "contact": contact_hours, "training": 0.0}
    rows = [{"presses": 0, "learnt": 0, "core_hours": nothing, **errors(start, *on, True)}]
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
        rows.append({"presses": count, "learnt": learnt, "core_hours": took, **errors(own, *on, False)})
    own_judge = judge(JUDGES, [press["id"] for press in judges()], options.out / "judge")
    default = errors(start, own_judge, MODELS / "finger.contact" if contact else None, None, False)
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
    for name in options.fingers:
        text = json.dumps(measured(options, name), indent=2) + "\n"
        (options.out / f"{name}.json").write_text(text)
    report(options)


def report(options) -> None:
    files = (options.out / f"{name}.json" for name in options.fingers)
    found = [json.loads(file.read_text()) for file in files if file.is_file()]
    if not found:
        sys.exit(f"{options.out}: nothing is measured")
    (options.out / "fingers.md").write_text(table(found))
    plot(found, options.out / "fingers.svg")
    print(table(found))


def main() -> None:
    names = sorted(path.stem for path in FINGERS.glob("*.toml"))
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("command", choices=("solve", "measure", "report"))
    parser.add_argument("fingers", nargs="*", default=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--out", type=Path, default=ROOT / "out/fingers", help="folder of bundles, older ones go on")
    parser.add_argument("--presses", type=int, default=COUNTS[-1], help="solve so many; measure at most so many, 0: similarity alone")
    parser.add_argument("--threads", default="1", help="presses at a time, and threads of a training")
    parser.add_argument("--without-contact", action="store_true", help="pressure to SED alone")
    options = parser.parse_args()
    options.out = options.out.resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    {"solve": solve, "measure": measure, "report": report}[options.command](options)


if __name__ == "__main__":
    main()
