"""Where a vertex network starts: the finger's linear operator, or the data's main directions."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from papilla_trainer.atlas import Atlas
from papilla_trainer.errors import DatasetError, UsageError
from papilla_trainer.files import read_json
from papilla_trainer.vertex_network import (
    COMPONENTS,
    PRESSURE_UNIT_PA,
    SED_UNIT_J_PER_M3,
    VertexNet,
)

F32 = NDArray[np.float32]

# Directions in which no pressure of the dataset points count as this part of the mean one, so that
# a shape that no training press has is still answered.
_UNSEEN = 0.02
_ROUNDS = 4


@dataclass(frozen=True)
class Operator:
    """``g``: ``[V, 6, V]`` sqrt(J/m3)/Pa: SED at v is the sum over k of ``(g[v, k] @ p)**2``."""

    g: F32
    sha256: str

    @staticmethod
    def read(path: Path, atlas: Atlas) -> Operator:
        """Read ``operator.npz`` (and ``operator.json`` beside it, for the atlas' hash)."""
        try:
            found = str(read_json(path.with_suffix(".json"))["atlas_hash"])
            with np.load(path, allow_pickle=False) as arrays:
                g = arrays["g"].astype(np.float32, copy=False)
            sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DatasetError(
                f"{path}: not a readable operator ({error!r}); `fe-datagen operator` writes one"
            ) from error
        if found != atlas.hash:
            raise DatasetError(f"{path}: of atlas {found[:12]}..., not {atlas.hash[:12]}...")
        if g.shape != (atlas.vertex_count, COMPONENTS, atlas.vertex_count):
            raise DatasetError(f"{path}: g has shape {g.shape}")
        if not np.isfinite(g).all():
            raise DatasetError(f"{path}: g is not finite")
        return Operator(g, sha256)


def start_from_pressures(network: VertexNet, pressure_pa: Tensor) -> None:
    """The input side becomes the main directions of the pressures, each sample of equal weight."""
    for half, weights in zip(halves(network, pressure_pa), input_sides(network), strict=True):
        scaled = half / half.norm(dim=1, keepdim=True).clamp_min(1e-9)
        _, _, directions = torch.linalg.svd(scaled, full_matrices=False)
        count = min(weights.shape[1], len(directions))
        weights.data[:, :count] = directions[:count].T / 6.0


def start_from_operator(
    network: VertexNet, operator: Operator, pressure_pa: Tensor, row_weights: Tensor
) -> None:
    """The linear map becomes ``operator``'s best approximation for such pressures.

    ``pressure_pa`` ``[N, V]`` says which directions matter, ``row_weights`` ``[V]`` which vertices.
    The stencil, where there is one, takes exactly what the low-rank part leaves at its vertices;
    both are improved in turn.
    """
    if network.spec.components < COMPONENTS:
        raise UsageError(f"an operator needs at least {COMPONENTS} components")
    unit = network.unit.numpy()
    scale = PRESSURE_UNIT_PA / SED_UNIT_J_PER_M3**0.5
    full = (operator.g[unit] * np.float32(scale)).reshape(-1, operator.g.shape[2])
    rows = np.repeat(np.sqrt(row_weights.numpy()[unit] + 1e-6), COMPONENTS)
    near = _near_columns(network) if network.spec.near else None
    stencil = np.zeros_like(full)
    low_rank: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for _ in range(_ROUNDS if near is not None else 1):
        low_rank = []
        for part, half in zip(
            _parts(network, full - stencil), halves(network, pressure_pa), strict=True
        ):
            rank = input_sides(network)[len(low_rank)].shape[1]
            low_rank.append(_compress(part, half.numpy(), rows, rank))
        if near is not None:
            rest = full - _whole(network, [a @ b for a, b in low_rank])
            stencil = np.zeros_like(full)
            np.put_along_axis(stencil, near, np.take_along_axis(rest, near, axis=1), axis=1)
    _write(network, low_rank)
    if near is not None:
        values = np.take_along_axis(stencil, near, axis=1)
        network.near.data[..., :COMPONENTS] = torch.from_numpy(
            values.reshape(network.units, COMPONENTS, -1).transpose(0, 2, 1).copy()
        )


def halves(network: VertexNet, pressure_pa: Tensor) -> tuple[Tensor, Tensor]:
    """Even and odd part of pressures ``[N, V]``, as the network forms them."""
    pressure = pressure_pa / PRESSURE_UNIT_PA
    here, there = pressure[:, network.unit], pressure[:, network.image]
    return here + there, (here - there)[:, : network.halves]


def input_sides(network: VertexNet) -> tuple[Tensor, Tensor]:
    """The matrices that take the two parts to their coordinates."""
    return network.in_even, network.in_odd


def _near_columns(network: VertexNet) -> NDArray[np.int64]:
    """``[U * 6, K]``: the columns of each row that the stencil holds."""
    near: NDArray[np.int64] = network.neighbour[:, 0].numpy()
    return np.repeat(near, COMPONENTS, axis=0)


def _parts(network: VertexNet, full: F32) -> tuple[F32, F32]:
    """A map of all pressures as maps of their even and odd parts."""
    here, there = full[:, network.unit.numpy()], full[:, network.image.numpy()]
    even = 0.5 * (here + there)
    even[:, network.halves :] *= 0.5  # on the middle line here and there are the same vertex
    return even, 0.5 * (here - there)[:, : network.halves]


def _whole(network: VertexNet, parts: list[NDArray[np.float64]]) -> F32:
    """The inverse of `_parts`."""
    even, odd = parts
    full = np.zeros((len(even), len(network.first)), dtype=np.float32)
    right, left = network.unit.numpy()[: network.halves], network.image.numpy()[: network.halves]
    full[:, right] = even[:, : network.halves] + odd
    full[:, left] = even[:, : network.halves] - odd
    full[:, network.unit.numpy()[network.halves :]] = 2.0 * even[:, network.halves :]
    return full


def _compress(
    part: F32, pressures: F32, rows: NDArray[np.float64], rank: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """``[M, rank]`` and ``[rank, n]`` whose product is closest to ``part`` ``[M, n]``."""
    scaled = pressures / np.maximum(np.linalg.norm(pressures, axis=1, keepdims=True), 1e-9)
    covariance = scaled.T.astype(np.float64) @ scaled
    covariance += _UNSEEN * np.trace(covariance) / len(covariance) * np.eye(len(covariance))
    values, vectors = np.linalg.eigh(covariance)
    root = (vectors * np.sqrt(values)) @ vectors.T
    inverse = (vectors / np.sqrt(values)) @ vectors.T
    weighted = rows[:, None] * part @ root
    # The left side is six times as tall as wide: the small Gram matrix is enough.
    strength, right = np.linalg.eigh(weighted.T @ weighted)
    right = right[:, np.argsort(-strength)[:rank]]
    return (weighted @ right) / rows[:, None], right.T @ inverse


def _write(
    network: VertexNet, low_rank: list[tuple[NDArray[np.float64], NDArray[np.float64]]]
) -> None:
    """Outputs are ordered component by component; coordinates are scaled to size one."""
    outputs = (network.out_even, network.out_odd)
    for (left, right), inside, outside in zip(low_rank, input_sides(network), outputs, strict=True):
        size = np.abs(right).max()
        inside.data.zero_()
        outside.data.zero_()
        inside.data[:, : len(right)] = torch.from_numpy((right / size).T.astype(np.float32))
        values = (left * size).reshape(network.units, COMPONENTS, -1).transpose(2, 1, 0)
        flat = outside.data.reshape(outside.shape[0], network.spec.components, network.units)
        flat[: values.shape[0], :COMPONENTS] = torch.from_numpy(values.astype(np.float32))
