"""The atlas as linear networks see it: places, areas and the mirror of the finger."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError

I64 = NDArray[np.int64]
F64 = NDArray[np.float64]

# Vertices of a mirror-symmetric mesh meet their images to rounding of f32.
_MIRROR_TOLERANCE_MM = 1e-3
_LATERAL = 1


@dataclass(frozen=True)
class Atlas:
    """Vertices of both patches; skin vertex i lies over interface vertex i.

    ``skin_mm``, ``interface_mm``: ``[V, 3]``; ``skin_px``, ``interface_px``: ``[V, 2]`` places in
    the flattened map, px; ``triangles``: ``[T, 3]``; ``mirror``: ``[V]``, the vertex at each one's
    mirror image (the finger is symmetric about y = 0).
    """

    hash: str
    mm_per_px: float
    skin_mm: F64
    interface_mm: F64
    skin_px: F64
    interface_px: F64
    triangles: I64
    mirror: I64

    @staticmethod
    def read(path: Path, expected_hash: str | None = None) -> Atlas:
        """Read ``atlas.json``; refuses another hash, and a patch without mirror symmetry."""
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            skin, interface = data["skin"], data["interface"]
            skin_mm = np.array(skin["positions_mm"], dtype=np.float64).reshape(-1, 3)
            atlas = Atlas(
                hash=str(data["hash"]),
                mm_per_px=float(data["mm_per_px"]),
                skin_mm=skin_mm,
                interface_mm=np.array(interface["positions_mm"], dtype=np.float64).reshape(-1, 3),
                skin_px=np.array(skin["uv_px"], dtype=np.float64).reshape(-1, 2),
                interface_px=np.array(interface["uv_px"], dtype=np.float64).reshape(-1, 2),
                triangles=np.array(data["triangles"], dtype=np.int64).reshape(-1, 3),
                mirror=_mirror(skin_mm, path),
            )
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DatasetError(f"{path}: not a readable atlas ({error!r})") from error
        if expected_hash is not None and atlas.hash != expected_hash:
            raise DatasetError(f"{path}: atlas {atlas.hash[:12]}..., expected {expected_hash[:12]}")
        return atlas

    @property
    def vertex_count(self) -> int:
        """V."""
        return len(self.skin_mm)

    def areas_mm2(self, positions_mm: F64) -> F64:
        """``[V]``: each vertex's third of the triangles around it."""
        corners = positions_mm[self.triangles]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        share = np.linalg.norm(sides, axis=1) / 6.0
        return np.bincount(
            self.triangles.ravel(), weights=np.repeat(share, 3), minlength=self.vertex_count
        )


def _mirror(positions_mm: F64, path: Path) -> I64:
    image = positions_mm.copy()
    image[:, _LATERAL] *= -1.0
    apart = np.linalg.norm(image[:, None] - positions_mm[None], axis=2)
    mirror = apart.argmin(axis=1)
    if apart.min(axis=1).max() > _MIRROR_TOLERANCE_MM or np.unique(mirror).size != mirror.size:
        raise DatasetError(
            f"{path}: the finger is not mirror-symmetric about y = 0, which linear networks rely on"
        )
    return mirror
