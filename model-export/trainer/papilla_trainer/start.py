"""Initial weights from an exported network, so that a training goes on from it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import onnx
import onnx.numpy_helper
import torch
from torch import Tensor

from papilla_trainer.errors import UsageError
from papilla_trainer.map_network import MapNet, MapSpec, level_of_blocks

_PREFIX = "network."


@dataclass(frozen=True)
class Start:
    """An exported network on maps.

    ``weights``: the file's constants by their names in the network.
    """

    path: Path
    name: str
    sha256: str
    spec: MapSpec
    weights: dict[str, Tensor]

    @staticmethod
    def read(path: Path) -> Start:
        """Read what `export` wrote; a model of another kind is refused by the name of its kind."""
        try:
            data = path.read_bytes()
            model = onnx.load_from_string(data)
        except OSError as error:
            raise UsageError(f"--start {path}: cannot be read ({error.strerror})") from error
        except Exception as error:  # protobuf raises several kinds for a damaged file
            raise UsageError(f"--start {path}: not an ONNX file") from error
        metadata = {entry.key: entry.value for entry in model.metadata_props}
        spec = _spec(path, metadata.get("papilla.network"))
        constants = {
            constant.name.removesuffix(".stored").removeprefix(_PREFIX): torch.from_numpy(
                onnx.numpy_helper.to_array(constant).copy()
            ).float()
            for constant in model.graph.initializer
            if constant.name.startswith(_PREFIX)
        }
        name = metadata.get("papilla.name", path.stem)
        sha256 = hashlib.sha256(data).hexdigest()
        return Start(path, name, sha256, spec, _trainable(path, spec, constants))

    def record(self) -> dict[str, str]:
        """What a run notes of it."""
        return {"name": self.name, "onnx_sha256": self.sha256}

    def give(self, network: torch.nn.Module, asked: str) -> None:
        """Put the weights into a network; one of another shape is refused."""
        if not isinstance(network, MapNet) or network.spec != self.spec:
            raise UsageError(
                f"--start {self.path}: it is a {self.spec.name}, and --network asks for {asked}: "
                "leave --network away, or start from a model of that network"
            )
        network.load_state_dict(self.weights)


def _spec(path: Path, text: str | None) -> MapSpec:
    try:
        numbers: dict[str, Any] = json.loads(text or "")
        kind = str(numbers["kind"])
    except (ValueError, KeyError, TypeError) as error:
        raise UsageError(f"--start {path}: no model that `export` wrote") from error
    if kind != MapSpec.kind:
        raise UsageError(
            f"--start {path}: it is of the kind '{kind}'; only single networks on maps "
            "(map-...) can be trained on"
        )
    return MapSpec(**numbers)


def _trainable(path: Path, spec: MapSpec, constants: dict[str, Tensor]) -> dict[str, Tensor]:
    """Weights of a :class:`MapNet` from those of the exported graph."""
    found = dict(constants)
    try:
        for index in range(len(spec.sides)):
            level = f"levels.{index}."
            blocks = [found.pop(level + part) for part in ("near", "above", "over_finger")]
            kernel, mix, over_finger = level_of_blocks(spec, *blocks)
            found |= {level + "kernel": kernel, level + "mix": mix}
            found[level + "over_finger"] = over_finger
    except (KeyError, RuntimeError, IndexError) as error:
        raise UsageError(f"--start {path}: a weight is missing or misshapen ({error})") from error
    expected = {name: weight.shape for name, weight in MapNet(spec).state_dict().items()}
    shapes = {name: weight.shape for name, weight in found.items()}
    if shapes != expected:
        wrong = sorted(
            name for name in {*shapes, *expected} if shapes.get(name) != expected.get(name)
        )
        raise UsageError(f"--start {path}: weights missing or misshapen: {', '.join(wrong)}")
    return found
