"""The finger as one elastic half-space: closed form, no training (Phillips & Johnson 1981).

Boussinesq's stresses under a point load, summed over the pressure on the flattened skin, at the
depth of the interface. The pressure is linear in each triangle of the atlas, as maps are, and is
integrated over it; the tissue has the dermis' elasticity everywhere and no end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.comparison.atlas import Atlas

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Triangles nearer than this are cut into parts with edges of some 0.1 mm, half the depth, for the
# kernel is steep there; those beyond into four.
_NEAR_MM = 2.5
_LARGE_MM = 0.9
_CUTS_NEAR = 9
_CUTS_LARGE = 24
_CUTS_FAR = 2


@dataclass(frozen=True)
class HalfSpace:
    """Young's modulus in Pa, Poisson's ratio and the depth below the skin in mm."""

    youngs_modulus_pa: float = 80e3
    poissons_ratio: float = 0.48
    depth_mm: float = 0.2

    def stress(self, x_mm: F64, y_mm: F64) -> F64:
        """``[..., 6]`` 1/mm2: xx, yy, zz, xy, xz, yz at (x, y, depth) per newton at the origin.

        Times a load in N this is N/mm2 = MPa; z points into the tissue, tension is positive.
        """
        z, nu = self.depth_mm, self.poissons_ratio
        r2 = x_mm**2 + y_mm**2
        big_r = np.sqrt(r2 + z * z)
        lateral = (1.0 - 2.0 * nu) / (big_r * (big_r + z))
        radial = lateral - 3.0 * r2 * z / big_r**5
        hoop = (1.0 - 2.0 * nu) * z / big_r**3 - lateral
        shear = -3.0 * z * z / big_r**5  # over r: times x or y it is finite at the origin
        axial = -3.0 * z**3 / big_r**5
        safe = np.maximum(r2, 1e-30)
        xx, yy, xy = x_mm**2 / safe, y_mm**2 / safe, x_mm * y_mm / safe
        # At the origin radial and hoop are equal, so any direction will do.
        xx, yy = np.where(r2 > 1e-24, xx, 1.0), np.where(r2 > 1e-24, yy, 0.0)
        return np.stack(
            [
                radial * xx + hoop * yy,
                radial * yy + hoop * xx,
                axial,
                (radial - hoop) * xy,
                shear * x_mm,
                shear * y_mm,
            ],
            axis=-1,
        ) / (2.0 * np.pi)

    def components(self, stress: F64) -> F64:
        """``[..., 6]`` stresses to numbers whose squares sum to the strain energy density."""
        shear_modulus = self.youngs_modulus_pa / (2.0 * (1.0 + self.poissons_ratio))
        bulk_modulus = self.youngs_modulus_pa / (3.0 * (1.0 - 2.0 * self.poissons_ratio))
        xx, yy, zz = stress[..., 0], stress[..., 1], stress[..., 2]
        deviator = 1.0 / np.sqrt(4.0 * shear_modulus)
        return np.stack(
            [
                (xx - yy) * deviator / np.sqrt(2.0),
                (xx + yy - 2.0 * zz) * deviator / np.sqrt(6.0),
                (xx + yy + zz) / 3.0 / np.sqrt(2.0 * bulk_modulus),
                *(stress[..., k] * deviator * np.sqrt(2.0) for k in (3, 4, 5)),
            ],
            axis=-1,
        )

    def operator(self, atlas: Atlas) -> NDArray[np.float32]:
        """``[V, 6, V]`` sqrt(J/m3)/Pa, in the form of the finger's own operator.

        An interface vertex lies under the place of its skin vertex in the flattened skin.
        """
        place = atlas.skin_px * atlas.mm_per_px
        g = np.empty((len(place), 6, len(place)), dtype=np.float32)
        near, large, far = (
            _quadrature(place, atlas.triangles, n) for n in (_CUTS_NEAR, _CUTS_LARGE, _CUTS_FAR)
        )
        corners = place[atlas.triangles]
        centre = corners.mean(axis=1)
        edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        for v, at in enumerate(place):
            close = np.linalg.norm(centre - at, axis=1) < np.maximum(_NEAR_MM, edge)
            big = close & (edge > _LARGE_MM)
            row = np.zeros((6, len(place)))
            for points, loads, chosen in (
                (*near, close & ~big),
                (*large, big),
                (*far, ~close),
            ):
                offset = at - points[chosen]  # [T', Q, 2]
                kernel = self.components(self.stress(offset[..., 0], offset[..., 1]))
                at_corners = np.einsum("tqk,tqc->tkc", loads[chosen], kernel)
                for k in range(6):
                    row[k] += np.bincount(
                        atlas.triangles[chosen].ravel(), at_corners[..., k].ravel(), len(place)
                    )
            g[v] = row
        return g


def _quadrature(place: F64, triangles: I64, cuts: int) -> tuple[F64, F64]:
    """Midpoints ``[T, Q, 2]`` of ``cuts**2`` parts of each triangle, and their loads ``[T, Q, 3]``.

    A load is the part's area in mm2 times the linear weight of a corner there.
    """
    weights = []
    for i in range(cuts):
        for j in range(cuts - i):
            weights.append(((i + 1 / 3) / cuts, (j + 1 / 3) / cuts))
            if i + j < cuts - 1:
                weights.append(((i + 2 / 3) / cuts, (j + 2 / 3) / cuts))
    pair = np.array(weights)
    corner = np.column_stack([1.0 - pair.sum(axis=1), pair])  # [Q, 3]
    a, b, c = (place[triangles[:, k]] for k in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    points = np.einsum("qk,tkd->tqd", corner, place[triangles])
    return points, area[:, None, None] * corner / cuts**2
