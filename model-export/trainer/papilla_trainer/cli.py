"""The command line: train, curve, export, mean, check, operator, half-space."""

from __future__ import annotations

import argparse
import json
import os
import sys
from typing import TYPE_CHECKING, Any

from papilla_trainer.arguments import Command, make_parser
from papilla_trainer.errors import CheckError, TrainerError, UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from papilla_trainer.config import TrainConfig
    from papilla_trainer.dataset import Dataset
    from papilla_trainer.start import Start
    from papilla_trainer.training import Progress

INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    options = make_parser(_COMMANDS).parse_args(arguments)
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


def _train(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.report import plot_history
    from papilla_trainer.training import Trainer

    config, start = _config(options)
    dataset = _datasets(options, options.dataset)
    trainer = Trainer(dataset, config, options.out, resume=options.resume, start=start)
    with _Bar(trainer.state.epoch, config.epochs, trainer.epoch_samples) as bar:
        try:
            state = trainer.fit(bar.listen)
        finally:
            if trainer.state.history:
                title = f"{config.network}, {len(trainer.fit_samples)} training samples"
                history = trainer.state.history
                plot_history(options.out, history, title, trainer.state.best_epoch)
    rates = sorted(line["samples_per_s"] for line in state.history)
    result = {
        "run": str(options.out),
        "network": config.network,
        "epochs": state.epoch,
        "epoch_chosen": state.best_epoch,
        "train_loss": state.history[-1]["train_loss"],
        "validation_loss": _finite(state.best_loss),
        "seconds": round(state.seconds, 1),
        "samples_per_s": round(rates[len(rates) // 2], 2),
    }
    text = (
        f"{config.network}: {state.epoch} epochs in {state.seconds:.0f} s, epoch "
        f"{state.best_epoch} chosen\n"
        f"next: python -m papilla_trainer export {options.out} "
        f"--onnx {options.out}/{config.network}.onnx"
    )
    return result, text


def _curve(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.curve import learning_curve, table
    from papilla_trainer.dataset import Dataset
    from papilla_trainer.maps import Store

    config, start = _config(options)
    store = Store(options.maps, options.fe_datagen)
    rows = learning_curve(
        [Dataset(directory, store) for directory in options.dataset],
        [Dataset(directory, store) for directory in options.judge],
        config,
        options.presses,
        options.out,
        _Bar,
        options.model_export,
        start,
    )
    return {"network": config.network, "rows": rows}, table(rows)


def _export(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.export import export_run

    out = export_run(options.run_dir, options.onnx, options.name, options.weights)
    size = out.stat().st_size
    return {"model": str(out), "bytes": size}, f"{out}: {size} bytes"


def _check(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.check import check_model

    if options.samples < 1:
        raise CheckError(f"--samples must be at least 1, not {options.samples}")
    report = check_model(
        options.model,
        _datasets(options, options.dataset),
        options.run_dirs,
        options.reference,
        options.samples,
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


def _mean(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.mean import write_mean

    datasets = _datasets(options, options.dataset)
    finer = options.finer and _datasets(options, [options.finer])
    result = write_mean(options.run_dirs, datasets, finer, options.onnx, options.name)
    return result, _finer_text(result.get("finer")) + _written_text(result)


def _finer_text(found: dict[str, Any] | None) -> str:
    if found is None:
        return ""
    plain, corrected = (
        f"{100 * of['median']:.2f} / {100 * of['p95']:.2f} %"
        for of in (found["relative_l2_plain"], found["relative_l2_corrected"])
    )
    return (
        f"multiplied by {found['factor']:.4f}: {plain} (median / p95) off {found['samples']} "
        f"samples of the finer mesh, {corrected} each with the factor of the others\n"
    )


def _operator(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.comparison.untrained import write_operator

    _require_rank(options)
    result = write_operator(
        options.operator,
        _datasets(options, options.dataset),
        options.rank,
        options.near,
        options.onnx,
        options.name,
    )
    return result, _written_text(result)


def _half_space(options: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from papilla_trainer.comparison.half_space import HalfSpace
    from papilla_trainer.comparison.untrained import write_half_space

    _require_rank(options)
    body = HalfSpace(options.youngs_modulus_pa, options.poissons_ratio, options.depth_mm)
    if body.youngs_modulus_pa <= 0 or not 0 <= body.poissons_ratio < 0.5 or body.depth_mm <= 0:
        raise UsageError("modulus and depth must be positive, Poisson's ratio in 0 .. 0.5")
    result = write_half_space(
        body,
        _datasets(options, options.dataset),
        options.rank,
        options.near,
        options.onnx,
        options.name,
    )
    return result, _written_text(result)


def _require_rank(options: argparse.Namespace) -> None:
    if options.rank < 2 or options.rank % 2 or options.near < 0:
        raise UsageError("--rank must be even and positive, --near not negative")


def _written_text(result: dict[str, Any]) -> str:
    return f"{result['model']}: {result['bytes']} bytes"


def _config(options: argparse.Namespace) -> tuple[TrainConfig, Start | None]:
    from papilla_trainer.config import TrainConfig
    from papilla_trainer.start import Start

    start = options.start and Start.read(options.start)
    own = {name: getattr(options, name) for name in TrainConfig.__dataclass_fields__}
    own["start"] = start and start.record()
    own["network"] = options.network or (start.spec.name if start else TrainConfig.network)
    return TrainConfig(**own), start


def _datasets(options: argparse.Namespace, folders: list[Path]) -> Dataset:
    from papilla_trainer.joined import open_datasets
    from papilla_trainer.maps import Store

    return open_datasets(folders, Store(options.maps, options.fe_datagen))


_COMMANDS: dict[str, Command] = {
    "train": _train,
    "curve": _curve,
    "export": _export,
    "mean": _mean,
    "check": _check,
    "operator": _operator,
    "half-space": _half_space,
}


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
                f"epoch {line['epoch']:.0f}/{self.epochs}: training loss {line['train_loss']:.3e}, "
                f"validation loss {line['validation_loss']:.3e}, "
                f"{line['samples_per_s']:.1f} samples/s, about {left / 60:.1f} min left",
                file=sys.stderr,
            )


def _finite(value: float) -> float | None:
    return value if value == value else None


def _report_error(error: TrainerError, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"error": {"code": error.code, "message": str(error)}}))
    print(f"error: {error}", file=sys.stderr)
