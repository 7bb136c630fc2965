"""The pressure that the service's own contact makes of a dataset's presses.

``model-export contact-maps`` writes it. Contact errs by some tenth of the pressure, and not by
chance: a network that learns FE's SED from both pressures makes up for a part of that.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.dataset import Dataset, Maps, read_npz
from papilla_trainer.errors import DatasetError
from papilla_trainer.joined import STRIDE
from papilla_trainer.raster import SIDE_PX

F32 = NDArray[np.float32]


def with_contact(maps: Maps, dataset: Dataset, paths: list[str]) -> Maps:
    """The samples, and once more those that a file has a pressure of: that one, and FE's SED."""
    state = _state_of(maps)
    row_of = {
        (int(p), int(s)): row for row, (p, s) in enumerate(zip(maps.press_id, state, strict=True))
    }
    pressures, rows = [maps.pressure_pa], [np.arange(len(maps))]
    for path in paths:
        press, states, pressure = _read(Path(path), dataset)
        found = [
            (k, row_of[key])
            for k, key in enumerate(zip(press, states, strict=True))
            if key in row_of
        ]
        pressures.append(pressure[[k for k, _ in found]])
        rows.append(np.array([row for _, row in found], dtype=np.int64))
    row = np.concatenate(rows)
    return Maps(
        np.concatenate(pressures), maps.sed_j_per_m3[row], maps.press_id[row], maps.depth_mm[row]
    )


def _state_of(maps: Maps) -> NDArray[np.int64]:
    """Which state of its press each sample is: those of a press follow one another."""
    index = np.arange(len(maps))
    begins = np.r_[True, maps.press_id[1:] != maps.press_id[:-1]]
    return index - np.maximum.accumulate(np.where(begins, index, 0))


def _read(path: Path, dataset: Dataset) -> tuple[list[int], list[int], F32]:
    """Presses, by their numbers in ``dataset``, states, and pressures ``[N, 224, 224]``, Pa."""
    arrays = read_npz(path, path.name)
    try:
        sha256 = arrays["dataset_sha256"].tobytes().decode("ascii", "replace")
        press, state, pressure = (arrays[k] for k in ("press", "state", "pressure_pa"))
    except KeyError as error:
        raise DatasetError(
            f"{path}: no array {error}; write it with `model-export contact-maps`"
        ) from error
    if sha256 not in dataset.hashes:
        raise DatasetError(
            f"{path}: of a dataset that is not trained on ({sha256[:12]}...); "
            "write it again with `model-export contact-maps`"
        )
    shape = (len(press), SIDE_PX, SIDE_PX)
    if pressure.shape != shape or state.shape != press.shape or not np.isfinite(pressure).all():
        raise DatasetError(f"{path}: pressure_pa is {pressure.shape}, expected {shape} and finite")
    first = dataset.hashes.index(sha256) * STRIDE
    return (press + first).tolist(), state.tolist(), pressure.astype(np.float32)
