"""A dataset of simulations: what its manifest says, and the maps of its states.

``fe-datagen generate`` writes the folder; how its values become maps is the matter of
:mod:`papilla_trainer.maps`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError
from papilla_trainer.maps import F32, DrawnMaps, Store

FORMATS = (1, 2)


@dataclass(frozen=True)
class Press:
    """One simulation of the manifest."""

    id: int
    samples: int


class State(NamedTuple):
    """One sample: maps ``[224, 224]``, views of what is on disk, and where they are from."""

    pressure_pa: F32
    sed_j_per_m3: F32
    press_id: int
    state: int
    depth_mm: float


@dataclass(frozen=True)
class Maps:
    """Samples in memory, with where each came from.

    ``pressure_pa`` and ``sed_j_per_m3``: float32 ``[N, 224, 224]``; ``press_id`` and ``depth_mm``:
    ``[N]``.
    """

    pressure_pa: F32
    sed_j_per_m3: F32
    press_id: NDArray[np.int64]
    depth_mm: F32

    @staticmethod
    def of(states: Sequence[State]) -> Maps:
        """Copies of the states' maps."""
        return Maps(
            np.stack([state.pressure_pa for state in states]),
            np.stack([state.sed_j_per_m3 for state in states]),
            np.array([state.press_id for state in states], dtype=np.int64),
            np.array([state.depth_mm for state in states], dtype=np.float32),
        )

    def __len__(self) -> int:
        return len(self.press_id)


class Dataset:
    """A dataset's folder whose manifest has been read; maps are looked for on first use."""

    def __init__(self, directory: Path, store: Store | None = None) -> None:
        self.directory = directory
        self.store = store or Store()
        manifest = _read_manifest(directory / "manifest.json")
        try:
            self.atlas_hash = str(manifest["atlas_hash"])
            self.effects = [str(effect) for effect in manifest["effects"]]
            # None: the default finger.
            self.finger_sha256: str | None = manifest["campaign"].get("finger_sha256")
            self.vertex_count = int(manifest["vertex_count"])
            self.pressure_max_pa = _positive(manifest, "pressure_max_pa")
            self.sed_max_j_per_m3 = _positive(manifest, "sed_max_j_per_m3")
            self.dataset_sha256 = str(manifest["dataset_sha256"])
            self.hashes = [self.dataset_sha256]
            entries = [Press(int(p["id"]), int(p["samples"])) for p in manifest["presses"]]
            self.presses = {press.id: press for press in entries}
            self.train_ids = [int(i) for i in manifest["splits"]["train"]]
            self.test_ids = [int(i) for i in manifest["splits"]["test"]]
        except (KeyError, TypeError, ValueError) as error:
            raise DatasetError(
                f"{directory / 'manifest.json'}: missing or malformed entry ({error!r}); "
                "write the dataset again with `fe-datagen generate`"
            ) from error
        if not self.train_ids or not self.test_ids:
            raise DatasetError(f"{directory}: a split is empty; generate more presses")

    def _take_over(self, other: Dataset) -> None:
        """All that ``other`` says of itself, for a view that then changes what it shares out.

        A member that is added to this class reaches every view by this.
        """
        self.__dict__.update({k: v for k, v in other.__dict__.items() if k != "drawn"})

    @cached_property
    def drawn(self) -> DrawnMaps:
        """All maps, on disk. Whoever draws them checks hashes, splits and values of the dataset."""
        drawn = self.store.maps_of(self.directory)
        if len(drawn.press) != sum(press.samples for press in self.presses.values()):
            raise DatasetError(f"{self.directory}: its maps are not of the states that it lists")
        return drawn

    def mask(self) -> F32:
        """``[224, 224]``: 1 on the pixels that show the interface, 0 outside."""
        return self.drawn.interface.astype(np.float32)

    def states(self, ids: list[int]) -> list[State]:
        """The states of the given simulations, in this order, all depths of each."""
        drawn = self.drawn
        presses, rows = np.unique(drawn.press, return_index=True)
        first = dict(zip(presses.tolist(), rows.tolist(), strict=True))
        return [
            State(
                drawn.pressure_pa[row],
                drawn.sed_j_per_m3[row],
                i,
                int(drawn.state[row]),
                float(drawn.depth_mm[row]),
            )
            for i in ids
            for row in range(first[i], first[i] + self.presses[i].samples)
        ]

    def load(self, ids: list[int]) -> Maps:
        """Copies of the maps of the given simulations, in this order, all depths of each."""
        return Maps.of(self.states(ids))


class View(Dataset):
    """The simulations of another dataset, shared out in another way."""

    def __init__(self, whole: Dataset) -> None:
        self._take_over(whole)
        self.whole = whole

    @property
    def drawn(self) -> DrawnMaps:  # type: ignore[override]
        """The maps of the whole dataset."""
        return self.whole.drawn

    def mask(self) -> F32:
        """As of the whole dataset."""
        return self.whole.mask()


def validation_split(train_ids: list[int], count: int, seed: int) -> tuple[list[int], list[int]]:
    """Set ``count`` *train* indentations aside to choose the epoch by; the test ones stay."""
    if not 0 <= count < len(train_ids):
        raise DatasetError(
            f"cannot set {count} of {len(train_ids)} training indentations aside for validation"
        )
    order = np.random.default_rng([seed, 0x5EED]).permutation(len(train_ids))
    chosen = {train_ids[i] for i in order[:count]}
    return [i for i in train_ids if i not in chosen], [i for i in train_ids if i in chosen]


def fewer(ids: list[int], count: int | None, seed: int) -> list[int]:
    """``count`` of them by lot, in their order; of two counts the larger has the smaller."""
    if count is None or count >= len(ids):
        return ids
    order = np.random.default_rng([seed, 0xC04E]).permutation(len(ids))
    return [ids[i] for i in sorted(order[:count])]


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise DatasetError(
            f"{path} does not exist: give the directory that `fe-datagen generate` wrote"
        ) from error
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: {error}") from error
    if not isinstance(manifest, dict) or manifest.get("format") not in FORMATS:
        raise DatasetError(f"{path}: not a dataset manifest of a format among {FORMATS}")
    return manifest


def _positive(manifest: dict[str, Any], key: str) -> float:
    value = float(manifest[key])
    if not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{key} = {value} is not positive")
    return value
