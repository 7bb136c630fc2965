"""A linear operator from pressure at the skin to strain at the interface: a file, or made here."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.errors import DatasetError
from papilla_trainer.files import read_json

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

COMPONENTS = 6


@dataclass(frozen=True)
class Operator:
    """SED of face f is the sum over k of ``(g[f, k] @ p)**2``; a vertex has its faces' mean.

    ``g``: ``[F, 6, V]`` sqrt(J/m3)/Pa: five deviatoric numbers of the strain and one volumetric, in
    the finger's axes; ``vertex_face``, ``vertex_weight``: ``[V, M]``, the faces about each vertex
    and what each counts (>= 0). That is how a dataset recovers SED: squares first, then the mean.
    """

    g: F32
    vertex_face: I64
    vertex_weight: F32
    sha256: str

    @staticmethod
    def read(path: Path, atlas: Atlas) -> Operator:
        """Read ``operator.npz`` (and ``operator.json`` beside it, for the atlas' hash)."""
        try:
            found = str(read_json(path.with_suffix(".json"))["atlas_hash"])
            with np.load(path, allow_pickle=False) as arrays:
                operator = Operator(
                    g=arrays["face_g"].astype(np.float32, copy=False),
                    vertex_face=arrays["vertex_face"].astype(np.int64),
                    vertex_weight=arrays["vertex_weight"].astype(np.float32),
                    sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
                )
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DatasetError(
                f"{path}: not a readable operator ({error!r}); `fe-datagen operator` writes one"
            ) from error
        if found != atlas.hash:
            raise DatasetError(f"{path}: of atlas {found[:12]}..., not {atlas.hash[:12]}...")
        fault = operator._fault(atlas.vertex_count)
        if fault is not None:
            raise DatasetError(f"{path}: {fault}")
        return operator

    @staticmethod
    def at_vertices(g: F32) -> Operator:
        """One whose strain is known at the vertices themselves, ``g`` ``[V, 6, V]``."""
        own = np.arange(len(g), dtype=np.int64)[:, None]
        return Operator(g, own, np.ones(own.shape, dtype=np.float32), sha256="")

    def face_means(self, values: F64) -> F64:
        """Means over the vertices that average a face, ``[V, n]`` to ``[F, n]``."""
        vertex, column = np.nonzero(self.vertex_weight > 0.0)
        face = self.vertex_face[vertex, column]
        total = np.zeros((len(self.g), values.shape[1]))
        np.add.at(total, face, values[vertex])
        return total / np.bincount(face, minlength=len(total))[:, None]

    def face_weights(self, vertex_weights: NDArray[np.floating]) -> F64:
        """``[F]``: what an error at each face counts where one at a vertex counts ``[V]``."""
        shares = self.vertex_weight * np.asarray(vertex_weights)[:, None]
        return np.bincount(self.vertex_face.ravel(), shares.ravel(), minlength=len(self.g))

    def _fault(self, vertices: int) -> str | None:
        faces = len(self.g)
        if self.g.shape != (faces, COMPONENTS, vertices) or not faces:
            return f"face_g has shape {self.g.shape}"
        if not np.isfinite(self.g).all():
            return "face_g is not finite"
        shape = self.vertex_face.shape
        if len(shape) != 2 or shape[0] != vertices or self.vertex_weight.shape != shape:
            return f"vertex_face and vertex_weight have shapes {shape}, {self.vertex_weight.shape}"
        if self.vertex_face.min() < 0 or self.vertex_face.max() >= faces:
            return f"vertex_face names faces beyond {faces}"
        if not (self.vertex_weight >= 0).all() or not np.allclose(self.vertex_weight.sum(1), 1.0):
            return "vertex_weight is not a mean of each vertex' faces"
        used = self.vertex_face[self.vertex_weight > 0]
        return None if np.unique(used).size == faces else "a face belongs to no vertex"
