"""How far a predicted map of SED is from the truth: some of the figures of `model-export evaluate`.

Studies need them of states that are no split of a dataset. A test holds them against that program.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.comparison.raster import Raster
from papilla_trainer.dataset import Dataset
from papilla_trainer.maps import F32, MAP_LEN, SIDE_PX

# Where the truth is below this part of its maximum is the far field.
FAR_FIELD = 0.1
# The zone toward the nail base, mm from the tip along the finger.
NAIL_BASE_MM = (12.0, 16.0)


@dataclass(frozen=True)
class Zones:
    """Pixels of a map ``[224, 224]``: those of the interface, and of the zone toward the nail."""

    mask: NDArray[np.bool_]
    nail_base: NDArray[np.bool_]

    @staticmethod
    def of(dataset: Dataset) -> Zones:
        """As the atlas of the dataset has them."""
        atlas = Atlas.read(dataset.directory / "atlas.json", dataset.atlas_hash)
        raster = Raster.read(dataset.directory, "interface", dataset.vertex_count)
        along = (atlas.interface_mm[raster.vertex, 0] * raster.weight).sum(axis=1)
        first, last = NAIL_BASE_MM
        zone = np.zeros(MAP_LEN, dtype=bool)
        zone[raster.pixel] = (along >= first) & (along < last)
        return Zones(dataset.mask() > 0, zone.reshape(SIDE_PX, SIDE_PX))


def measure(found: F32, truth: F32, zones: Zones) -> dict[str, float]:
    """Errors of one map; NaN where the truth is zero."""
    p, t = (values.astype(np.float64)[zones.mask] for values in (found, truth))
    nail_base = zones.nail_base[zones.mask]
    peak = t.max()
    far = t < FAR_FIELD * peak
    return {
        "relative_l2": _relative(p, t),
        "far_field_relative_l2": _relative(p[far], t[far]),
        "peak_error": float(abs(p.max() - peak) / peak),
        "nail_base_error": _relative(p[nail_base], t[nail_base]),
        "total_energy_error": float(abs(p.sum() - t.sum()) / t.sum()),
    }


def _relative(p: NDArray[np.float64], t: NDArray[np.float64]) -> float:
    norm = np.linalg.norm(t)
    return float(np.linalg.norm(p - t) / norm) if norm > 0 else float("nan")
