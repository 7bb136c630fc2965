"""Meshes as they come, as objects of a session: STL, OBJ, PLY and GLB.

    part = papilla.meshes.load("part.stl", unit="mm")
    print(part.notes)
    with papilla.Session(input="objects", objects=[part.object()], map=False) as session:
        print(session.touch(part.under_pad(0.3)).touch.force_n)

Needs `papilla[meshes]` (trimesh). What a session takes: docs/reference/protocol-contact.md, 'Shapes'.
"""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import BadInput, MissingExtra

UNITS: Final = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
FILES: Final = (".stl", ".obj", ".ply", ".glb", ".gltf")
TRIANGLES_MAX: Final = 16_384
"""Of one mesh of a session."""
_ALL_MAX: Final = 32_768
SHAPE_BYTES_MAX: Final = 496 * 1024
"""Of a shape as JSON: a hello may have 512 KiB, and holds more than a shape."""
DECIMALS: Final = 4
"""Of vertices, which are sent in mm: 0.1 um."""
_PARTS_MAX: Final = 64
_SMALL_MM, _LARGE_MM = 0.5, 500.0
_PAD_MM: Final = (11.25, 0.0, -6.53)
_SAMPLES: Final = 4000
_BLOCK: Final = 2_000_000
_WINDING: Final = "inside will be told from outside by winding numbers, and the session's warnings say what was closed"


class BadMesh(BadInput):
    """A file holds no surface that the service could press on a finger."""


class Mesh(NamedTuple):
    """A body, and what was done to get it."""

    parts: list[tuple[NDArray[np.float64], NDArray[np.int64]]]
    """Vertices, mm, and triangles of each body."""
    notes: list[str]
    """What was mended, and what is to be known; empty if the file was as it should be."""
    decimated_mm: float
    """Greatest distance between what was read and what is here, at sampled points; 0 if no triangle was left out."""

    @property
    def triangles(self) -> int:
        return sum(len(triangles) for _, triangles in self.parts)

    @property
    def bounds_mm(self) -> NDArray[np.float64]:
        """Least and greatest x y z: (2, 3)."""
        every = np.concatenate([vertices for vertices, _ in self.parts])
        return np.stack([every.min(axis=0), every.max(axis=0)])

    def shape(self) -> dict[str, Any]:
        """The shape of an object of the hello: a mesh, or a union of meshes."""
        return _shape(self.parts)

    def object(self, **more: Any) -> dict[str, Any]:
        """An object of the hello; `more` may be `friction` and `stiffness_mpa_per_mm`."""
        return {"shape": self.shape(), **more}

    def under_pad(self, depth_mm: float) -> list[float]:
        """A pose, not turned, in which the mesh's highest point is below the pad's lowest, and this deep in it."""
        low, high = self.bounds_mm
        every = np.concatenate([vertices for vertices, _ in self.parts])
        top = every[int(np.argmax(every[:, 2]))]
        flat = every[every[:, 2] > high[2] - 1e-3 * (high[2] - low[2])]
        x, y = flat[:, :2].mean(axis=0) if len(flat) > 2 else top[:2]
        return [_PAD_MM[0] - float(x), -float(y), _PAD_MM[2] - float(high[2]) + depth_mm, 0.0, 0.0, 0.0, 1.0]


def _shape(parts: list[tuple[NDArray[np.float64], NDArray[np.int64]]]) -> dict[str, Any]:
    shapes = [
        {"shape": "mesh", "vertices_mm": vertices.tolist(), "triangles": triangles.tolist()}
        for vertices, triangles in parts
    ]
    return shapes[0] if len(shapes) == 1 else {"shape": "union", "parts": [{"part": each} for each in shapes]}


def load(path: str | PathLike[str], *, unit: str | None = None, triangles_max: int = TRIANGLES_MAX) -> Mesh:
    """Reads a mesh: merges vertices, turns triangles outward, parts bodies, decimates; says so in `notes`.

    Vertices are rounded to 0.1 um. Where so many triangles take more bytes than a hello may have, the mesh is
    decimated further than to `triangles_max`.

    `unit` is mm, cm, m or in. Without it GLB is in metres, as its standard says, and others count as mm; a size
    that looks wrong is then asked about. A surface that is open or crosses itself is sent as it is, with a note:
    whoever computes contact tells its inside from its outside by winding numbers, and says in the session's
    `warnings` what it closed; a sheet, which has no inside, is refused there.
    """
    trimesh = _trimesh()
    file = Path(path)
    if file.suffix.lower() not in FILES:
        raise BadInput("path", f"{file.name}: none of {', '.join(FILES)}")
    if not file.is_file():
        raise BadInput("path", f"{file} does not exist")
    try:
        # Not processed: that drops vertices that are not finite, and their triangles, and says nothing.
        read = trimesh.load(file, force="mesh", process=False)
    except Exception as error:  # trimesh raises whatever its many readers do.
        raise BadMesh("path", f"{file.name} cannot be read: {error}") from error
    if not isinstance(read, trimesh.Trimesh) or not len(read.faces):
        raise BadMesh("path", f"{file.name} holds no triangles")
    if not np.isfinite(read.vertices).all():
        raise BadMesh("path", f"{file.name}: a vertex is not finite")
    vertices = np.asarray(read.vertices, np.float64) * _factor(file, unit, np.asarray(read.vertices, np.float64))
    return of(vertices, np.asarray(read.faces, np.int64), triangles_max=triangles_max, name=file.name)


def of(vertices_mm: Any, triangles: Any, *, triangles_max: int = TRIANGLES_MAX, name: str = "the mesh") -> Mesh:
    """The same from arrays."""
    trimesh = _trimesh()
    if not 4 <= triangles_max <= TRIANGLES_MAX:
        raise BadInput("triangles_max", f"{triangles_max}; 4 to {TRIANGLES_MAX} are due")
    vertices, faces = np.asarray(vertices_mm, np.float64), np.asarray(triangles, np.int64)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise BadMesh("triangles", f"{name}: vertices (n, 3) and triangles (m, 3) are due")
    if not np.isfinite(vertices).all() or faces.min() < 0 or faces.max() >= len(vertices):
        raise BadMesh("vertices_mm", f"{name}: a vertex is not finite, or a triangle names none that is there")
    notes: list[str] = []
    mesh = trimesh.Trimesh(np.round(vertices, DECIMALS), faces, process=False)
    before = len(mesh.faces)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) < before:
        notes.append(f"{before - len(mesh.faces)} triangles without area, or twice there, were left out")
    broken = _broken(mesh)
    if broken:
        notes.append(f"{broken}; {_WINDING}")
    bodies = [mesh] if broken else list(mesh.split(only_watertight=False))
    if len(bodies) > _PARTS_MAX:
        raise BadMesh("path", f"{name} has {len(bodies)} bodies; a union takes {_PARTS_MAX}. Leave small ones out")
    turned = 0
    for body in [] if broken else bodies:
        if not body.is_winding_consistent:
            trimesh.repair.fix_winding(body)
            turned += 1
        if body.volume < 0:
            body.invert()
            turned += 1
    if turned:
        notes.append("triangles were turned, so that all look outward")
    if len(bodies) > 1:
        notes.append(f"{len(bodies)} separate bodies, sent as the parts of a union")
    decimated_mm = 0.0
    parts = []
    for body, fewer in zip(bodies, _fitting(bodies, triangles_max, name, not broken), strict=True):
        if fewer is not body:
            distance_mm = _distance_mm(body, fewer)
            decimated_mm = max(decimated_mm, distance_mm)
            notes.append(f"{len(body.faces)} triangles became {len(fewer.faces)}: at most {distance_mm:.3g} mm off")
        crossed = None if broken else _crossed(fewer)
        if crossed:
            notes.append(f"{crossed}; {_WINDING}")
        parts.append(_arrays(fewer))
    return Mesh(parts, notes, decimated_mm)


def _fitting(bodies: list[Any], triangles_max: int, name: str, closed: bool) -> list[Any]:
    """The bodies with so few triangles that a hello holds them: as many as come, in their order."""
    most = min(triangles_max, _ALL_MAX // len(bodies))
    while True:
        fitting = [body if len(body.faces) <= most else _decimated(body, most, name, closed) for body in bodies]
        size = len(json.dumps(_shape([_arrays(body) for body in fitting]), separators=(",", ":")))
        if size <= SHAPE_BYTES_MAX:
            return fitting
        # Of several bodies only the larger ones lose triangles, so that one step may not do.
        fewest = max(len(body.faces) for body in fitting)
        most = min(int(0.99 * most * SHAPE_BYTES_MAX / size), fewest - 1)
        if most < 4:
            raise BadMesh("path", f"{name} takes {size} bytes; {SHAPE_BYTES_MAX} at most go into a hello")


def _arrays(body: Any) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    vertices: NDArray[np.float64] = np.asarray(body.vertices, np.float64).round(DECIMALS)
    return vertices, np.asarray(body.faces, np.int64)


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError as error:
        raise MissingExtra("a mesh", "meshes") from error
    return trimesh


def _factor(file: Path, unit: str | None, vertices: NDArray[np.float64]) -> float:
    if unit is not None:
        if unit not in UNITS:
            raise BadInput("unit", f"{unit!r} is none of {', '.join(UNITS)}")
        return UNITS[unit]
    own = "m" if file.suffix.lower() in (".glb", ".gltf") else "mm"
    size_mm = float(np.ptp(vertices, axis=0).max()) * UNITS[own]
    if not _SMALL_MM <= size_mm <= _LARGE_MM:
        fits = [other for other in UNITS if _SMALL_MM <= size_mm / UNITS[own] * UNITS[other] <= _LARGE_MM]
        meant = " or ".join(f"unit={other!r}" for other in fits) or "another unit"
        raise BadInput(
            "unit",
            f"{file.name} would measure {size_mm:.4g} mm if it is in {own}: give {meant} if that is meant, "
            f"or unit={own!r} if it is so",
        )
    return UNITS[own]


def _broken(mesh: Any) -> str | None:
    """Words for edges that have not two triangles each."""
    edges, counts = np.unique(np.asarray(mesh.edges_sorted), axis=0, return_counts=True)
    for wrong, words in (
        (counts == 1, "the surface is open"),
        (counts > 2, "more than two triangles share an edge"),
    ):
        if wrong.any():
            at = np.asarray(mesh.vertices)[edges[int(np.argmax(wrong))]].mean(axis=0)
            return f"{words}, at {int(wrong.sum())} edges, the first near {_place(at)}"
    return None


def _place(at: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:.3g}' for value in at)}) mm"


def _decimated(body: Any, most: int, name: str, closed: bool) -> Any:
    try:
        fewer = body.simplify_quadric_decimation(face_count=most)
    except ImportError as error:
        raise MissingExtra(f"a mesh of {len(body.faces)} triangles", "meshes") from error
    if closed and not fewer.is_watertight:
        raise BadMesh(
            "path", f"{name}: decimation to {most} triangles opens the surface; decimate it by a mesh program"
        )
    return fewer


def _distance_mm(one: Any, other: Any) -> float:
    """Greatest distance of sampled points of each surface from the other."""
    trimesh = _trimesh()
    greatest = 0.0
    for first, second in ((one, other), (other, one)):
        points, _ = trimesh.sample.sample_surface(first, _SAMPLES, seed=1)
        _, off, _ = trimesh.proximity.closest_point(second, points)
        greatest = max(greatest, float(off.max()))
    return greatest


def _crossed(body: Any) -> str | None:
    """Words for two triangles that share no vertex and cross."""
    # Whoever computes contact finds crossings too, but counts the triangles that lie inside and says no place; and
    # most people load a mesh before there is a session.
    vertices, faces = np.asarray(body.vertices, np.float64), np.asarray(body.faces, np.int64)
    corners = vertices[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    order = np.argsort(low[:, 0])
    faces, corners, low, high = faces[order], corners[order], low[order], high[order]
    ends = np.searchsorted(low[:, 0], high[:, 0], side="right")
    counts = ends - np.arange(len(faces)) - 1
    start = 0
    while start < len(faces):
        stop = start + 1 + int(np.searchsorted(np.cumsum(counts[start + 1 :]), _BLOCK))
        own = np.repeat(np.arange(start, stop), counts[start:stop])
        offsets = np.arange(len(own)) - np.repeat(
            np.cumsum(counts[start:stop]) - counts[start:stop], counts[start:stop]
        )
        other = own + 1 + offsets
        near = ((low[own, 1:] <= high[other, 1:]) & (low[other, 1:] <= high[own, 1:])).all(axis=1)
        own, other = own[near], other[near]
        apart = ~(faces[own][:, :, None] == faces[other][:, None, :]).any(axis=(1, 2))
        own, other = own[apart], other[apart]
        crossed = _pierced(corners[own], corners[other]) | _pierced(corners[other], corners[own])
        if crossed.any():
            at = corners[own[int(np.argmax(crossed))]].mean(axis=0)
            return f"the surface crosses itself, first near {_place(at)}"
        start = stop
    return None


def _pierced(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether an edge of the first triangle passes through the second, its rim included, pair by pair."""
    hit = np.zeros(len(one), bool)
    a, b, c = other[:, 0], other[:, 1], other[:, 2]
    for i in range(3):
        p, q = one[:, i], one[:, (i + 1) % 3]
        ends = _volume(p, a, b, c) * _volume(q, a, b, c)
        sides = np.stack([_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)])
        one_side = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)
        hit |= (ends < 0) & one_side & (sides != 0).any(axis=0)
    return hit


def _volume(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64], d: NDArray[np.float64]) -> Any:
    """Six times the signed volume of tetrahedra."""
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a))
