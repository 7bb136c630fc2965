"""What a run leaves for people: its losses as CSV and as a picture."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from papilla_trainer.files import write_atomic

HISTORY_FILE = "history.csv"
PLOT_FILE = "loss.png"


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """Rows of one shape as CSV, atomically."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomic(path, text.getvalue().encode())


def write_history(run_dir: Path, history: list[dict[str, float]]) -> None:
    """The loss of each epoch as CSV."""
    write_csv(run_dir / HISTORY_FILE, history)


def plot_history(run_dir: Path, history: list[dict[str, float]], title: str, best: int) -> None:
    """The loss curves as a picture, logarithmic, with the epoch chosen."""
    # matplotlib costs half a second to import: only whoever plots pays.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    epochs = [line["epoch"] for line in history]
    axes.semilogy(epochs, [line["train_loss"] for line in history], label="training presses")
    validation = [line["validation_loss"] for line in history]
    if all(value == value for value in validation):
        axes.semilogy(epochs, validation, label="validation presses")
        axes.axvline(best, color="0.6", linestyle=":", label=f"epoch chosen ({best})")
    axes.set(title=title, xlabel="epoch", ylabel="loss")
    axes.grid(visible=True, which="both", alpha=0.25)
    axes.legend()
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    write_atomic(run_dir / PLOT_FILE, picture.getvalue())
