"""Files of a scene that is solved, as `fe-datagen solve` writes them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from ..errors import BadInput
from ..save import whole
from ..wire import Map

_HEAD: Final = (
    '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian" '
    'header_type="UInt64">\n  <Collection>\n'
)


class State(Protocol):
    """What is written: a `papilla.fe.State`."""

    number: int
    summary: dict[str, Any]
    maps: dict[str, Map]

    @property
    def depth_mm(self) -> float: ...

    def write_vtu(self, path: str | PathLike[str]) -> None: ...


class Files:
    """A folder that takes states as they are found.

    `outputs` names what is written besides `summary.json`: `fields` (`.vtu` and `series.pvd`) and `maps` (`maps.npz`).
    """

    def __init__(self, folder: str | PathLike[str], scene: Mapping[str, Any], outputs: Sequence[str]) -> None:
        self._folder, self._scene, self._outputs = Path(folder), dict(scene), tuple(outputs)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput("out", f"{folder} is no folder that can be written to ({error})") from error

    def take(self, state: State) -> None:
        """Writes the fields of a state, in place of an earlier one with its number."""
        if "fields" in self._outputs:
            state.write_vtu(self._folder / _name(state.number))

    def finish(
        self, states: Sequence[State], reason: str | None, mended: Sequence[str] = (), doubts: Sequence[str] = ()
    ) -> None:
        """Writes what is of all states; `reason` says why there are no more, None where all were found.

        `mended` and `doubts` are what `Solve` says.
        """
        if "fields" in self._outputs:
            self._series(states)
        if "maps" in self._outputs and states and states[0].maps:
            arrays = {name: np.stack([state.maps[name] for state in states]) for name in states[0].maps}
            arrays["depth_mm"] = np.array([state.depth_mm for state in states], np.float32)
            with whole(self._folder / "maps.npz") as there, there.open("wb") as file:
                np.savez_compressed(file, allow_pickle=False, **arrays)
        summary: dict[str, Any] = {"scene": self._scene, "increments": [state.summary for state in states]}
        summary |= {name: list(said) for name, said in (("mended", mended), ("doubts", doubts)) if said}
        if reason is not None:
            summary["ended"] = reason
        with whole(self._folder / "summary.json") as there:
            there.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")

    def _series(self, states: Sequence[State]) -> None:
        """What ParaView opens: the states by their depth, or by their number where a depth comes twice."""
        depths = [state.depth_mm for state in states]
        rising = all(after > before for before, after in pairwise(depths))
        lines = [
            f'    <DataSet timestep="{_plain(state.depth_mm if rising else state.number)}" group="" part="0" '
            f'file="{_name(state.number)}"/>\n'
            for state in states
        ]
        with whole(self._folder / "series.pvd") as there:
            there.write_text(_HEAD + "".join(lines) + "  </Collection>\n</VTKFile>\n", encoding="utf-8")


def _plain(value: float) -> str:
    return repr(value).removesuffix(".0")


def _name(number: int) -> str:
    return f"state-{number:03}.vtu"
