"""From readings of taxels to a field of pressure on the skin.

A reading is the mean pressure over a taxel's footprint. Infinitely many fields have the same means. Of those the
smoothest is taken, by the norm of a Gaussian kernel as wide as a share of the pitch; it is a sum of one bump for
each taxel. Skin is never pulled, so that sum is cut at zero, and what the cut adds is taken away again from the
readings that it was made of, until the means of the cut field are the readings (or as near as their noise).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..atlas import Atlas

Reals = NDArray[np.float32]

# Chosen on states of the training (studies/sensors.py choose).
WIDTH = 0.6
"""Standard deviation of the kernel over the pitch."""
RIDGE: Final = 1e-3
"""What is added to the kernel's diagonal, over its mean: 0 makes it singular."""
SEED: Final = 3.0
GROWN: Final = 1.0
NEAR = 0.05
"""Readings count as met when the root mean square of what is left is this share of the noise."""
_POINTS: Final = 9
_ROUNDS: Final = 30
_CLOSE: Final = 2e-3
_REACH: Final = 1.0
_BATCH: Final = 32
_BLOCK: Final = 4000


class Field:
    """The fields that taxels can see."""

    def __init__(self, atlas: Atlas, footprints: Sequence[NDArray[np.int64]], pitch_mm: float) -> None:
        self._pixels = np.concatenate(footprints)
        self._first = np.concatenate([[0], np.cumsum([len(pixels) for pixels in footprints])[:-1]])
        areas = atlas.areas_mm2[self._pixels]
        self._weights = areas / np.repeat(np.add.reduceat(areas, self._first), [len(p) for p in footprints])
        self._centres = np.add.reduceat(atlas.places_mm[self._pixels] * self._weights[:, None], self._first)
        self._atlas, self._pitch_mm, self._count = atlas, pitch_mm, len(atlas.pixels)
        self._operator: Reals | None = None
        self._footprints = footprints
        near = ((self._centres[:, None] - self._centres[None]) ** 2).sum(axis=2) < (1.7 * pitch_mm) ** 2
        self._neighbours = near

    def means(self, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Readings of fields: (frames, taxels) of (frames, pixels)."""
        found: NDArray[np.float64] = np.add.reduceat(pressure[:, self._pixels] * self._weights, self._first, axis=1)
        return found

    def solve(
        self, readings: NDArray[np.float64], noise: NDArray[np.float64], prior: NDArray[np.float64] | None = None
    ) -> Reals:
        """Fields with these means, Pa: (frames, pixels).

        `prior` has fields that the shape of the pressure is known by, (frames, pixels): of all fields with these means
        the one is taken that is nearest to a multiple of its prior.
        """
        felt = self.without_noise(readings, noise).astype(np.float32)
        found = np.zeros((len(felt), self._count), np.float32)
        touched = np.flatnonzero(felt.any(axis=1))
        close = float(np.sqrt((noise**2).mean()))
        for start in range(0, len(touched), _BATCH):
            rows = touched[start : start + _BATCH]
            base = np.zeros((len(rows), 1), np.float32) if prior is None else self._scaled(felt[rows], prior[rows])
            self._fit(found, rows, felt[rows], close, base)
        return found

    def _scaled(self, felt: Reals, prior: NDArray[np.float64]) -> Reals:
        """The multiple of each prior whose means come nearest to the readings."""
        means = self.means(prior)
        squared = (means**2).sum(axis=1)
        factor = np.divide((means * felt).sum(axis=1), squared, out=np.zeros_like(squared), where=squared > 0)
        scaled: Reals = (factor[:, None] * prior).astype(np.float32)
        return scaled

    def without_noise(self, readings: NDArray[np.float64], noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Zero where no touch stands out: a reading counts from 3 standard deviations of the noise on, and beside
        one that counts from 1 on."""
        readings = np.maximum(readings, 0.0)
        counts = readings > SEED * noise
        able = readings > GROWN * noise
        while True:
            grown = counts | (able & ((counts @ self._neighbours.astype(np.float32)) > 0))
            if (grown == counts).all():
                return np.where(counts, readings, 0.0)
            counts = grown

    def _fit(self, found: Reals, rows: NDArray[np.int64], wanted: Reals, close: float, base: Reals) -> None:
        """`base` is what the smoothest field is added to: (rows, pixels or 1)."""
        if self._operator is None:
            self._operator = self._smoothest()
        limit = np.maximum(NEAR * close, _CLOSE * wanted.max(axis=1))
        given = wanted - self.means(base.astype(np.float64)).astype(np.float32) if base.any() else wanted.copy()
        field = np.maximum(base + given @ self._operator, 0.0)
        left = wanted - self.means(field).astype(np.float32)
        off = np.sqrt((left**2).mean(axis=1))
        step = np.ones(len(rows), np.float32)
        for _ in range(_ROUNDS):
            open_ = np.flatnonzero((off > limit) & (step > 0.05))
            if not len(open_):
                break
            tried = given[open_] + step[open_, None] * left[open_]
            new = np.maximum(base[open_] + tried @ self._operator, 0.0)
            new_left = wanted[open_] - self.means(new).astype(np.float32)
            new_off = np.sqrt((new_left**2).mean(axis=1))
            better = new_off < off[open_]
            kept = open_[better]
            given[kept], field[kept], left[kept], off[kept] = (
                tried[better],
                new[better],
                new_left[better],
                new_off[better],
            )
            step[open_[~better]] *= 0.5
        found[rows] = field

    def _smoothest(self) -> Reals:
        """(taxels, pixels): the smoothest field, negative where it likes, whose means are one taxel's unit reading."""
        points, first = self._points()
        kernel = np.zeros((len(self._footprints), self._count), np.float32)
        places = self._atlas.places_mm.astype(np.float32)
        length = np.float32(WIDTH * self._pitch_mm)
        lengths = (points**2).sum(axis=1)
        shares = np.diff(np.concatenate([first, [len(points)]])).astype(np.float32)
        for start in range(0, self._count, _BLOCK):
            block = places[start : start + _BLOCK]
            squared = np.maximum((block**2).sum(axis=1) + lengths[:, None] - 2 * points @ block.T, 0.0)
            bumps = np.exp(squared * np.float32(-0.5 / length**2))
            kernel[:, start : start + _BLOCK] = np.add.reduceat(bumps, first, axis=0) / shares[:, None]
        gram = self.means(kernel.astype(np.float64)).T
        gram += RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
        operator = np.linalg.solve(gram.T, kernel.astype(np.float64)).astype(np.float32)
        operator[:, ~self._seen()] = 0.0
        return operator

    def _points(self) -> tuple[Reals, NDArray[np.int64]]:
        """A few points of each footprint, and where each taxel's begin."""
        chosen = []
        for pixels in self._footprints:
            count = min(len(pixels), _POINTS)
            chosen.append(pixels[((np.arange(count) + 0.5) * len(pixels) / count).astype(int)])
        first = np.concatenate([[0], np.cumsum([len(pixels) for pixels in chosen])[:-1]])
        return self._atlas.places_mm[np.concatenate(chosen)].astype(np.float32), first

    def _seen(self) -> NDArray[np.bool_]:
        """Pixels within reach of some footprint; of the others no taxel knows anything."""
        seen = np.zeros(self._count, bool)
        for centre, pixels in zip(self._centres, self._footprints, strict=True):
            radius = np.linalg.norm(self._atlas.places_mm[pixels] - centre, axis=1).max(initial=0.0)
            off = np.linalg.norm(self._atlas.places_mm - centre, axis=1)
            seen |= off <= radius + _REACH * self._pitch_mm
        return seen
