"""Several datasets of one atlas as one."""

from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path

from papilla_trainer.dataset import Dataset, State
from papilla_trainer.errors import DatasetError
from papilla_trainer.maps import F32, Store

# Press 7 of the second dataset is press 1000007 of the joined one.
STRIDE = 1_000_000


class JoinedDataset(Dataset):
    """Presses of all, the greatest of their scales; folder and atlas of the first.

    Its SHA-256 is that of the datasets' SHA-256s (hexadecimal) one after another.
    """

    def __init__(self, parts: list[Dataset]) -> None:
        first = parts[0]
        for other in parts[1:]:
            if other.finger_sha256 != first.finger_sha256:
                raise DatasetError(f"{other.directory}: of another finger than {first.directory}")
            if other.atlas_hash != first.atlas_hash or other.effects != first.effects:
                raise DatasetError(
                    f"{other.directory}: of another atlas or other effects than {first.directory}"
                )
        self._take_over(first)
        self.parts = parts
        self.pressure_max_pa = max(part.pressure_max_pa for part in parts)
        self.sed_max_j_per_m3 = max(part.sed_max_j_per_m3 for part in parts)
        self.hashes = [part.dataset_sha256 for part in parts]
        if len(set(self.hashes)) < len(parts):
            raise DatasetError(f"{first.directory}: a dataset is given twice")
        self.dataset_sha256 = hashlib.sha256("".join(self.hashes).encode()).hexdigest()
        self.presses, self.train_ids, self.test_ids = {}, [], []
        for k, part in enumerate(parts):
            for i, press in part.presses.items():
                self.presses[k * STRIDE + i] = dataclasses.replace(press, id=k * STRIDE + i)
            self.train_ids += [k * STRIDE + i for i in part.train_ids]
            self.test_ids += [k * STRIDE + i for i in part.test_ids]

    def mask(self) -> F32:
        """As of each of them: they have the same atlas."""
        return self.parts[0].mask()

    def states(self, ids: list[int]) -> list[State]:
        """As :meth:`Dataset.states`, of all of them."""
        found = []
        for i in ids:
            states = self.parts[i // STRIDE].states([i % STRIDE])
            found += [state._replace(press_id=i) for state in states]
        return found


def open_datasets(directories: list[Path], store: Store | None = None) -> Dataset:
    """One dataset as it is, several joined."""
    parts = [Dataset(directory, store) for directory in directories]
    return parts[0] if len(parts) == 1 else JoinedDataset(parts)
