"""Datasets of campaigns, as arrays."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import BadDataset, BadInput
from ..model import native
from ..wire import SIDE_PX

if TYPE_CHECKING:
    from .. import _native

MAPS: Final = ("pressure_pa", "sed_dermis_j_per_m3")
"""Maps that are drawn if none are named; there are `sed_epidermis_j_per_m3` and, with friction, `shear_pa` too."""


class Press(NamedTuple):
    """One simulation of a dataset."""

    entry: dict[str, Any]
    """What the manifest says of it: `id`, `indenter`, `shape`, `pitch_deg`, `roll_deg`, `yaw_deg`, `offset_mm`, `split`
    and more."""
    arrays: dict[str, NDArray[Any]]
    """With the state as first axis: `depth_mm`, `force_n` (x y z), `slide_mm` if it slid, `checks`, and the maps."""


class Dataset:
    """A dataset in a folder: `manifest.json` and the states of each simulation.

    `len` is the number of states. Raises BadDataset.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        self._native: _native.Dataset = native().Dataset(self.folder)
        self.manifest: dict[str, Any] = json.loads(self._native.manifest())
        """The members of `manifest.json` (docs/reference/dataset.md)."""

    def __len__(self) -> int:
        return sum(press["samples"] for press in self.manifest["presses"])

    def __repr__(self) -> str:
        presses = len(self.manifest["presses"])
        return f"<papilla.fe.Dataset {str(self.folder)!r}: {len(self)} states of {presses} simulations>"

    def ids(self, split: str | None = None) -> list[int]:
        """Numbers of the simulations, or of those of a split: `"train"` or `"test"`."""
        if split not in (None, "train", "test"):
            raise BadInput("split", f"{split!r}; there are 'train' and 'test'")
        return [press["id"] for press in self.manifest["presses"] if split in (None, press["split"])]

    def press(self, id: int, maps: Sequence[str] = MAPS) -> Press:
        """One simulation; its file's hash is checked. Raises BadDataset."""
        if isinstance(maps, str):
            raise BadInput("maps", f"give a list of names: [{maps!r}]")
        found = {name: _array(name, values) for name, values in self._native.press(id, list(maps)).items()}
        entry = next(press for press in self.manifest["presses"] if press["id"] == id)
        return Press(entry, found)

    def presses(self, split: str | None = None, maps: Sequence[str] = MAPS) -> Iterator[Press]:
        """The simulations one after the other, for datasets that do not fit in memory."""
        for id in self.ids(split):
            yield self.press(id, maps)

    def arrays(self, split: str | None = None, maps: Sequence[str] = MAPS) -> dict[str, NDArray[Any]]:
        """All states as arrays, with the state as first axis: those of `Press.arrays`, the simulation of each state
        (`press`) and its number there (`state`). A map takes 0.2 MB for each state. Raises BadInput for a split
        without simulations."""
        pressed = list(self.presses(split, maps))
        if not pressed:
            raise BadInput("split", f"no simulation of the dataset is in {split!r}")
        names = pressed[0].arrays
        found = {name: np.concatenate([press.arrays[name] for press in pressed]) for name in names}
        counts = [len(press.arrays["depth_mm"]) for press in pressed]
        found["press"] = np.repeat([press.entry["id"] for press in pressed], counts)
        found["state"] = np.concatenate([np.arange(count) for count in counts])
        return found

    def of_campaign(self, campaign: dict[str, Any]) -> Dataset:
        """Itself, if it is of this campaign. Raises BadDataset."""
        if self.manifest["campaign"] != campaign:
            name = self.manifest["campaign"]["name"]
            raise BadDataset(f"{self.folder} holds the dataset of another campaign, {name}")
        return self


def _array(name: str, values: bytes) -> NDArray[Any]:
    if name == "checks":
        return np.frombuffer(values, "<f8").reshape(-1, 11)
    found = np.frombuffer(values, "<f4")
    shapes = {"depth_mm": (), "force_n": (3,), "slide_mm": (2,), "shear_pa": (3, SIDE_PX, SIDE_PX)}
    return found.reshape(-1, *shapes.get(name, (SIDE_PX, SIDE_PX)))
