"""Checks that an exported model is legal, plain and the same function as the trained network."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from torch import nn

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import CheckError
from papilla_trainer.export import INPUT, OPSET, OUTPUT
from papilla_trainer.files import write_atomic
from papilla_trainer.maps import F32, SIDE_PX
from papilla_trainer.mean import mean_model
from papilla_trainer.serving import chosen_epoch, predict, served_model, spread

OPERATORS = frozenset(
    {
        *(
            "Conv",
            "Relu",
            "MaxPool",
            "ConvTranspose",
            "Concat",
            "Mul",
            "Clip",
            "Constant",
            "ReduceMax",
        ),
        # Networks on faces.
        *("Add", "Cast", "Gather", "MatMul", "ReduceSum", "Reshape", "Slice", "Sub"),
        *("Squeeze", "Tanh", "Unsqueeze"),
        # Networks on maps.
        *("DepthToSpace", "Einsum", "Flatten", "ReduceMean", "Transpose"),
    }
)
METADATA = (
    "format",
    "name",
    "atlas_hash",
    "effects",
    "network",
    "pressure_max_pa",
    "sed_max_j_per_m3",
    "dataset_sha256",
    "training",
)
TOLERANCE = 1e-5


@dataclass
class CheckReport:
    """What was found; ``failures`` is empty for a sound model."""

    model: str
    bytes: int
    opset: int = 0
    operators: dict[str, int] = field(default_factory=dict)
    samples: int = 0
    torch_difference_max: float | None = None
    failures: list[str] = field(default_factory=list)
    reference: str | None = None
    zero_gives_zero: bool | None = None

    def require(self, condition: bool, failure: str) -> None:
        """Note a failure unless the condition holds."""
        if not condition:
            self.failures.append(failure)


def check_model(
    path: Path, dataset: Dataset, run_dirs: list[Path], reference: Path | None, samples: int = 8
) -> CheckReport:
    """All checks; with the runs that it is of also the comparison of ONNX Runtime with PyTorch."""
    try:
        data = path.read_bytes()
        model = onnx.load_from_string(data)
    except Exception as error:  # protobuf's own error type is not public
        raise CheckError(f"{path}: not a readable ONNX file ({error})") from error
    report = CheckReport(model=str(path), bytes=len(data))
    _check_graph(model, report)
    _check_metadata(model, dataset, report)
    if report.failures:
        return report
    pressure, session = _held_out(dataset, samples), _session(data)
    output = np.stack([session.run([OUTPUT], {INPUT: p[None, None]})[0][0, 0] for p in pressure])
    report.samples = len(pressure)
    _check_output(output, dataset, report)
    zero = session.run([OUTPUT], {INPUT: np.zeros_like(pressure[:1, None])})[0]
    report.zero_gives_zero = not zero.any()
    if run_dirs:
        _compare(run_dirs, model, pressure, output, report)
    if reference is not None and not report.failures:
        write_reference(reference, pressure, output)
        report.reference = str(reference)
    return report


def write_reference(path: Path, pressure_pa: F32, sed_j_per_m3: F32) -> None:
    """Inputs and ONNX Runtime's outputs, ``[N, 224, 224]`` each, for other engines to meet."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, pressure_pa=pressure_pa, sed_j_per_m3=sed_j_per_m3)
    write_atomic(path, buffer.getvalue())


def _held_out(dataset: Dataset, count: int) -> F32:
    ids = [dataset.test_ids[i] for i in spread(len(dataset.test_ids), count)]
    states = dataset.states(ids)
    return np.stack([states[k].pressure_pa for k in spread(len(states), count)])


def _session(data: bytes) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])


def _check_graph(model: onnx.ModelProto, report: CheckReport) -> None:
    try:
        onnx.checker.check_model(model, full_check=True)
        onnx.shape_inference.infer_shapes(model, check_type=True, strict_mode=True, data_prop=True)
    except (onnx.checker.ValidationError, onnx.shape_inference.InferenceError) as error:
        report.failures.append(f"not legal ONNX: {error}")
        return
    for node in model.graph.node:
        report.operators[node.op_type] = report.operators.get(node.op_type, 0) + 1
    foreign = sorted(set(report.operators) - OPERATORS)
    report.require(not foreign, f"operators beyond the plain ones: {foreign}")
    domains = {entry.domain or "ai.onnx": entry.version for entry in model.opset_import}
    report.opset = domains.get("ai.onnx", 0)
    report.require(domains == {"ai.onnx": OPSET}, f"operator sets {domains}, expected {OPSET}")
    report.require(len(model.functions) == 0, "the model holds functions")
    for values, name in ((model.graph.input, INPUT), (model.graph.output, OUTPUT)):
        found = [(v.name, *_shape(v)) for v in values]
        wanted = [(name, onnx.TensorProto.FLOAT, [1, 1, SIDE_PX, SIDE_PX])]
        report.require(found == wanted, f"interface {found}, expected {wanted}")


def _shape(value: onnx.ValueInfoProto) -> tuple[int, list[int]]:
    tensor = value.type.tensor_type
    return tensor.elem_type, [dimension.dim_value for dimension in tensor.shape.dim]


def _check_metadata(model: onnx.ModelProto, dataset: Dataset, report: CheckReport) -> None:
    found = {entry.key: entry.value for entry in model.metadata_props}
    missing = [key for key in METADATA if not found.get(f"papilla.{key}")]
    report.require(not missing, f"metadata missing: {missing}")
    for key, wanted in (
        ("atlas_hash", dataset.atlas_hash),
        ("dataset_sha256", dataset.dataset_sha256),
    ):
        value = found.get(f"papilla.{key}")
        report.require(value == wanted, f"{key} is {value}, the dataset's is {wanted}")


def _check_output(output: F32, dataset: Dataset, report: CheckReport) -> None:
    report.require(bool(np.isfinite(output).all()), "the output is not finite")
    report.require(bool((output >= 0).all()), "the output is negative somewhere")
    outside = output[:, dataset.mask() == 0]
    report.require(not outside.any(), "the output is not zero outside the interface patch")


def _compare(
    run_dirs: list[Path], model: onnx.ModelProto, pressure: F32, output: F32, report: CheckReport
) -> None:
    trained = _trained(run_dirs, model, report)
    if trained is None:
        return
    expected = predict(trained, pressure)
    peaks = expected.max(axis=(1, 2))
    if not (peaks > 0).any():
        report.failures.append("the network answers zero on all held-out samples: train longer")
        return
    # Each map relative to its own maximum, as `model-export evaluate` does; a map that is zero
    # for PyTorch has to be zero for ONNX Runtime too.
    differences = np.abs(output - expected).max(axis=(1, 2))
    scale = np.where(peaks > 0, peaks, np.finfo(np.float32).tiny)
    difference = float((differences / scale).max())
    report.torch_difference_max = difference
    report.require(
        difference <= TOLERANCE,
        f"ONNX Runtime and PyTorch differ by {difference:.1e} of the maximum "
        f"(allowed {TOLERANCE:.0e}): was the model exported from another run than "
        f"{' and '.join(map(str, run_dirs))}?",
    )


def _trained(run_dirs: list[Path], model: onnx.ModelProto, report: CheckReport) -> nn.Module | None:
    """The network of the weights that were exported; notes a failure where they are gone."""
    props = {entry.key: entry.value for entry in model.metadata_props}
    training = json.loads(props["papilla.training"])
    checkpoints = [Checkpoint.load(run) for run in run_dirs]
    if "mean_of" in training:
        return mean_model(checkpoints, training.get("finer", {}).get("factor", 1.0))
    checkpoint = checkpoints[0]
    exported = training["epoch_chosen"]
    matching = [w for w in ("best", "last") if chosen_epoch(checkpoint, w) == exported]
    if not matching:
        report.failures.append(f"epoch {exported} was exported, {run_dirs[0]} no longer holds it")
        return None
    return served_model(checkpoint, matching[0])
