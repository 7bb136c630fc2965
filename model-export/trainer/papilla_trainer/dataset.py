"""Reads a dataset of indentations and rasterises it to maps of 224 x 224.

The directory is written by ``fe-datagen generate``: ``manifest.json``, ``raster.npz`` (the sparse
map from vertices to pixels) and one ``.npz`` shard of vertex values for each indentation.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from papilla_trainer.errors import DatasetError
from papilla_trainer.lattice import (
    CELL_NODES,
    CELL_PLACE,
    Functions,
    Lattice,
    hats,
    quadratics,
)
from papilla_trainer.raster import MAP_LEN, SIDE_PX, Raster
from papilla_trainer.sampling import vertex_sampler

FORMATS = (1, 2)

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class Press:
    """One indentation of the manifest: a shard of several depths."""

    id: int
    directory: Path
    file: str
    sha256: str
    samples: int
    pitch_deg: float
    roll_deg: float
    yaw_deg: float


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

    def __len__(self) -> int:
        return len(self.press_id)


class Dataset:
    """A dataset directory whose manifest has been read and checked; maps load on demand."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        manifest = _read_manifest(directory / "manifest.json")
        try:
            self.atlas_hash = str(manifest["atlas_hash"])
            self.effects = [str(effect) for effect in manifest["effects"]]
            self.vertex_count = int(manifest["vertex_count"])
            self.pressure_max_pa = _positive(manifest, "pressure_max_pa")
            self.sed_max_j_per_m3 = _positive(manifest, "sed_max_j_per_m3")
            self.dataset_sha256 = str(manifest["dataset_sha256"])
            self.hashes = [self.dataset_sha256]
            self.presses = {int(p["id"]): _press(p, directory) for p in manifest["presses"]}
            self.train_ids = [int(i) for i in manifest["splits"]["train"]]
            self.test_ids = [int(i) for i in manifest["splits"]["test"]]
            labels = {int(p["id"]): str(p["split"]) for p in manifest["presses"]}
        except (KeyError, TypeError, ValueError) as error:
            raise DatasetError(
                f"{directory / 'manifest.json'}: missing or malformed entry ({error!r}); "
                "write the dataset again with `fe-datagen generate`"
            ) from error
        self._check_identity()
        self._check_splits(labels)
        self.skin = self._read_raster("skin")
        self.interface = self._read_raster("interface")
        self._sampler: tuple[NDArray[np.int64], NDArray[np.float64]] | None = None

    def load(self, ids: list[int]) -> Maps:
        """Rasterise the given indentations, in this order, all depths of each."""
        count = sum(self.presses[i].samples for i in ids)
        pressure = np.empty((count, SIDE_PX, SIDE_PX), dtype=np.float32)
        sed = np.empty_like(pressure)
        press_id = np.empty(count, dtype=np.int64)
        depth = np.empty(count, dtype=np.float32)
        start = 0
        for i in ids:
            shard = self._read_shard(self.presses[i])
            end = start + self.presses[i].samples
            pressure[start:end] = _maps(self.skin, hats, shard, "pressure_pa")
            sed[start:end] = _maps(self.interface, quadratics, shard, "sed_dermis_j_per_m3")
            press_id[start:end] = i
            depth[start:end] = shard["depth_mm"]
            start = end
        return Maps(pressure, sed, press_id, depth)

    def vertex_pressures(self, ids: list[int]) -> F32:
        """Pressure (Pa) at the skin's vertices, ``[N, V]``, of all depths."""
        shards = [self._read_shard(self.presses[i]) for i in ids]
        return np.concatenate([self._at_vertices(shard) for shard in shards])

    def _at_vertices(self, shard: dict[str, NDArray[Any]]) -> F32:
        """What the pressure map says about the vertices, where a shard has values elsewhere."""
        if CELL_PLACE not in shard:
            pressure: F32 = shard["pressure_pa"]
            return pressure
        if self._sampler is None:
            self._sampler = vertex_sampler(self.skin, self.vertex_count)
        pixels, weights = self._sampler
        maps = _maps(self.skin, hats, shard, "pressure_pa").reshape(-1, MAP_LEN)
        return (maps[:, pixels] * weights).sum(axis=2).clip(min=0.0).astype(np.float32)

    def _check_identity(self) -> None:
        hashes = "".join(self.presses[i].sha256 for i in sorted(self.presses))
        if hashlib.sha256(hashes.encode()).hexdigest() != self.dataset_sha256:
            raise DatasetError(
                f"{self.directory}: dataset_sha256 does not follow from the shards listed; the "
                "manifest was edited or is damaged"
            )

    def _check_splits(self, labels: dict[int, str]) -> None:
        train, test = set(self.train_ids), set(self.test_ids)
        if train & test:
            raise DatasetError(
                f"{self.directory}: presses {sorted(train & test)[:5]} stand in both splits: "
                "the held-out metrics would be worthless"
            )
        if train | test != set(self.presses):
            raise DatasetError(f"{self.directory}: the splits do not cover the indentations listed")
        wrong = [i for i in self.presses if labels[i] != ("train" if i in train else "test")]
        if wrong:
            raise DatasetError(
                f"{self.directory}: press {wrong[0]} carries another split than the list does"
            )
        if not train or not test:
            raise DatasetError(f"{self.directory}: a split is empty; generate more presses")

    def _read_raster(self, patch: str) -> Raster:
        path = self.directory / "raster.npz"
        arrays = read_npz(path, path.name)
        try:
            pixel = arrays[f"{patch}_pixel"].astype(np.int64)
            vertex = arrays[f"{patch}_vertex"].astype(np.int64)
            weight = arrays[f"{patch}_weight"].astype(np.float32)
        except KeyError as error:
            raise DatasetError(f"{path}: no array {error}") from error
        if vertex.shape != (pixel.size, 3) or weight.shape != (pixel.size, 3) or not pixel.size:
            raise DatasetError(f"{path}: the arrays of patch '{patch}' do not fit each other")
        if pixel.min() < 0 or pixel.max() >= MAP_LEN or np.unique(pixel).size != pixel.size:
            raise DatasetError(
                f"{path}: pixel indices of patch '{patch}' are out of range or double"
            )
        if vertex.min() < 0 or vertex.max() >= self.vertex_count:
            raise DatasetError(
                f"{path}: patch '{patch}' names vertex {int(vertex.max())}, but the manifest "
                f"says {self.vertex_count} vertices"
            )
        return Raster(pixel, vertex, weight, _lattice(arrays, patch, path, pixel))

    def _read_shard(self, press: Press) -> dict[str, NDArray[Any]]:
        path = press.directory / press.file
        arrays = read_npz(path, press.file, sha256=press.sha256)
        columns = self.vertex_count
        if CELL_PLACE in arrays:
            columns = int(arrays[CELL_NODES].max()) + 1
        for name in ("pressure_pa", "sed_dermis_j_per_m3"):
            values = arrays.get(name)
            if values is None or values.shape != (press.samples, columns):
                shape = None if values is None else values.shape
                raise DatasetError(
                    f"{path}: array {name} has shape {shape}, expected {(press.samples, columns)}"
                )
            if values.dtype != np.float32 or not np.isfinite(values).all():
                raise DatasetError(f"{path}: array {name} is not finite float32")
        if arrays.get("depth_mm", np.empty(0)).shape != (press.samples,):
            raise DatasetError(f"{path}: array depth_mm is missing or of another length")
        return arrays


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


def read_npz(path: Path, name: str, sha256: str | None = None) -> dict[str, NDArray[Any]]:
    """All arrays of an archive, whose SHA-256 is checked if one is given."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DatasetError(f"{path}: {error.strerror or error}") from error
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        raise DatasetError(f"{path}: its SHA-256 is not the manifest's; the file {name} is damaged")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    except (ValueError, OSError, zipfile.BadZipFile) as error:
        raise DatasetError(f"{path}: not a readable .npz ({error})") from error


def _lattice(
    arrays: dict[str, Any], patch: str, path: Path, pixel: NDArray[np.int64]
) -> Lattice | None:
    """Of the skin the points of each pixel, of the interface its middle."""
    if f"{patch}_side" not in arrays:
        return None
    side, place = arrays[f"{patch}_side"].astype(np.int64), arrays[f"{patch}_place"]
    if side.shape != pixel.shape or place.shape != (*pixel.shape, 2):
        raise DatasetError(f"{path}: the places of patch '{patch}' are not its pixels'")
    middle = Lattice(side, place.astype(np.float64))
    return middle.within(pixel) if patch == "skin" else middle


def _maps(raster: Raster, functions: Functions, shard: dict[str, NDArray[Any]], name: str) -> F32:
    """``[D, 224, 224]`` of a shard's array, whatever its values belong to."""
    if CELL_PLACE not in shard:
        return raster.rasterise(shard[name])
    if raster.lattice is None:
        raise DatasetError("raster.npz does not say where pixels lie among cells")
    nodes, weights = raster.lattice.read(shard[CELL_PLACE], shard[CELL_NODES], functions)
    points = np.einsum("dnk,nk->dn", shard[name][:, nodes], weights)
    points = points.reshape(len(points), -1, len(raster.pixel))
    return raster.scattered(points.mean(axis=1, dtype=np.float64).clip(min=0.0).astype(np.float32))


def _positive(manifest: dict[str, Any], key: str) -> float:
    value = float(manifest[key])
    if not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{key} = {value} is not positive")
    return value


def _press(entry: dict[str, Any], directory: Path) -> Press:
    return Press(
        id=int(entry["id"]),
        directory=directory,
        file=str(entry["file"]),
        sha256=str(entry["sha256"]),
        samples=int(entry["samples"]),
        pitch_deg=float(entry["pitch_deg"]),
        roll_deg=float(entry["roll_deg"]),
        yaw_deg=float(entry["yaw_deg"]),
    )
