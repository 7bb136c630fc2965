"""A tiny dataset in the real format, for tests of the trainer's mechanics, with its maps.

Not finite elements: smooth made-up bumps on a grid of triangles. No figure from it means anything.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from pathlib import Path

import numpy as np

SIDE = 224
COLUMNS, ROWS = 9, 12


def write_tiny_dataset(directory: Path, presses: int = 6, depths: int = 6, seed: int = 1) -> Path:
    """Write manifest, rasters, shards and maps; every fifth (from the third) is for testing."""
    (directory / "shards").mkdir(parents=True)
    random = np.random.default_rng(seed)
    skin, triangles = _grid(16.0, 208.0)
    interface, _ = _grid(30.3, 193.1)
    arrays: dict[str, np.ndarray] = {}
    rasters = {}
    for name, uv in (("skin", skin), ("interface", interface)):
        pixel, vertex, weight = rasters[name] = _raster(uv, triangles)
        arrays |= {f"{name}_pixel": pixel, f"{name}_vertex": vertex, f"{name}_weight": weight}
    np.savez_compressed(directory / "raster.npz", **arrays)
    entries, shards, pressure_max, sed_max = [], [], 0.0, 0.0
    for i in range(presses):
        shard = _press(skin, random, depths)
        shards.append(shard)
        pressure_max = max(pressure_max, float(shard["pressure_pa"].max()))
        sed_max = max(sed_max, float(shard["sed_dermis_j_per_m3"].max()))
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **shard)
        file = f"shards/press-{i:05}.npz"
        (directory / file).write_bytes(buffer.getvalue())
        entries.append(
            {
                "id": i,
                "file": file,
                "sha256": hashlib.sha256(buffer.getvalue()).hexdigest(),
                "split": "test" if i % 5 == 2 else "train",
                "samples": depths,
                "pitch_deg": float(i),
                "roll_deg": 0.0,
                "yaw_deg": 0.0,
                "checks": {},
            }
        )
    splits = {
        split: [e["id"] for e in entries if e["split"] == split] for split in ("train", "test")
    }
    hashes = "".join(e["sha256"] for e in entries)
    manifest = {
        "format": 1,
        "atlas_hash": hashlib.sha256(skin.tobytes()).hexdigest(),
        "campaign": {},
        "seed": seed,
        "software": "tiny_dataset",
        "units": {"pressure": "Pa", "sed": "J/m3", "depth": "mm", "force": "N"},
        "effects": ["finite_strain", "layers"],
        "vertex_count": len(skin),
        "pressure_max_pa": pressure_max,
        "sed_max_j_per_m3": sed_max,
        "presses": entries,
        "splits": splits,
        "dataset_sha256": hashlib.sha256(hashes.encode()).hexdigest(),
    }
    (directory / "manifest.json").write_text(json.dumps(manifest))
    atlas = tiny_atlas(manifest["atlas_hash"], skin, interface, triangles)
    (directory / "atlas.json").write_text(json.dumps(atlas))
    _write_maps(directory, shards, rasters)
    return directory


def _write_maps(directory: Path, shards: list[dict[str, np.ndarray]], rasters: dict) -> None:
    """As ``fe-datagen dataset maps`` does, into the folder where maps are kept."""
    text = (directory / "manifest.json").read_bytes()
    sha256 = hashlib.sha256(text).hexdigest()
    folder = Path(os.environ["PAPILLA_MAPS"]) / f"{sha256[:16]}-1"
    folder.mkdir(exist_ok=True)
    depths = len(shards[0]["depth_mm"])
    arrays = {
        "pressure_pa": drawn(_values(shards, "pressure_pa"), *rasters["skin"]),
        "sed_j_per_m3": drawn(_values(shards, "sed_dermis_j_per_m3"), *rasters["interface"]),
        "press": np.repeat(np.arange(len(shards)), depths),
        "state": np.tile(np.arange(depths), len(shards)),
        "depth_mm": np.concatenate([shard["depth_mm"] for shard in shards]),
    }
    for patch, (pixel, _, _) in rasters.items():
        arrays[patch] = np.isin(np.arange(SIDE**2), pixel).reshape(SIDE, SIDE)
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array)
    about = {"format": 1, "manifest_sha256": sha256, "states": len(arrays["press"])}
    (folder / "maps.json").write_text(json.dumps(about))


def _values(shards: list[dict[str, np.ndarray]], name: str) -> np.ndarray:
    return np.concatenate([shard[name] for shard in shards])


def vertex_pressures(directory: Path, ids: list[int]) -> np.ndarray:
    """``[N, V]``: what the shards hold."""
    shards = [np.load(directory / f"shards/press-{i:05}.npz") for i in ids]
    return _values(shards, "pressure_pa")


def drawn(
    values: np.ndarray, pixel: np.ndarray, vertex: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """Values ``[N, V]`` at the vertices as maps ``[N, 224, 224]``, linear in each triangle."""
    maps = np.zeros((len(values), SIDE * SIDE), dtype=np.float32)
    maps[:, pixel] = (values[:, vertex] * weight).sum(axis=2)
    return maps.reshape(-1, SIDE, SIDE)


def tiny_atlas(
    hash_: str, skin: np.ndarray, interface: np.ndarray, triangles: np.ndarray
) -> dict[str, object]:
    """A flat patch of 0.1 mm per pixel, mirror-symmetric about its middle column."""

    def patch(uv: np.ndarray, height: float) -> dict[str, list]:
        x, y = 0.1 * uv[:, 1], 0.1 * (uv[:, 0] - 0.5 * (uv[:, 0].min() + uv[:, 0].max()))
        positions = np.stack([x, y, np.full_like(x, height)], axis=1)
        return {"positions_mm": positions.tolist(), "uv_px": uv.tolist()}

    return {
        "version": 1,
        "hash": hash_,
        "mm_per_px": 0.1,
        "triangles": triangles.tolist(),
        "skin": patch(skin, 0.0),
        "interface": patch(interface, 0.2),
    }


def write_tiny_operator(directory: Path, name: str = "operator.npz") -> Path:
    """A made-up operator of the dataset's atlas: faces are the cells of its grid."""
    atlas = json.loads((directory / "atlas.json").read_text())
    skin = np.array(atlas["skin"]["positions_mm"])
    vertices = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    corners = np.stack(
        [vertices[:-1, :-1], vertices[:-1, 1:], vertices[1:, :-1], vertices[1:, 1:]], axis=-1
    ).reshape(-1, 4)
    offset = skin[corners].mean(axis=1)[:, None] - skin[None]
    apart = np.linalg.norm(offset, axis=2)
    scales = 1.0 + 0.5 * np.arange(6)
    g = 1e-3 * np.exp(-((apart[:, None] / scales[None, :, None]) ** 2))
    # Shear across the finger is opposed in the mirror.
    g[:, (2, 4)] *= offset[:, None, :, 1]
    face = np.zeros((len(skin), 4), dtype=np.int32)
    weight = np.zeros((len(skin), 4), dtype=np.float32)
    for v in range(len(skin)):
        around = np.flatnonzero((corners == v).any(axis=1))
        face[v, : len(around)] = around
        weight[v, : len(around)] = 1.0 / len(around)
    path = directory / name
    np.savez(path, face_g=g.astype(np.float32), vertex_face=face, vertex_weight=weight)
    path.with_suffix(".json").write_text(json.dumps({"atlas_hash": atlas["hash"]}))
    return path


def _press(uv: np.ndarray, random: np.random.Generator, depths: int) -> dict[str, np.ndarray]:
    centre = random.uniform(80, 144, size=2)
    squared = ((uv - centre) ** 2).sum(axis=1)
    depth = np.linspace(0.5, 2.0, depths, dtype=np.float32)
    radius = 25.0 * np.sqrt(depth)[:, None]
    pressure = 2e4 * depth[:, None] * np.clip(1 - squared / radius**2, 0, None)
    sed = 3e3 * depth[:, None] ** 2 * np.exp(-squared / radius**2)
    return {
        "pressure_pa": pressure.astype(np.float32),
        "sed_dermis_j_per_m3": sed.astype(np.float32),
        "sed_epidermis_j_per_m3": (1.5 * sed).astype(np.float32),
        "depth_mm": depth,
        "force_n": np.zeros((depths, 3), dtype=np.float32),
    }


def _grid(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.meshgrid(np.linspace(low, high, COLUMNS), np.linspace(low, high, ROWS))
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    corner = (np.arange(ROWS - 1)[:, None] * COLUMNS + np.arange(COLUMNS - 1)).ravel()
    a, b, c, d = corner, corner + 1, corner + COLUMNS, corner + COLUMNS + 1
    return uv, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def _raster(uv: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows, columns = np.divmod(np.arange(SIDE * SIDE), SIDE)
    points = np.stack([columns + 0.5, rows + 0.5], axis=1)
    owner = np.full(SIDE * SIDE, -1)
    weights = np.zeros((SIDE * SIDE, 3))
    for index, (a, b, c) in enumerate(uv[triangles]):
        w = np.linalg.solve(np.stack([b - a, c - a], axis=1), (points - a).T).T
        bary = np.stack([1 - w.sum(axis=1), w[:, 0], w[:, 1]], axis=1)
        inside = (bary >= -1e-9).all(axis=1) & (owner < 0)
        owner[inside] = index
        weights[inside] = bary[inside]
    pixel = np.flatnonzero(owner >= 0)
    return (
        pixel.astype(np.uint32),
        triangles[owner[pixel]].astype(np.uint32),
        weights[pixel].astype(np.float32),
    )
