"""Would more data help? One network trained on more and more indentations, each judged alike."""

from __future__ import annotations

import io
import json
import math
import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset, fewer, validation_split
from papilla_trainer.errors import TrainerError, UsageError
from papilla_trainer.export import export_run
from papilla_trainer.files import write_atomic, write_json
from papilla_trainer.joined import JoinedDataset
from papilla_trainer.report import write_csv
from papilla_trainer.start import Start
from papilla_trainer.training import Trainer

FIGURES = ("relative_l2", "far_field_relative_l2")
PROGRAM_VARIABLE = "MODEL_EXPORT"


@dataclass(frozen=True)
class Jury:
    """A set that each network is judged on: a dataset, or its held-out part."""

    name: str
    directory: Path
    split: str


def juries(parts: list[Dataset], others: list[Dataset]) -> list[Jury]:
    """The held-out indentations of what is trained on, and all indentations of ``others``."""
    trained = {part.dataset_sha256 for part in parts}
    own = [Jury(f"{p.directory.name}, held out", p.directory, "test") for p in parts]
    for other in others:
        if other.dataset_sha256 in trained:
            raise UsageError(f"--judge {other.directory}: it is trained on")
        own.append(Jury(other.directory.name, other.directory, "all"))
    return own


def judged(model: Path, jury: Jury, program: str | None) -> dict[str, Any]:
    """The model's errors as `model-export evaluate` measures them."""
    named = program or os.environ.get(PROGRAM_VARIABLE) or "model-export"
    path = shutil.which(named)
    if path is None:
        raise UsageError(
            f"there is no program {named!r}, which measures the networks: build it with `cargo "
            "build --release -p papilla-model-export` and name it by --model-export or "
            f"{PROGRAM_VARIABLE} (target/release/model-export)"
        )
    command = [path, "evaluate", str(model), str(jury.directory), "--split", jury.split, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode != 0:
        raise TrainerError(f"{' '.join(command)} failed: {done.stderr.strip()}")
    metrics: dict[str, Any] = json.loads(done.stdout)["card"]["metrics"]
    return metrics


def learning_curve(
    parts: list[Dataset],
    others: list[Dataset],
    config: TrainConfig,
    presses: list[int],
    out: Path,
    bar: Callable[[int, int, int], Any],
    program: str | None = None,
    start: Start | None = None,
) -> list[dict[str, Any]]:
    """A row for each number of indentations and each jury; ``bar`` shows a run.

    ``program``: model-export; without it ``MODEL_EXPORT`` names it, else it is looked for in
    ``PATH``. ``start``: every run begins with its weights.
    """
    dataset = parts[0] if len(parts) == 1 else JoinedDataset(parts)
    aside = config.validation_count(len(dataset.train_ids))
    fit_ids, _ = validation_split(dataset.train_ids, aside, config.seed)
    every = sum(dataset.presses[i].samples for i in fit_ids)
    panel = juries(parts, others)
    rows = []
    for count in sorted(set(presses)):
        if not 2 <= count <= len(fit_ids):
            raise UsageError(f"--presses {count}: from 2 to the {len(fit_ids)} there are")
        samples = sum(dataset.presses[i].samples for i in fewer(fit_ids, count, config.seed))
        # As many steps on few samples as on all.
        epochs = math.ceil(config.epochs * every / samples)
        settings = replace(config, train_presses=count, epochs=epochs)
        run = out / f"presses-{count}"
        trainer = Trainer(dataset, settings, run, resume=True, start=start)
        with bar(trainer.state.epoch, epochs, samples) as progress:
            state = trainer.fit(progress.listen)
        model = export_run(run, run / f"{config.network}.onnx")
        for jury in panel:
            metrics = judged(model, jury, program)
            row = {"presses": count, "samples": samples, "epochs": epochs}
            row |= {"seconds": round(state.seconds, 1), "judged_on": jury.name}
            row |= {f"{f}_{k}": v for f in FIGURES for k, v in metrics.get(f, {}).items()}
            rows.append(row)
    write_json(out / "curve.json", {"network": config.network, "rows": rows})
    write_csv(out / "curve.csv", rows)
    _plot(out / "curve.svg", config.network, rows)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """Rows as Markdown, errors in percent."""
    lines = [
        "| presses | samples | judged on | relative L2 | p95 | far field | p95 |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        errors = [row.get(f"{f}_{k}") for f in FIGURES for k in ("median", "p95")]
        cells = " | ".join("-" if e is None else f"{100 * e:.2f} %" for e in errors)
        lines.append(f"| {row['presses']} | {row['samples']} | {row['judged_on']} | {cells} |")
    return "\n".join(lines)


def _plot(path: Path, network: str, rows: list[dict[str, Any]]) -> None:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogFormatter

    figure = Figure(figsize=(8.4, 4.6), layout="constrained")
    FigureCanvasSVG(figure)
    axes = figure.add_subplot()
    for k, jury in enumerate(dict.fromkeys(row["judged_on"] for row in rows)):
        own = [row for row in rows if row["judged_on"] == jury]
        samples = [row["samples"] for row in own]
        for statistic, style in (("median", "o-"), ("p95", "o:")):
            errors = [100 * row[f"relative_l2_{statistic}"] for row in own]
            label = f"{jury}, {statistic}"
            axes.loglog(samples, errors, style, color=f"C{k}", label=label, markersize=4)
    axes.set(
        title=f"{network}: error against training samples",
        xlabel="training samples",
        ylabel="relative L2, %",
    )
    axes.grid(visible=True, which="both", alpha=0.25)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(LogFormatter())
        axis.set_minor_formatter(LogFormatter(minor_thresholds=(2, 0.5)))
    figure.legend(fontsize="small", loc="outside right upper")
    picture = io.BytesIO()
    figure.savefig(picture, format="svg", metadata={"Date": None})
    write_atomic(path, picture.getvalue())
