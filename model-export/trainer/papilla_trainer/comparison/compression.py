"""Puts an operator into a linear network: low rank, and a stencil for what that leaves."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.comparison.layout import BLOCK, frames
from papilla_trainer.comparison.linear_network import LinearNet
from papilla_trainer.comparison.linear_operator import COMPONENTS, Operator
from papilla_trainer.map_network import PRESSURE_UNIT_PA, SED_UNIT_J_PER_M3

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

# Directions in which no pressure of the dataset points count as this part of the mean one, so that
# a shape that no training indentation has is still answered.
_UNSEEN = 0.02
_ROUNDS = 4


def start_from_operator(
    network: LinearNet,
    atlas: Atlas,
    operator: Operator,
    pressure_pa: Tensor,
    vertex_weights: Tensor,
) -> None:
    """The linear map becomes ``operator``'s best approximation for such pressures.

    ``pressure_pa`` ``[N, V]`` says which directions matter, ``vertex_weights`` ``[V]`` which
    places. The stencil, where there is one, takes exactly what the low-rank part leaves at its
    vertices; both are improved in turn.
    """
    unit = network.get_buffer("unit").numpy()
    scale = np.float32(PRESSURE_UNIT_PA / SED_UNIT_J_PER_M3**0.5)
    turned = np.einsum(
        "fab,fbj->faj", frames(atlas, operator)[unit].astype(np.float32), operator.g[unit]
    )
    full = (turned * scale).reshape(-1, operator.g.shape[2])
    rows = np.sqrt(operator.face_weights(vertex_weights.numpy())[unit] + 1e-6)
    rows = np.repeat(rows, COMPONENTS)
    columns = None
    if network.spec.near:
        columns = np.repeat(network.near[:, 0].numpy(), BLOCK * COMPONENTS, axis=0)
    stencil = np.zeros_like(full)
    low_rank: list[tuple[F64, F64]] = []
    for _ in range(1 if columns is None else _ROUNDS):
        low_rank = [
            _compress(part, half.numpy(), rows, weights.shape[1])
            for part, half, weights in zip(
                _parts(network, full - stencil),
                _halves(network, pressure_pa),
                (network.in_even, network.in_odd),
                strict=True,
            )
        ]
        if columns is not None:
            rest = full - _whole(network, [a @ b for a, b in low_rank])
            stencil = np.zeros_like(full)
            np.put_along_axis(stencil, columns, np.take_along_axis(rest, columns, axis=1), axis=1)
    _write(network, low_rank)
    if columns is not None:
        values = np.take_along_axis(stencil, columns, axis=1)
        shaped = values.reshape(len(network.near), BLOCK * COMPONENTS, -1).transpose(0, 2, 1)
        network.stencil.data.copy_(torch.from_numpy(shaped.copy()))


def _halves(network: LinearNet, pressure_pa: Tensor) -> tuple[Tensor, Tensor]:
    """Even and odd part of pressures ``[N, V]``, as the network forms them."""
    pressure = pressure_pa / PRESSURE_UNIT_PA
    here, there = pressure[:, network.vertex], pressure[:, network.image]
    return here + there, (here - there)[:, : network.halves]


def _parts(network: LinearNet, full: F32) -> tuple[F32, F32]:
    """A map of all pressures as maps of their even and odd parts."""
    here, there = full[:, network.vertex.numpy()], full[:, network.image.numpy()]
    even = 0.5 * (here + there)
    even[:, network.halves :] *= 0.5  # on the middle line here and there are the same vertex
    return even, 0.5 * (here - there)[:, : network.halves]


def _whole(network: LinearNet, parts: list[F64]) -> F32:
    """The inverse of `_parts`."""
    even, odd = parts
    vertex, image = network.vertex.numpy(), network.image.numpy()
    full = np.zeros((len(even), network.vertex_slot.shape[1]), dtype=np.float32)
    full[:, vertex[: network.halves]] = even[:, : network.halves] + odd
    full[:, image[: network.halves]] = even[:, : network.halves] - odd
    full[:, vertex[network.halves :]] = 2.0 * even[:, network.halves :]
    return full


def _compress(part: F32, pressures: F32, rows: F64, rank: int) -> tuple[F64, F64]:
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


def _write(network: LinearNet, low_rank: list[tuple[F64, F64]]) -> None:
    """Coordinates are scaled to size one."""
    inputs = (network.in_even, network.in_odd)
    outputs = (network.out_even, network.out_odd)
    for (left, right), inside, outside in zip(low_rank, inputs, outputs, strict=True):
        size = np.abs(right).max()
        inside.data.zero_()
        outside.data.zero_()
        inside.data[:, : len(right)] = torch.from_numpy((right / size).T.astype(np.float32))
        outside.data[: len(right)] = torch.from_numpy((left * size).T.astype(np.float32))
