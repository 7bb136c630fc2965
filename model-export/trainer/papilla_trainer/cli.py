"""The command line: train, evaluate, export, check."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from papilla_trainer import __version__
from papilla_trainer.errors import CheckError, TrainerError

if TYPE_CHECKING:
    from papilla_trainer.training import Progress

INTERRUPTED = 130

_DESCRIPTION = """\
Trains a network that maps fingertip pressure to strain energy density (SED) and exports it.

From a dataset to a model that the server loads:

  python -m papilla_trainer train    --dataset data/s1 --network s1-base8 --out runs/s1-base8
  python -m papilla_trainer export   runs/s1-base8 --out models/s1-base8.onnx
  python -m papilla_trainer check    models/s1-base8.onnx --dataset data/s1 --run runs/s1-base8

`COMMAND --help` explains each one."""

_EPILOG = """\
exit codes: 0 done; 1 a check failed or training diverged; 2 wrong arguments; 3 unreadable or
damaged dataset; 4 the run directory does not fit; 130 interrupted (go on with --resume)."""

_TRAIN = """\
Trains S1's U-Net (two encoding and two decoding stages, MSE on max-normalised maps, Adam) on the
training presses of a dataset. A tenth of the *training* presses is set aside to choose the epoch
by; the test presses are touched once, after training, for the metrics.

Writes to --out: checkpoint.pt (after each epoch, atomically), history.csv, loss.png, metrics.json
and metrics.csv (one row for each held-out sample). Stop it at any time: the same command with
--resume goes on from the last whole epoch and ends in the same weights, bit for bit."""

_EVALUATE = """\
Measures a run on the held-out presses again (train does so at its end): relative L2, far field
(where SED < 10 % of its maximum), peak, total energy, SSIM; median and bad end. Use it after an
interrupted run, or to measure the last weights instead of the best."""

_EXPORT = """\
Writes a run's model as ONNX (opset 17; Conv, Relu, MaxPool, ConvTranspose, Concat, Mul only).
Input `pressure_pa` and output `sed_j_per_m3` are float32 [1, 1, 224, 224] in physical units:
scaling, the clamp at zero and the interface mask are inside the graph, and the file carries its
atlas hash, effects, scales, training settings and held-out metrics as metadata."""

_CHECK = """\
Checks an exported model: legal ONNX with strict shape inference, plain operators, the interface
and metadata that the engine expects, finite and non-negative output that is zero outside the
patch; with --run, ONNX Runtime against PyTorch (1e-5 of the maximum at most). --reference writes
inputs and ONNX Runtime's outputs of held-out samples, for `model-export evaluate` to compare its
own engine with."""


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        result, text = options.run(options)
    except TrainerError as error:
        _report_error(error, as_json=options.json)
        return error.exit_code
    except KeyboardInterrupt:
        print("interrupted; the same command with --resume goes on", file=sys.stderr)
        return INTERRUPTED
    print(json.dumps(result) if options.json else text)
    return 0


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        "papilla_trainer", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=raw
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, summary: str, description: str, run: Any) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name, help=summary, description=description, epilog=_EPILOG, formatter_class=raw
        )
        sub.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        sub.set_defaults(run=run)
        return sub

    _train_arguments(command("train", "train a network on a dataset", _TRAIN, _train))

    evaluate = command("evaluate", "measure a run on the held-out presses", _EVALUATE, _evaluate)
    evaluate.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="the --out of train")
    _dataset_argument(evaluate)
    _weights_argument(evaluate)

    export = command("export", "write a run's model as ONNX", _EXPORT, _export)
    export.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="the --out of train")
    export.add_argument("--out", type=Path, required=True, metavar="FILE.onnx")
    export.add_argument("--name", help="name of the model (default: the file's stem)")
    _weights_argument(export)

    check = command("check", "check an exported model", _CHECK, _check)
    check.add_argument("model", type=Path, metavar="FILE.onnx")
    _dataset_argument(check)
    check.add_argument("--run", dest="run_dir", type=Path, metavar="RUN_DIR")
    check.add_argument("--reference", type=Path, metavar="FILE.npz")
    check.add_argument("--samples", type=int, default=8, help="held-out samples (default 8)")
    return parser


def _train_arguments(parser: argparse.ArgumentParser) -> None:
    _dataset_argument(parser)
    add = parser.add_argument
    add("--network", default="s1-base8", help="s1-baseN: N channels in the first stage (8)")
    add("--out", type=Path, required=True, metavar="RUN_DIR", help="directory of the run")
    add("--resume", action="store_true", help="go on with the run in RUN_DIR if there is one")
    add("--epochs", type=int, default=40, help="passes over the training presses (40)")
    add("--seed", type=int, default=0, help="of initial weights, order and validation presses (0)")
    add("--batch", type=int, default=4, help="samples in one step (4)")
    add("--learning-rate", type=float, default=1e-3, help="Adam's (S1: 1e-3)")
    add(
        "--schedule",
        choices=("constant", "cosine"),
        default="constant",
        help="learning rate over the epochs (S1: constant; cosine falls to zero at the last)",
    )
    add(
        "--precision",
        choices=("f32", "bf16"),
        default="f32",
        help="bf16: mixed precision, faster where CPU or GPU has bfloat16; weights stay f32",
    )
    add(
        "--validation-presses",
        type=int,
        metavar="N",
        help="training presses set aside to choose the epoch (default a tenth; 0: use the last)",
    )
    add("--threads", type=int, metavar="N", help="CPU threads (default: all that are allowed)")
    add("--device", default="auto", help="auto, cpu, cuda, cuda:1, ... (auto)")


def _dataset_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--dataset",
        type=Path,
        required=True,
        metavar="DIR",
        help="what `fe-datagen generate` wrote",
    )


def _weights_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--weights",
        choices=("best", "last"),
        default="best",
        help="of the epoch with the least validation loss, or of the last (best)",
    )


def _train(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.config import TrainConfig
    from papilla_trainer.dataset import Dataset
    from papilla_trainer.evaluation import evaluate_run
    from papilla_trainer.report import metrics_table, plot_history
    from papilla_trainer.training import Trainer

    config = TrainConfig(
        **{name: getattr(options, name) for name in TrainConfig.__dataclass_fields__}
    )
    dataset = Dataset(options.dataset)
    trainer = Trainer(dataset, config, options.out, resume=options.resume)
    with _Bar(trainer.state.epoch, config.epochs, len(trainer.fit_samples)) as bar:
        try:
            state = trainer.fit(bar.listen)
        finally:
            if trainer.state.history:
                title = f"{config.network}, {len(trainer.fit_samples)} training samples"
                history = trainer.state.history
                plot_history(options.out, history, title, trainer.state.best_epoch)
    metrics = evaluate_run(options.out, dataset)
    rates = sorted(line["samples_per_s"] for line in state.history)
    result = {
        "run": str(options.out),
        "network": config.network,
        "epochs": state.epoch,
        "epoch_chosen": state.best_epoch,
        "train_mse": state.history[-1]["train_mse"],
        "validation_mse": _finite(state.best_loss),
        "seconds": round(state.seconds, 1),
        "samples_per_s": round(rates[len(rates) // 2], 2),
        "metrics": metrics,
    }
    text = (
        f"{config.network}: {state.epoch} epochs in {state.seconds:.0f} s, epoch "
        f"{state.best_epoch} chosen\nheld-out presses ({metrics['samples']} samples of "
        f"{metrics['presses']} presses):\n{_table(metrics, metrics_table)}\n"
        f"next: python -m papilla_trainer export {options.out} --out models/{config.network}.onnx"
    )
    return result, text


def _evaluate(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.dataset import Dataset
    from papilla_trainer.evaluation import evaluate_run
    from papilla_trainer.report import metrics_table

    metrics = evaluate_run(options.run_dir, Dataset(options.dataset), options.weights)
    return metrics, _table(metrics, metrics_table)


def _export(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.export import export_run

    out = export_run(options.run_dir, options.out, options.name, options.weights)
    size = out.stat().st_size
    return {"model": str(out), "bytes": size}, f"{out}: {size} bytes"


def _check(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.check import check_model
    from papilla_trainer.dataset import Dataset

    if options.samples < 1:
        raise CheckError(f"--samples must be at least 1, not {options.samples}")
    report = check_model(
        options.model, Dataset(options.dataset), options.run_dir, options.reference, options.samples
    )
    if report.failures:
        raise CheckError(f"{options.model}: " + "; ".join(report.failures))
    operators = ", ".join(f"{count} {name}" for name, count in sorted(report.operators.items()))
    lines = [
        f"{report.model}: legal ONNX, opset {report.opset}, {report.bytes} bytes ({operators})",
        f"{report.samples} held-out samples: finite, >= 0, zero outside the patch",
    ]
    if report.torch_difference_max is not None:
        lines.append(f"ONNX Runtime - PyTorch: {report.torch_difference_max:.1e} of the maximum")
    if report.reference:
        lines.append(f"reference written to {report.reference}")
    return vars(report), "\n".join(lines)


class _Bar:
    """Progress over all epochs (rate, time left) and one line for each epoch, on stderr."""

    def __init__(self, done: int, epochs: int, samples: int) -> None:
        from tqdm import tqdm

        self.epochs = epochs
        self.bar = tqdm(
            total=epochs * samples,
            initial=done * samples,
            unit="sample",
            dynamic_ncols=True,
            smoothing=0.05,
            # A log file gets the lines of the epochs only.
            disable=None if "PAPILLA_PROGRESS" not in os.environ else False,
        )

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.close()

    def listen(self, progress: Progress) -> None:
        """Advance the bar or print an epoch's line."""
        self.bar.update(progress.samples)
        if progress.epoch is not None:
            line = progress.epoch
            left = line["seconds"] * (self.epochs - line["epoch"])
            self.bar.write(
                f"epoch {line['epoch']:.0f}/{self.epochs}: training MSE {line['train_mse']:.3e}, "
                f"validation MSE {line['validation_mse']:.3e}, "
                f"{line['samples_per_s']:.1f} samples/s, about {left / 60:.1f} min left",
                file=sys.stderr,
            )


def _table(metrics: dict[str, Any], render: Any) -> str:
    rendered: str = render({k: v for k, v in metrics.items() if isinstance(v, dict)})
    return rendered


def _finite(value: float) -> float | None:
    return value if value == value else None


def _report_error(error: TrainerError, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"error": {"code": error.code, "message": str(error)}}))
    print(f"error: {error}", file=sys.stderr)
