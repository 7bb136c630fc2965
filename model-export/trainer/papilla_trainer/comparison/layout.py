"""Where faces and vertices of a mirror-symmetric finger lie, and the frames in which faces see it.

Faces with y > 0 are *units*; each unit has two *slots*: the face itself (side 0) and its mirror
image (side 1). A slot of side 1 sees the finger in the mirror, so that both have the same weights.
Units that lie together form *blocks* of eight, which share the vertices of their stencil: one
product of some size for each block costs the server far less than a small one for each face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.comparison.linear_operator import COMPONENTS, Operator
from papilla_trainer.errors import DatasetError

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

_MIRROR_TOLERANCE_MM = 1e-3
# Units of a block; the last one repeats a unit where they do not come out even.
BLOCK = 8
# Where the finger's axis stands this steep on the skin, lengthwise is upward instead.
_STEEP = 0.2


@dataclass(frozen=True)
class Layout:
    """Indices of V vertices, U units and 2 U slots: block by block, first side 0, then side 1.

    ``vertex``, ``image``: vertices of one half, then of the middle line, and their mirror images;
    ``unit``: ``[U]`` faces; ``near``: ``[U / 8, 2, K]`` the vertices nearest to each block, and the
    same in the mirror; ``vertex_slot``, ``vertex_share``: ``[M, V]`` how slots' SED averages to
    vertices.
    """

    vertex: Tensor
    image: Tensor
    unit: Tensor
    near: Tensor
    vertex_slot: Tensor
    vertex_share: Tensor

    @staticmethod
    def of(atlas: Atlas, operator: Operator, near: int) -> Layout:
        """The layout of an operator's faces with ``near`` vertices in each block's stencil."""
        vertex, image = _vertices(atlas)
        skin = operator.face_means(atlas.skin_mm)
        unit, mirror = _units(operator.face_means(atlas.interface_mm))
        count, pad = len(unit), -len(unit) % BLOCK
        unit = unit[_blocks(skin[unit])]
        unit = np.concatenate([unit, np.repeat(unit[-1:], pad)])
        blocks = unit.reshape(-1, BLOCK)
        slots = np.stack([blocks, mirror[blocks]], axis=1).ravel()
        used = np.broadcast_to(np.arange(len(unit)) < count, (2, len(unit)))
        used = used.reshape(2, -1, BLOCK).transpose(1, 0, 2).ravel()
        apart = np.linalg.norm(skin[blocks][:, :, None] - atlas.skin_mm, axis=3).min(axis=1)
        own = np.argsort(apart, axis=1, kind="stable")[:, :near]
        slot, share = _averages(operator, np.where(used, slots, -1))
        arrays = {
            "vertex": vertex,
            "image": image,
            "unit": unit,
            "near": np.stack([own, atlas.mirror[own]], axis=1),
            "vertex_slot": slot.T,
            "vertex_share": share.T.astype(np.float32),
        }
        return Layout(
            **{name: torch.from_numpy(np.ascontiguousarray(a)) for name, a in arrays.items()}
        )

    @property
    def halves(self) -> int:
        """Vertices off the middle line, on one side of it."""
        return int((self.vertex != self.image).sum())


def frames(atlas: Atlas, operator: Operator) -> F64:
    """``[F, 6, 6]``: turn components in the finger's axes into (lengthwise, crosswise, outward).

    Rotations of the five deviatoric numbers; the volumetric one stays.
    """
    axes = _axes(atlas, operator)
    basis = _basis()
    turned = np.einsum("fij,ajk,flk->fail", axes, basis, axes)
    rotation = np.zeros((len(axes), COMPONENTS, COMPONENTS))
    rotation[:, :5, :5] = np.einsum("fail,bil->fba", turned, basis)
    rotation[:, 5, 5] = 1.0
    return rotation


def _axes(atlas: Atlas, operator: Operator) -> F64:
    """``[F, 3, 3]``, rows: lengthwise, crosswise, outward on the skin over each face."""
    normal = operator.face_means(_normals(atlas))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.array([1.0, 0.0, 0.0]) - normal * normal[:, :1]
    up = np.array([0.0, 0.0, 1.0]) - normal * normal[:, 2:]
    steep = np.linalg.norm(along, axis=1, keepdims=True) < _STEEP
    along = np.where(steep, up, along)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.stack([along, np.cross(normal, along), normal], axis=1)


def _basis() -> F64:
    """``[5, 3, 3]``: the tensors that the five deviatoric components multiply (fe-datagen's)."""
    basis = np.zeros((5, 3, 3))
    basis[0] = np.diag([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    basis[1] = np.diag([1.0, 1.0, -2.0]) / np.sqrt(6.0)
    for k, (i, j) in zip((2, 3, 4), ((0, 1), (0, 2), (1, 2)), strict=True):
        basis[k, i, j] = basis[k, j, i] = np.sqrt(0.5)
    return basis


def _normals(atlas: Atlas) -> F64:
    """``[V, 3]`` outward, area-weighted over the triangles."""
    corners = atlas.skin_mm[atlas.triangles]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.zeros_like(atlas.skin_mm)
    for k in range(3):
        np.add.at(normal, atlas.triangles[:, k], crossed)
    # The skin lies outside of the interface, whichever way round the triangles go.
    if ((atlas.skin_mm - atlas.interface_mm) * normal).sum() < 0.0:
        normal = -normal
    return normal


def _vertices(atlas: Atlas) -> tuple[I64, I64]:
    every = np.arange(atlas.vertex_count)
    off = atlas.mirror != every
    vertex = np.concatenate([every[(atlas.skin_mm[:, 1] > 0) & off], every[~off]])
    return vertex, atlas.mirror[vertex]


def _units(centre: F64) -> tuple[I64, I64]:
    """Faces of one half (middle ones at the end) and the mirror image of every face."""
    image = centre * np.array([1.0, -1.0, 1.0])
    apart = np.linalg.norm(image[:, None] - centre[None], axis=2)
    mirror = apart.argmin(axis=1)
    if apart.min(axis=1).max() > _MIRROR_TOLERANCE_MM or np.unique(mirror).size != mirror.size:
        raise DatasetError("the operator's faces are not mirror-symmetric about y = 0")
    every = np.arange(len(centre))
    off = mirror != every
    return np.concatenate([every[(centre[:, 1] > 0) & off], every[~off]]), mirror


def _averages(operator: Operator, slots: I64) -> tuple[I64, F64]:
    """A vertex' faces as slots (-1: none); of a face on the middle line both slots count half."""
    order = np.argsort(slots, kind="stable")
    first = np.searchsorted(slots[order], np.arange(len(operator.g)))
    last = np.searchsorted(slots[order], np.arange(len(operator.g)), side="right") - 1
    a, b = order[first][operator.vertex_face], order[last][operator.vertex_face]
    weight = operator.vertex_weight.astype(np.float64)
    if (first == last).all():
        return a, weight
    return np.concatenate([a, b], axis=1), 0.5 * np.concatenate([weight, weight], axis=1)


def _blocks(centre: F64) -> I64:
    """``[U]``: an order in which each eight lie together: halved again and again, lengthwise."""
    order = np.arange(len(centre))
    if len(order) <= BLOCK:
        return order
    order = np.argsort(centre[:, np.ptp(centre, axis=0).argmax()], kind="stable")
    half = max(1, round(len(order) / (2 * BLOCK))) * BLOCK
    parts = (order[:half], order[half:])
    return np.concatenate([part[_blocks(centre[part])] for part in parts])
