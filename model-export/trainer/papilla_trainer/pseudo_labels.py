"""Pairs of maps that no simulation has solved: what another network answers to contact's pressure.

``model-export pseudo-labels`` writes them. They are cheap, so there can be many more of them than
of simulated pairs; how good they are is how good that network is.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from papilla_trainer.dataset import Dataset, State
from papilla_trainer.errors import DatasetError
from papilla_trainer.files import read_npz
from papilla_trainer.maps import SIDE_PX


def pseudo_states(paths: list[str], dataset: Dataset) -> list[State]:
    """The pairs of all files, which must be of the dataset's atlas."""
    found = []
    for path in map(Path, paths):
        arrays = read_npz(path)
        try:
            pressure, sed = arrays["pressure_pa"], arrays["sed_j_per_m3"]
            atlas = arrays["atlas_hash"].tobytes().decode("ascii", "replace")
        except KeyError as error:
            raise DatasetError(
                f"{path}: no array {error}; write it with `model-export pseudo-labels`"
            ) from error
        if atlas != dataset.atlas_hash:
            raise DatasetError(f"{path}: of another atlas than {dataset.directory}")
        shape = (len(pressure), SIDE_PX, SIDE_PX)
        for name, maps in (("pressure_pa", pressure), ("sed_j_per_m3", sed)):
            if maps.shape != shape or maps.dtype != np.float32 or not np.isfinite(maps).all():
                raise DatasetError(
                    f"{path}: {name} is {maps.dtype} {maps.shape}, expected finite float32 {shape}"
                )
        pairs = zip(pressure, sed, strict=True)
        found += [State(p, s, press_id=-1, state=k, depth_mm=0.0) for k, (p, s) in enumerate(pairs)]
    return found
