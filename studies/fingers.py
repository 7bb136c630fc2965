#!/usr/bin/env python3
"""What presses of a finger buy: error of its networks against the number of presses learnt from.

    python studies/fingers.py solve [NAME...]     solves the presses of studies/fingers/NAME.toml: core hours
    python studies/fingers.py measure [NAME...]   teaches each finger with the first 10, 25, 50 and 100 of them,
                                                  and writes the table and the plot

A finger's bundle stands in --out (out/fingers) and goes on where it was stopped. `solve` may be done
by `fe-datagen generate` on a cluster instead: the campaign is OUT/NAME/teach/campaign.toml. All
networks of a finger are judged on the same held-out presses: those of as many as are solved. Before
the first one is learnt from, that is the default finger's network by similarity alone.

Needs numpy, matplotlib, the trainer's requirements, and the programs fe-datagen and model-export:
FE_DATAGEN and MODEL_EXPORT, or PATH. Run it in the root of the repository.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FINGERS = ROOT / "studies/fingers"
COUNTS = (10, 25, 50, 100)
METHOD = "second order, pixels"
BAR = 1.3


def program(variable: str, name: str) -> str:
    found = shutil.which(os.environ.get(variable, name))
    if found is None:
        sys.exit(f"there is no program {name}: build it, and name it by {variable}")
    return found


def run(*words) -> None:
    words = [str(word) for word in words]
    print("+", *words, file=sys.stderr)
    subprocess.run(words, check=True, cwd=ROOT)


def asked(*words):
    """What a command prints as JSON."""
    words = [str(word) for word in words]
    print("+", *words, file=sys.stderr)
    return json.loads(subprocess.run(words, check=True, cwd=ROOT, stdout=subprocess.PIPE).stdout)


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
    shards = folder / "teach/presses/shards"
    count = 0
    while (shards / f"press-{count:05}.npz").is_file():
        count += 1
    return count


def beginning(folder: Path, presses: int, contact: bool) -> Path:
    """A bundle with the first presses of another one alone, ready to be taught with them."""
    own = folder.with_name(f"{folder.name}-{presses}")
    names = ["finger.toml", "teach/presses/atlas.json", "teach/presses/raster.npz"]
    names += ["teach/presses/progress/campaign.json"]
    names += ["atlas.json", "finger.contact"] if contact else []
    names += [name for name in ("skin.json",) if (folder / name).is_file()]
    for press in range(presses):
        names += [f"teach/presses/shards/press-{press:05}.npz"]
        names += [f"teach/presses/progress/press-{press:05}.json"]
    for name in names:
        (own / name).parent.mkdir(parents=True, exist_ok=True)
        if not (own / name).is_file():
            shutil.copyfile(folder / name, own / name)
    return own


def hours(folder: Path, presses: int) -> float:
    """Core hours of the first presses."""
    records = (folder / f"teach/presses/progress/press-{i:05}.json" for i in range(presses))
    return sum(json.loads(r.read_text()).get("processor_s") or 0.0 for r in records) / 3600.0


def errors(model: Path, folder: Path, contact: bool, similarity: bool) -> dict:
    """Errors of a network on the held-out presses of a bundle."""
    export, presses = program("MODEL_EXPORT", "model-export"), folder / "teach/presses"
    also = ["--similarity"] if similarity else []
    card = asked(export, "--json", "evaluate", model, presses, *also)["card"]["metrics"]
    found = {"states": card["samples"], "pressure_to_sed": card["relative_l2"], "pose_to_sed": None}
    if contact:
        words = ("contact", folder / "finger.contact", presses, "--finger", folder)
        (row,) = asked(export, "--json", *words, "--method", METHOD, "--network", model, *also)
        found["pose_to_sed"] = dict(zip(("median", "p95"), row["sed"], strict=True))
    return found


def solve(options) -> None:
    datagen = program("FE_DATAGEN", "fe-datagen")
    for name in options.fingers:
        folder = bundle(options.out, name)
        # Its campaign is the same however far it is solved.
        run(datagen, "finger", "teach", folder, "--plan", "--presses", max(COUNTS))
        campaign = folder / "teach/campaign.toml"
        run(datagen, "generate", campaign, "--out", folder / "teach/presses", "--threads", options.threads)


def measured(options, name: str) -> dict:
    datagen = program("FE_DATAGEN", "fe-datagen")
    folder, contact = bundle(options.out, name), not options.without_contact
    there = solved(folder)
    counts = [count for count in COUNTS if count <= there]
    if not counts:
        sys.exit(f"{folder}: {there} presses are solved, and {COUNTS[0]} are the fewest")
    if contact and not (folder / "finger.contact").is_file():
        run(datagen, "finger", "build", folder)
    # The dataset of all that is solved: its held-out presses are the judge.
    whole = counts[-1]
    campaign = folder / "teach/campaign.toml"
    text = re.sub(r"^presses = .*$", f"presses = {whole}", campaign.read_text(), flags=re.MULTILINE)
    judge = folder / "teach/judge.toml"
    judge.write_text(text)
    run(datagen, "generate", judge, "--out", folder / "teach/presses", "--threads", "1")
    start = ROOT / f"models/{options.network}.onnx"
    own = json.loads(start.with_suffix(".json").read_text())["metrics"]["relative_l2"]
    rows = [{"presses": 0, "learnt": 0, "core_hours": 0.0, **errors(start, folder, contact, True)}]
    for count in counts:
        part = beginning(folder, count, contact)
        words = ["--presses", count, "--network", options.network, "--threads", options.threads]
        words += ["--json"] + ([] if contact else ["--without-contact"])
        report = asked(datagen, "finger", "teach", part, *words)
        row = {
            "presses": count,
            "learnt": report["presses"] - report["held_out"],
            "core_hours": hours(folder, count) + report["networks"][0]["training_seconds"] / 3600.0,
        }
        rows.append(row | errors(part / f"{options.network}.onnx", folder, contact, False))
    return {"finger": name, "network": options.network, "default_finger": own, "rows": rows}


def percent(spread) -> str:
    return "-" if spread is None else f"{100 * spread['median']:.1f} / {100 * spread['p95']:.1f}"


def table(found: list[dict]) -> str:
    lines = [
        "| finger | presses | of these learnt from | core hours | pressure to SED, % | pose to SED, % "
        "| over the default finger's own error |",
        "|---|---|---|---|---|---|---|",
    ]
    for of in found:
        for row in of["rows"]:
            ratio = row["pressure_to_sed"]["median"] / of["default_finger"]["median"]
            cells = (of["finger"], row["presses"], row["learnt"], f"{row['core_hours']:.2f}")
            errors = (percent(row["pressure_to_sed"]), percent(row["pose_to_sed"]), f"{ratio:.2f}")
            lines.append("| " + " | ".join(map(str, (*cells, *errors))) + " |")
    return "\n".join(lines) + "\n"


def plot(found: list[dict], path: Path) -> None:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 4.2), layout="constrained")
    FigureCanvasSVG(figure)
    left, right = figure.subplots(1, 2, sharey=True)
    for k, of in enumerate(found):
        for what, style in (("pressure_to_sed", "o-"), ("pose_to_sed", "s:")):
            rows = [row for row in of["rows"] if row[what] is not None]
            medians = [100 * row[what]["median"] for row in rows]
            label = f"{of['finger']}, {what.replace('_', ' ').replace('sed', 'SED')}"
            for axes, key in ((left, "presses"), (right, "core_hours")):
                axes.plot([row[key] for row in rows], medians, style, color=f"C{k}", label=label)
    bar = 100 * BAR * found[0]["default_finger"]["median"]
    for axes, words in ((left, "presses"), (right, "core hours")):
        axes.axhline(bar, color="0.6", linestyle="--", label=f"{BAR} times the default finger's own")
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
    parser.add_argument("--network", default="small")
    parser.add_argument("--threads", default="1", help="presses at a time, and threads of a training")
    parser.add_argument("--without-contact", action="store_true", help="pressure to SED alone")
    options = parser.parse_args()
    {"solve": solve, "measure": measure}[options.command](options)


if __name__ == "__main__":
    main()
