"""The radius of Hertz' contact that has the second moments of the pressure of a flat plate.

    fe-datagen dataset maps data/s1-graded --out out/s1-maps
    python studies/contact_radius.py data/s1-graded out/s1-maps

docs/reference/atlas.md (from contact points to a map) has the formula of the radius, and what this
prints. Datasets with other indenters show how far the formula is off for them. Needs numpy.
"""

import json
import sys
from pathlib import Path

import numpy as np

FACTOR_MM = 5.1  # times the cube root of the force in N
FINGER_MM = 12.0  # a ball of radius r: the force times r / (r + FINGER_MM) in place of the force


def skin(dataset):
    """Pixels of the skin: their indices, places (mm), and the area (mm2) that each stands for."""
    atlas = json.loads((dataset / "atlas.json").read_text())
    raster = np.load(dataset / "raster.npz")
    corners, weights = raster["skin_vertex"], raster["skin_weight"].astype(float)
    at = np.array(atlas["skin"]["positions_mm"])[corners]
    in_image = np.array(atlas["skin"]["uv_px"])[corners]
    of = lambda a, b: np.linalg.norm(np.cross(a, b), axis=-1)
    area_mm2 = of(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    a, b = in_image[:, 1] - in_image[:, 0], in_image[:, 2] - in_image[:, 0]
    return raster["skin_pixel"], (at * weights[:, :, None]).sum(1), area_mm2 / np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def spread_mm2(at_mm, weight):
    """Where the weight lies, and the sum of its second moments about that place."""
    centre = weight @ at_mm / weight.sum()
    return centre, weight @ ((at_mm - centre) ** 2).sum(1) / weight.sum()


def radius_mm(at_mm, area_mm2, pressure_pa):
    """The radius `a` of the rule of the atlas whose pressure spreads as far as this one."""
    centre, due = spread_mm2(at_mm, pressure_pa * area_mm2)
    off2 = ((at_mm - at_mm[((at_mm - centre) ** 2).sum(1).argmin()]) ** 2).sum(1)
    low, high = 0.0, 20.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        near = off2 < middle**2
        weight = np.sqrt(1 - off2[near] / middle**2) * area_mm2[near]
        low, high = (middle, high) if spread_mm2(at_mm[near], weight)[1] < due else (low, middle)
    return middle


def told(name, force_n, radius):
    off = radius / (FACTOR_MM * np.cbrt(force_n)) - 1
    print(
        f"{name}: {off.size} states, {force_n.min():.4f} to {force_n.max():.2f} N; best factor "
        f"{np.median(radius / np.cbrt(force_n)):.2f}; off the formula: mean {off.mean():+.1%}, median of the size "
        f"{np.median(abs(off)):.1%}, 95th percentile {np.percentile(abs(off), 95):.1%}"
    )


def main(dataset, maps):
    pixels, at_mm, area_mm2 = skin(Path(dataset))
    manifest = json.loads(Path(dataset, "manifest.json").read_text())
    names = {press["id"]: press["indenter"] for press in manifest["presses"]}
    listed = manifest["campaign"].get("indenters", [])
    balls = {of["name"]: of["indenter"]["radius_mm"] for of in listed if of["indenter"]["shape"] == "sphere"}
    pressure = np.load(f"{maps}/pressure_pa.npy", mmap_mode="r")
    found = {}
    for press, state, map_pa in zip(np.load(f"{maps}/press.npy"), np.load(f"{maps}/state.npy"), pressure):
        force_n = np.linalg.norm(np.load(f"{dataset}/shards/press-{press:05}.npz")["force_n"][state])
        radius = radius_mm(at_mm, area_mm2, map_pa.ravel()[pixels].astype(float))
        found.setdefault(names[press], []).append((force_n, radius))
    for name, states in found.items():
        force_n, radius = np.array(states).T
        told(name, force_n, radius)
        if name in balls:
            told("  as a ball", force_n * balls[name] / (balls[name] + FINGER_MM), radius)
        for low, high in [(0, 0.03), (0.03, 0.3), (0.3, 3), (3, 30)]:
            within = (force_n >= low) & (force_n < high)
            if within.any() and not within.all():
                told(f"  {low} to {high} N", force_n[within], radius[within])


if __name__ == "__main__":
    main(*sys.argv[1:])
