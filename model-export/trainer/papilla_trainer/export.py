"""Checkpoint to ONNX: plain operators, fixed shape, metadata inside the file."""

from __future__ import annotations

import io
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnx.numpy_helper
import torch
from torch import nn

from papilla_trainer import __version__
from papilla_trainer.checkpoint import Checkpoint, Served
from papilla_trainer.config import TrainConfig
from papilla_trainer.files import write_atomic
from papilla_trainer.maps import SIDE_PX
from papilla_trainer.serving import chosen_epoch, served_model

OPSET = 17
INPUT = "pressure_pa"
OUTPUT = "sed_j_per_m3"
# A constant of fewer values is not worth a cast.
_LARGE = 4096
_SMALL = {"float32": np.float16, "int64": np.int16}


def export_run(run_dir: Path, out: Path, name: str | None = None, weights: str = "best") -> Path:
    """Write the run's model with its metadata to ``out``; returns ``out``."""
    checkpoint = Checkpoint.load(run_dir)
    model = to_onnx(served_model(checkpoint, weights))
    return write_model(model, metadata(checkpoint, name or out.stem, weights), out)


def write_model(model: onnx.ModelProto, metadata_props: dict[str, str], out: Path) -> Path:
    """Put the metadata in, check that it is legal ONNX, write; returns ``out``."""
    onnx.helper.set_model_props(model, metadata_props)
    onnx.checker.check_model(model, full_check=True)
    write_atomic(out, model.SerializeToString())
    return out


def to_onnx(model: nn.Module) -> onnx.ModelProto:
    """Trace the served graph at batch 1, 224 x 224."""
    example = torch.zeros(1, 1, SIDE_PX, SIDE_PX)
    buffer = io.BytesIO()
    model = model.to(memory_format=torch.contiguous_format)
    with warnings.catch_warnings():
        # The tracing exporter is marked as the older one; it is kept on purpose: it needs no
        # further package and emits a plain graph without functions.
        warnings.simplefilter("ignore", DeprecationWarning)
        # Batch 1 is what is served: a loop over the batch may well be unrolled once.
        warnings.simplefilter("ignore", torch.jit.TracerWarning)
        torch.onnx.export(
            model,
            (example,),
            buffer,
            dynamo=False,
            opset_version=OPSET,
            input_names=[INPUT],
            output_names=[OUTPUT],
            do_constant_folding=True,
        )
    graph = onnx.load_from_string(buffer.getvalue())
    _name_copies_alike(graph)
    _store_small(graph)
    graph.producer_name = "papilla_trainer"
    graph.producer_version = __version__
    return graph


def _name_copies_alike(model: onnx.ModelProto) -> None:
    """Constants that several networks of a mean have in common stand there once, by one name."""
    copies = {n.output[0]: n.input[0] for n in model.graph.node if n.op_type == "Identity"}
    nodes = [node for node in model.graph.node if node.op_type != "Identity"]
    for node in nodes:
        for place, name in enumerate(node.input):
            while name in copies:
                name = copies[name]
            node.input[place] = name
    del model.graph.node[:]
    model.graph.node.extend(nodes)


def _store_small(model: onnx.ModelProto) -> None:
    """Large constants that lose nothing by it are stored in 16 bits, and cast when loaded."""
    casts, constants = [], []
    for constant in model.graph.initializer:
        values = onnx.numpy_helper.to_array(constant)
        small = values.astype(_SMALL.get(values.dtype.name, values.dtype))
        if values.size < _LARGE or small.dtype == values.dtype or (small != values).any():
            constants.append(constant)
            continue
        name = f"{constant.name}.stored"
        constants.append(onnx.numpy_helper.from_array(small, name))
        casts.append(onnx.helper.make_node("Cast", [name], [constant.name], to=constant.data_type))
    nodes = [*casts, *model.graph.node]
    del model.graph.node[:], model.graph.initializer[:]
    model.graph.node.extend(nodes)
    model.graph.initializer.extend(constants)


def metadata(checkpoint: Checkpoint, name: str, weights: str) -> dict[str, str]:
    """The ``metadata_props`` that engine and server read; every value is a string."""
    network = TrainConfig(**checkpoint.config).spec.as_json()
    training = training_record(checkpoint, weights)
    return properties(checkpoint.served, name, network, training)


def training_record(checkpoint: Checkpoint, weights: str) -> dict[str, Any]:
    """How a run was trained."""
    config = TrainConfig(**checkpoint.config)
    training: dict[str, Any] = {
        "seed": config.seed,
        "epochs": checkpoint.epoch,
        "epoch_chosen": chosen_epoch(checkpoint, weights),
        "chosen_by": "validation loss" if checkpoint.splits["validation"] else "last epoch",
        "optimiser": "Adam",
        "learning_rate": config.learning_rate,
        "schedule": config.schedule,
        "batch": config.batch,
        "loss": "mse, max-normalised",
        "precision": config.precision,
        "presses": {split: len(ids) for split, ids in checkpoint.splits.items()},
        "parameters": sum(p.numel() for p in served_model(checkpoint).parameters()),
        "seconds": round(checkpoint.seconds, 1),
        "trainer": __version__,
        **checkpoint.environment,
    }
    if config.loss_name == "relative":
        training["loss"] = f"relative L2 squared + {config.far_weight} x that of the far field"
    if config.start:
        training["start"] = config.start
    if config.shift_px:
        training["shift_px"] = config.shift_px
    if config.contact:
        training["contact"] = [Path(file).name for file in config.contact]
    if config.contact_alone:
        training["contact_alone"] = True
    if config.pseudo_labels:
        training["pseudo_labels"] = [Path(file).name for file in config.pseudo_labels]
        training["pseudo_samples"] = config.pseudo_samples
    return training


def properties(
    served: Served,
    name: str,
    network: dict[str, Any],
    training: dict[str, Any],
) -> dict[str, str]:
    """``metadata_props`` of any model, trained or not."""
    if len(served.datasets) > 1:
        training = {**training, "datasets": served.datasets}
    if served.finger_sha256 is not None:
        training = {**training, "finger_sha256": served.finger_sha256}
    return {
        "papilla.format": "1",
        "papilla.name": name,
        "papilla.atlas_hash": served.atlas_hash,
        "papilla.effects": json.dumps(served.effects),
        "papilla.network": json.dumps(network),
        "papilla.pressure_max_pa": repr(served.pressure_max_pa),
        "papilla.sed_max_j_per_m3": repr(served.sed_max_j_per_m3),
        "papilla.dataset_sha256": served.dataset_sha256,
        "papilla.training": json.dumps(training),
    }
