"""Maps of a dataset's states: ``fe-datagen dataset maps`` draws them, here they are read.

A dataset holds values at the nodes of meshes that differ from simulation to simulation. How they
become pixels is written once, in Rust; a folder of NumPy arrays is what comes out. It is kept, by
the hash of the dataset's manifest, so that it is drawn once.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError

# Pixels across a map, and in one.
SIDE_PX = 224
MAP_LEN = SIDE_PX * SIDE_PX

# What `fe-datagen dataset maps` writes.
FORMAT = 1
_ABOUT = "maps.json"
_ARRAYS = {
    "pressure_pa": (np.float32, (SIDE_PX, SIDE_PX)),
    "sed_j_per_m3": (np.float32, (SIDE_PX, SIDE_PX)),
    "press": (np.int64, ()),
    "state": (np.int64, ()),
    "depth_mm": (np.float32, ()),
}

PROGRAM_VARIABLE = "FE_DATAGEN"
FOLDER_VARIABLE = "PAPILLA_MAPS"

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class DrawnMaps:
    """Arrays on disk, of which memory holds what is being read.

    ``pressure_pa`` (Pa) and ``sed_j_per_m3`` (J/m3): ``[N, 224, 224]``; ``press``, ``state`` and
    ``depth_mm``: ``[N]``, the simulation, which of its states, and how deep; ``interface``: bool
    ``[224, 224]``, the pixels that show the interface.
    """

    pressure_pa: F32
    sed_j_per_m3: F32
    press: NDArray[np.int64]
    state: NDArray[np.int64]
    depth_mm: F32
    interface: NDArray[np.bool_]

    @staticmethod
    def open(folder: Path) -> DrawnMaps:
        """Map the arrays of a folder into memory; refuses other types and shapes."""
        count = int(_about(folder).get("states", -1))
        arrays = {}
        for name, (dtype, shape) in _ARRAYS.items():
            arrays[name] = _mapped(folder / f"{name}.npy", dtype, (count, *shape))
        interface = _mapped(folder / "interface.npy", np.bool_, (SIDE_PX, SIDE_PX))
        return DrawnMaps(interface=interface, **arrays)


@dataclass(frozen=True)
class Store:
    """Where maps are kept, and what draws those that are not there.

    ``folder`` has maps itself, or folders of maps; without it ``PAPILLA_MAPS`` names it, else it is
    ``papilla/maps`` in the user's cache. ``program``: fe-datagen; without it ``FE_DATAGEN`` names
    it, else it is looked for in ``PATH``.
    """

    folder: Path | None = None
    program: str | None = None

    def maps_of(self, dataset: Path) -> DrawnMaps:
        """The maps of the dataset in this folder, drawn now if they never were."""
        try:
            sha256 = hashlib.sha256((dataset / "manifest.json").read_bytes()).hexdigest()
        except OSError as error:
            raise DatasetError(f"{dataset / 'manifest.json'}: {error.strerror or error}") from error
        home = self._home()
        found = _find(home, sha256)
        if found is None:
            self._draw(dataset, home / f"{sha256[:16]}-{FORMAT}")
            found = _find(home, sha256)
        if found is None:
            raise DatasetError(
                f"{home}: {self._program()} wrote maps of another format than {FORMAT}, or of "
                f"another manifest than {dataset}'s; build it from the same sources as the trainer"
            )
        return DrawnMaps.open(found)

    def _home(self) -> Path:
        if self.folder is not None:
            return self.folder
        named = os.environ.get(FOLDER_VARIABLE)
        if named:
            return Path(named)
        cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        return Path(cache) / "papilla" / "maps"

    def _program(self) -> str:
        return self.program or os.environ.get(PROGRAM_VARIABLE) or "fe-datagen"

    def _draw(self, dataset: Path, out: Path) -> None:
        program = self._program()
        path = shutil.which(program)
        if path is None:
            raise DatasetError(
                f"the maps of {dataset} are not in {out.parent}, and there is no program "
                f"{program!r} to draw them: build it with `cargo build --release -p "
                f"papilla-fe-datagen` and name it by --fe-datagen or {PROGRAM_VARIABLE} "
                "(target/release/fe-datagen), or write the maps elsewhere with `fe-datagen dataset "
                f"maps {dataset} --out DIR` and name DIR by --maps"
            )
        # `path` is what the user named.
        command = [path, "dataset", "maps", str(dataset), "--out", str(out)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
        # Another run may have drawn them meanwhile: then this one found the folder there.
        if done.returncode != 0 and not (out / _ABOUT).is_file():
            said = done.stderr.strip().removeprefix("error: ")
            raise DatasetError(f"{' '.join(command)} failed (exit code {done.returncode}): {said}")


def _find(home: Path, manifest_sha256: str) -> Path | None:
    """The folder of these maps: this one, or one in it."""
    for folder in _folders(home):
        about = _about(folder)
        if about.get("format") == FORMAT and about.get("manifest_sha256") == manifest_sha256:
            return folder
    return None


def _folders(home: Path) -> Iterator[Path]:
    if (home / _ABOUT).is_file():
        yield home
    if home.is_dir():
        yield from sorted(path.parent for path in home.glob(f"*/{_ABOUT}"))


def _about(folder: Path) -> dict[str, Any]:
    path = folder / _ABOUT
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: {error}; delete {folder}, it is drawn anew") from error
    if not isinstance(about, dict):
        raise DatasetError(f"{path}: not a JSON object; delete {folder}, it is drawn anew")
    return about


def _mapped(path: Path, dtype: type, shape: tuple[int, ...]) -> Any:
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: {error}; delete {path.parent}, it is drawn anew") from error
    if array.dtype != dtype or array.shape != shape:
        raise DatasetError(
            f"{path}: {array.dtype} of shape {array.shape}, expected {np.dtype(dtype)} of shape "
            f"{shape}; delete {path.parent}, it is drawn anew"
        )
    return array.view(np.ndarray)
