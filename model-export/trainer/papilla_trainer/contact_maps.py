"""The pressure that the service's own contact makes of a dataset's presses.

``model-export contact-maps`` writes it. Contact errs by some tenth of the pressure, and not by
chance: a network that learns FE's SED from both pressures makes up for a part of that.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from papilla_trainer.dataset import Dataset, State
from papilla_trainer.errors import DatasetError
from papilla_trainer.files import read_npz
from papilla_trainer.joined import STRIDE
from papilla_trainer.maps import F32, SIDE_PX


def with_contact(states: list[State], dataset: Dataset, paths: list[str]) -> list[State]:
    """The states, and once more those that a file has a pressure of: that one, and FE's SED."""
    known = {(state.press_id, state.state): state for state in states}
    found = list(states)
    for path in paths:
        press, numbers, pressure = _read(Path(path), dataset)
        for key, own in zip(zip(press, numbers, strict=True), pressure, strict=True):
            if key in known:
                found.append(known[key]._replace(pressure_pa=own))
    return found


def _read(path: Path, dataset: Dataset) -> tuple[list[int], list[int], F32]:
    """Presses, by their numbers in ``dataset``, states, and pressures ``[N, 224, 224]``, Pa."""
    arrays = read_npz(path)
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
