"""The atlas: which point of the finger each pixel is, and pressure maps from what engines have."""

from __future__ import annotations

import json
import urllib.parse
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import BadInput
from .http import DEFAULT_URL, LOCAL, get_json
from .model import folder
from .wire import SIDE_PX, Map

_REACH_MM = 5.0
_RADIUS_AT_1_N_MM = 5.1


class Contact(NamedTuple):
    """A contact point: a place on or near the undeformed skin, a force and a radius.

    Without a radius it is the finger's own on a flat object.
    """

    at_mm: tuple[float, float, float]
    force_n: float
    radius_mm: float | None = None


class Atlas:
    """The skin's part of the atlas, and tables made of it once (some 0.1 s).

    Formulas: docs/reference/atlas.md, 'Helpers of the clients'.
    """

    def __init__(self, file: dict[str, Any]) -> None:
        """`file` is what `GET /v1/atlas` answers."""
        self.hash: str = file["hash"]
        self.triangles: NDArray[np.int64] = np.asarray(file["triangles"], np.int64)
        # As f32 first: the file's decimal numbers are those of f32 values.
        skin = file["skin"]
        self.positions_mm: NDArray[np.float64] = np.asarray(skin["positions_mm"], np.float32).astype(np.float64)
        uv_px = np.asarray(skin["uv_px"], np.float32).astype(np.float64)
        self._owner, self._weights = _cover(uv_px, self.triangles)
        self.pixels: NDArray[np.int64] = np.flatnonzero(self._owner >= 0)
        """Flat indices of the skin's pixels, ascending."""
        self.owners: NDArray[np.int64] = self._owner[self.pixels]
        """Triangle of each of `pixels`."""
        corners = self.triangles[self.owners]
        self._corners = corners
        self.places_mm: NDArray[np.float64] = np.einsum("pi,pix->px", self._weights, self.positions_mm[corners])
        """Where each of `pixels` is on the undeformed finger."""
        self.areas_mm2: NDArray[np.float64] = _areas_mm2(self.positions_mm, uv_px, self.triangles)[self.owners]
        """Area of the finger that each of `pixels` shows."""

    @classmethod
    def load(cls, url: str = DEFAULT_URL, token: str | None = None, *, finger: str | None = None) -> Atlas:
        """From a service, of its default finger or of `finger`, by name; raises Unreachable or Refused.

        At the address `local` it is that of the wheel's models, or of $PAPILLA_MODELS; raises BadModels.
        """
        if url == LOCAL:
            if finger is not None:
                raise BadInput(
                    "finger", "fingers have names at a service; give its folder to papilla.Finger(...).atlas()"
                )
            return cls(json.loads((folder(None) / "atlas.json").read_text()))
        query = "" if finger is None else "?" + urllib.parse.urlencode({"finger": finger})
        return cls(get_json(url, "/v1/atlas" + query, token))

    def rasterise(self, vertex_values: ArrayLike) -> Map:
        """A field given at the vertices of the skin, as a map: linear in each triangle."""
        values = np.asarray(vertex_values, np.float64)
        if values.shape != (len(self.positions_mm),):
            raise ValueError(f"{values.shape} values; the skin has {len(self.positions_mm)} vertices")
        return self._map((self._weights * values[self._corners]).sum(axis=1))

    def contacts(self, contacts: Iterable[Contact]) -> Map:
        """Pressure (Pa) of contact points, each with the pressure of Hertz's contact.

        A contact more than 5 mm from the skin adds nothing.
        """
        pressure_pa = np.zeros(len(self.pixels))
        for at_mm, force_n, radius_mm in contacts:
            squared = ((self.places_mm - np.asarray(at_mm, np.float64)) ** 2).sum(axis=1)
            own = int(np.argmin(squared))
            if squared[own] > _REACH_MM**2:
                continue
            off = ((self.places_mm - self.places_mm[own]) ** 2).sum(axis=1)
            if radius_mm is None:
                radius_mm = _RADIUS_AT_1_N_MM * max(force_n, 0.0) ** (1 / 3)
            if radius_mm > 0.0:
                weights = np.sqrt(np.maximum(0.0, 1.0 - off / radius_mm**2))
            else:
                weights = np.zeros_like(off)
            weights[own] = 1.0
            pressure_pa += 1e6 * force_n * weights / (weights * self.areas_mm2).sum()
        return self._map(pressure_pa)

    def force_n(self, pressure_pa: ArrayLike) -> float:
        """`1e-6 sum p A` of a pressure map: what `summary` calls `force_n`."""
        flat = np.asarray(pressure_pa, np.float64).reshape(-1)[self.pixels]
        return float(1e-6 * (flat * self.areas_mm2).sum())

    def _map(self, values: NDArray[np.float64]) -> Map:
        whole = np.zeros(SIDE_PX * SIDE_PX, np.float32)
        whole[self.pixels] = values
        return whole.reshape(SIDE_PX, SIDE_PX)


def _cover(uv_px: NDArray[np.float64], triangles: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Triangle of every pixel (-1: none), and the weights of those that have one."""
    owner = np.full(SIDE_PX * SIDE_PX, -1, np.int64)
    weights = np.zeros((SIDE_PX * SIDE_PX, 3))
    for number, corners in enumerate(triangles):
        a, b, c = uv_px[corners]
        low = np.maximum(np.floor(np.minimum(np.minimum(a, b), c) - 0.5), 0).astype(int)
        high = np.minimum(np.ceil(np.maximum(np.maximum(a, b), c) + 0.5), SIDE_PX).astype(int)
        column, row = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        at = np.stack([column + 0.5, row + 0.5], axis=-1)
        total = _doubled(a, b, c)
        shares = np.stack([_doubled(b, c, at), _doubled(c, a, at), _doubled(a, b, at)], -1) / total
        index = row * SIDE_PX + column
        taken = (shares >= 0).all(axis=-1) & (owner[index] < 0)
        owner[index[taken]] = number
        weights[index[taken]] = shares[taken]
    return owner, weights[owner >= 0]


def _doubled(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the signed area; exact, for `uv_px` are multiples of 1/4096."""
    along, across = b - a, c - a
    area: NDArray[np.float64] = along[..., 0] * across[..., 1] - along[..., 1] * across[..., 0]
    return area


def _areas_mm2(
    positions_mm: NDArray[np.float64], uv_px: NDArray[np.float64], triangles: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Area of the finger per pixel, of every triangle."""
    a, b, c = (positions_mm[triangles[:, i]] for i in range(3))
    doubled_mm2 = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    p, q, r = (uv_px[triangles[:, i]] for i in range(3))
    areas: NDArray[np.float64] = doubled_mm2 / np.abs(_doubled(p, q, r))
    return areas
