"""What the command line understands: commands, options, help."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from papilla_trainer import __version__

Command = Callable[[argparse.Namespace], tuple[dict[str, Any], str]]

_DESCRIPTION = """\
Trains a network that maps fingertip pressure to strain energy density (SED) and exports it.

From a dataset to a model that the server loads:

  python -m papilla_trainer train --dataset data/broad-graded --network s1-base8 --out runs/s1-base8
  python -m papilla_trainer export   runs/s1-base8 --onnx runs/s1-base8/s1-base8.onnx
  python -m papilla_trainer check    runs/s1-base8/s1-base8.onnx --dataset data/broad-graded \\
                                     --run runs/s1-base8

`COMMAND --help` explains each one."""

_EPILOG = """\
exit codes: 0 done; 1 a check failed or training diverged; 2 wrong arguments; 3 unreadable or
damaged dataset; 4 the run directory does not fit; 130 interrupted (go on with --resume)."""

_TRAIN = """\
Trains a network on the training indentations of a dataset. A tenth of them is set aside to choose
the epoch by; the test indentations are not touched.

s1-baseN is the published U-Net on maps (two encoding and two decoding stages, MSE on
max-normalised maps).
map-cC-kK-rR[-hH] works on pixels: C components of strain from a linear map of rank R over the
whole finger and from convolutions over K by K blocks at three resolutions; SED is the sum of their
squares. A correction of width H follows.

Writes to --out: checkpoint.pt (after each epoch, atomically), history.csv and loss.png. Stop it at
any time: the same command with --resume goes on from the last whole epoch and ends in the same
weights, bit for bit. `model-export evaluate` measures what `export` writes."""

_EXPORT = """\
Writes a run's model as ONNX (opset 17, plain operators only).
Input `pressure_pa` and output `sed_j_per_m3` are float32 [1, 1, 224, 224] in physical units:
scaling, the clamp at zero and the interface mask are inside the graph, and the file carries its
atlas hash, effects, scales and training settings as metadata."""

_MEAN = """\
Writes the mean of several runs' networks as one model: what each errs by itself partly cancels, for
the time of all of them. The runs must have learnt the datasets given. --finer names a dataset
solved on a finer mesh than those: the mean is multiplied by what brings it closest to SED there."""

_CHECK = """\
Checks an exported model: legal ONNX with strict shape inference, plain operators, the interface
and metadata that the engine expects, finite and non-negative output that is zero outside the
patch; with --run, ONNX Runtime against PyTorch (1e-5 of the maximum at most). --reference writes
inputs and ONNX Runtime's outputs of held-out samples, for `model-export evaluate` to compare its
own engine with."""


_OPERATOR = """\
Writes the finger's own linear operator (what `fe-datagen operator` wrote) as a model, without
training: a low-rank part of global reach and, with --near, the exact rest at the nearest vertices.
The dataset's training pressures say which directions matter."""

_HALF_SPACE = """\
Writes the closed form as a model, without training: Boussinesq's stresses in one elastic half-space
under the pressure on the flattened skin (Phillips & Johnson 1981), compressed like an operator."""


_CURVE = """\
Trains the same network on more and more of the training indentations, each time for as many steps
as --epochs are on all of them, and measures every one on the held-out indentations of each dataset
and on all of each --judge: would more data help? What a small set holds is in every larger one.
Takes train's options; --train-presses is set by --presses.

Writes to --out: the runs (presses-N; kept, so that the same command goes on after an
interruption), curve.json, curve.csv and curve.svg."""


def make_parser(commands_to_run: dict[str, Command]) -> argparse.ArgumentParser:
    """The parser; each command's function stands under its name."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        "papilla_trainer", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=raw
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, summary: str, description: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name, help=summary, description=description, epilog=_EPILOG, formatter_class=raw
        )
        sub.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        sub.set_defaults(run=commands_to_run[name])
        return sub

    _train_arguments(command("train", "train a network on a dataset", _TRAIN))

    curve = command("curve", "train on more and more indentations: would more data help?", _CURVE)
    _train_arguments(curve)
    curve.add_argument(
        "--presses", type=int, nargs="+", required=True, metavar="N", help="how many, each a run"
    )
    curve.add_argument(
        "--judge",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="a dataset of which nothing is trained on; may be given again",
    )
    curve.add_argument(
        "--model-export",
        metavar="FILE",
        help="the program that measures errors ($MODEL_EXPORT, else model-export in PATH)",
    )

    export = command("export", "write a run's model as ONNX", _EXPORT)
    export.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="the --out of train")
    export.add_argument("--onnx", type=Path, required=True, metavar="FILE")
    export.add_argument("--name", help="name of the model (default: the file's stem)")
    _weights_argument(export)

    mean = command("mean", "write the mean of several runs as ONNX", _MEAN)
    mean.add_argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR", help="of `train`")
    _model_arguments(mean)
    mean.add_argument("--finer", type=Path, metavar="DIR", help="a dataset of a finer mesh")

    check = command("check", "check an exported model", _CHECK)
    check.add_argument("model", type=Path, metavar="FILE.onnx")
    _dataset_argument(check)
    check.add_argument(
        "--run",
        dest="run_dirs",
        type=Path,
        action="append",
        default=[],
        metavar="RUN_DIR",
        help="that it was exported from (again for each of a mean)",
    )
    check.add_argument("--reference", type=Path, metavar="FILE.npz")
    check.add_argument("--samples", type=int, default=8, help="held-out samples (default 8)")

    operator = command("operator", "write the finger's linear operator as ONNX", _OPERATOR)
    operator.add_argument("operator", type=Path, metavar="OPERATOR.npz")
    _untrained_arguments(operator)
    half_space = command("half-space", "write the closed form as ONNX", _HALF_SPACE)
    _untrained_arguments(half_space)
    add = half_space.add_argument
    add("--youngs-modulus-pa", type=float, default=80e3, help="of the dermis (80e3)")
    add("--poissons-ratio", type=float, default=0.48, help="(0.48)")
    add("--depth-mm", type=float, default=0.2, help="of the interface below the skin (0.2)")
    return parser


def _model_arguments(parser: argparse.ArgumentParser) -> None:
    _dataset_argument(parser)
    parser.add_argument("--onnx", type=Path, required=True, metavar="FILE")
    parser.add_argument("--name", help="name of the model (default: the file's stem)")


def _untrained_arguments(parser: argparse.ArgumentParser) -> None:
    _model_arguments(parser)
    parser.add_argument("--rank", type=int, default=64, help="of the global part, even (64)")
    parser.add_argument(
        "--near", type=int, default=16, help="vertices of the stencil (16; 0: none)"
    )


def _train_arguments(parser: argparse.ArgumentParser) -> None:
    _dataset_argument(parser)
    add = parser.add_argument
    add("--network", help="s1-baseN or map-... (that of --start, else s1-base8)")
    add(
        "--start",
        type=Path,
        metavar="FILE.onnx",
        help="begin with the weights of this exported model, a network on maps, in place of random "
        "ones; it may be of another atlas",
    )
    add("--out", type=Path, required=True, metavar="RUN_DIR", help="directory of the run")
    add("--resume", action="store_true", help="go on with the run in RUN_DIR if there is one")
    add("--epochs", type=int, default=40, help="passes over the training indentations (40)")
    add("--seed", type=int, default=0, help="of weights, order and validation indentations (0)")
    add("--batch", type=int, default=4, help="samples in one step (4)")
    add("--learning-rate", type=float, default=1e-3, help="Adam's (U-Net paper: 1e-3)")
    add(
        "--schedule",
        choices=("constant", "cosine"),
        default="constant",
        help="learning rate over the epochs (U-Net paper: constant; cosine falls to zero)",
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
        help="training indentations set aside to choose the epoch (a tenth; 0: use the last)",
    )
    add(
        "--loss",
        choices=("auto", "mse", "relative"),
        default="auto",
        help="mse: the U-Net paper's, of max-normalised maps; relative: squared relative L2 of "
        "each sample, the far field once more (auto: mse for s1-*, else relative)",
    )
    add("--far-weight", type=float, default=0.2, help="of the far field in `relative` (0.2)")
    add(
        "--shift-px",
        type=int,
        default=0,
        metavar="N",
        help="move each sample by up to N rows and columns in each step, wide contacts by less "
        "(networks on maps; 0)",
    )
    add(
        "--contact",
        action="append",
        default=[],
        metavar="FILE.npz",
        help="learn the same SED from this pressure too, which `model-export contact-maps` writes "
        "(networks on maps; again for each dataset)",
    )
    add(
        "--contact-alone",
        action="store_true",
        help="learn from the pressure of --contact alone, and not from that of the simulations",
    )
    add(
        "--pseudo-labels",
        action="append",
        default=[],
        metavar="FILE.npz",
        help="learn these pairs too, which `model-export pseudo-labels` writes: what another "
        "network answers to pressures that were not simulated (networks on maps; may be given "
        "again)",
    )
    add(
        "--pseudo-samples",
        type=int,
        metavar="N",
        help="see N of these pairs an epoch, drawn anew each time (all)",
    )
    add(
        "--train-presses",
        type=int,
        metavar="N",
        help="fit to N of the training indentations only, drawn by the seed",
    )
    add(
        "--dataset-samples",
        type=int,
        metavar="N",
        help="of each dataset see N samples an epoch at most, drawn anew each time, and N with "
        "contact's pressure (all)",
    )
    add("--threads", type=int, metavar="N", help="CPU threads (default: all that are allowed)")
    add("--device", default="auto", help="auto, cpu, cuda, cuda:1, ... (auto)")


def _dataset_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--dataset",
        type=Path,
        action="append",
        required=True,
        metavar="DIR",
        help="what `fe-datagen generate` wrote; give it again to join datasets of one atlas",
    )
    parser.add_argument(
        "--maps",
        type=Path,
        metavar="DIR",
        help="where maps are kept that `fe-datagen dataset maps` drew, and are put if they never "
        "were ($PAPILLA_MAPS, else papilla/maps in the user's cache)",
    )
    parser.add_argument(
        "--fe-datagen",
        metavar="FILE",
        help="the program that draws maps ($FE_DATAGEN, else fe-datagen in PATH)",
    )


def _weights_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--weights",
        choices=("best", "last"),
        default="best",
        help="of the epoch with the least validation loss, or of the last (best)",
    )
