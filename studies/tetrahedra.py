#!/usr/bin/env python3
"""Is a finger pressed the same on tetrahedra, by another program?

    python studies/tetrahedra.py [--finger BUNDLE] [--size MM...] [--density NAME...] [--out out/tetrahedra]

Presses a finger with a ball in NGSolve, on tetrahedra, and compares force and SED at the interface with
`fe-datagen solve` of the same press on hexahedra. Nothing is shared but the files of the finger and the
constants of the tissues: studies/witness has the formulas of the shape once more, meshes with gmsh, and
solves with NGSolve. A finger may be fitted to a scan (skin.json); maps of layers are not known here. Of a
finger without skin.json, which is symmetric, one half is meshed. The volumes of the tissues are compared with those of
the formulas.

Needs studies/witness/requirements.txt (PyPI) and the program fe-datagen: FE_DATAGEN, or PATH. Run it in the
root of the repository. What is solved stays in --out and is not solved again.
"""

import argparse
import os
import resource
import sys
from pathlib import Path

# Times are those of one core.
for of in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ.setdefault(of, "1")

import numpy as np
from witness import hexahedra, press
from witness.mesh import TISSUES, Mesh
from witness.shape import ROOT, Finger

DEPTH_MM = 0.6
BALL_MM = 6.0
# SED is compared within this distance of the touch.
COMPARED_MM = 5.0
# Young's moduli, MPa, and Poisson's ratio, as docs/reference/scenes.md has them.
YOUNG_MPA = {"epidermis": 0.136, "dermis": 0.080, "subcutaneous": 0.034}
POISSON = 0.48


def scene(finger: Path, density: str, poisson: float, offset_mm) -> str:
    text = f"""outputs = ["maps"]

[geometry]
kind = "fingertip"
finger = "{finger}"
density = "{density}"

[indenter]
shape = "sphere"
radius_mm = {BALL_MM}

[motion]
depth_mm = {DEPTH_MM}
increments = 3
offset_mm = {list(map(float, offset_mm))}
"""
    for tissue, young in YOUNG_MPA.items():
        text += f"\n[materials.{tissue}]\nyoungs_modulus_mpa = {young}\npoissons_ratio = {poisson}\n"
    return text


def on_tetrahedra(out: Path, finger: Finger, size_mm: float, options) -> dict:
    """The press by NGSolve. What is solved already is read."""
    mixed = not options.displacement_alone
    kept = out / f"tetrahedra-{size_mm:g}-{options.poisson:g}{'' if mixed else '-alone'}.npz"
    text = scene(options.finger.resolve(), "none", options.poisson, options.offset)
    of = read(kept)
    if of.get("scene") != text:
        before = resource.getrusage(resource.RUSAGE_SELF)
        centre, touch = finger.touch(options.offset, BALL_MM)
        mesh = Mesh(finger, size_mm, touch)
        shear, bulk = 1 / (2 * (1 + options.poisson)), 1 / (3 * (1 - 2 * options.poisson))
        laws = {tissue: (young * shear, young * bulk) for tissue, young in YOUNG_MPA.items()}
        print(f"{size_mm:g} mm: {len(mesh.tets)} tetrahedra, touch at {touch}", file=sys.stderr, flush=True)
        found = press.press(mesh, laws, centre, BALL_MM, DEPTH_MM, mixed)
        after = resource.getrusage(resource.RUSAGE_SELF)
        # Half a finger has half its force and volume. What holds its ball in the plane is no force of the whole.
        times = 2 if finger.symmetric else 1
        force = found.pop("force_n") * ([0, 0, 2] if finger.symmetric else 1)
        np.savez(
            kept,
            scene=text,
            s=after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            elements=len(mesh.tets),
            touch=touch,
            force=force,
            volumes=[times * v for v in found.pop("volumes_mm3").values()],
            **found,
        )
        of = read(kept)
    volumes = dict(zip(TISSUES, of["volumes"], strict=True))
    return {**of, "size_mm": size_mm, "force_n": float(np.linalg.norm(of["force"])), "volumes_mm3": volumes}


def read(kept: Path) -> dict:
    if not kept.is_file():
        return {}
    with np.load(kept) as of:
        return {key: of[key] for key in of.files}


def sed_differs(own, other, area) -> dict:
    """SED at points, of which each three lie in one triangle."""
    known = np.repeat((np.isfinite(own) & np.isfinite(other)).reshape(-1, 3).all(1), 3)
    own, other, area = own[known], other[known], area[known]
    means = [values.reshape(-1, 3).mean(1) for values in (own, other, area)]
    return {
        "sed_relative_l2": relative_l2(own, other, area),
        "sed_means_relative_l2": relative_l2(*means),
        "sed_largest": own.max() / other.max() - 1,
        "sed_mean": (area * own).sum() / (area * other).sum() - 1,
    }


def relative_l2(own, other, area) -> float:
    return np.sqrt((area * (own - other) ** 2).sum() / (area * other**2).sum())


def row(name: str, elements: str, of: dict, truth: dict, sed: dict | None) -> str:
    force = 100 * (of["force_n"] / truth["force_n"] - 1)
    text = f"| {name} | {elements} | {int(of['unknowns'])} | {float(of['s']):.0f} | {of['force_n']:.4f} |"
    text += f" {force:+.2f} % |"
    if sed is None:
        return text + " | | | |"
    text += f" {100 * sed['sed_relative_l2']:.2f} % | {100 * sed['sed_means_relative_l2']:.2f} % |"
    return text + f" {100 * sed['sed_largest']:+.2f} % | {100 * sed['sed_mean']:+.2f} % |"


def table_of_presses(hexes: dict, tets: list, truth: dict) -> list:
    rows = ["| solved by | elements | unknowns | processor time, s | force, N | force: difference |"]
    rows[0] += " SED at points: L2 | SED of triangles: L2 | SED: largest value | SED: mean |"
    rows += ["|---" * 10 + "|"]
    differs = []
    for of in tets:
        near = (np.linalg.norm((of["places"] - of["touch"])[:, :2], axis=1) < COMPARED_MM) & (of["places"][:, 2] < 0)
        near = np.repeat(near.reshape(-1, 3).all(1), 3)
        places, area = of["places"][near], of["areas"][near]
        seds = {density: hexahedra.at(hexa, places) for density, hexa in hexes.items()}
        true = next(seds[density] for density, hexa in hexes.items() if hexa is truth)
        differs.append({None: sed_differs(of["sed"][near], true, area)})
        differs[-1].update({density: sed_differs(sed, true, area) for density, sed in seds.items()})
    for density, of in hexes.items():
        elements = f"{of['elements']} hexahedra, `{density}`"
        rows.append(row("`fe-datagen`", elements, of, truth, None if of is truth else differs[-1][density]))
    for of, sed in zip(tets, differs, strict=True):
        elements = f"{int(of['elements'])} tetrahedra, {of['size_mm']:g} mm"
        rows.append(row("NGSolve", elements, of, truth, sed[None]))
    return rows


def table_of_volumes(hexes: dict, tets: list, finger: Finger) -> list:
    rows = ["| mesh | " + " | ".join(f"{tissue}: volume" for tissue in TISSUES) + " |", "|---" * 4 + "|"]
    formulas = dict(zip(TISSUES, finger.volumes_mm3(), strict=True))
    meshes = [(f"hexahedra, `{density}`", of) for density, of in hexes.items()]
    meshes += [(f"tetrahedra, {of['size_mm']:g} mm", of) for of in tets]
    for name, of in meshes:
        parts = (f"{100 * (of['volumes_mm3'][t] / formulas[t] - 1):+.3f} %" for t in TISSUES)
        rows.append(f"| {name} | " + " | ".join(parts) + " |")
    return rows


def table_of_vertices(truth: dict, finger: Finger) -> list:
    """How far the vertices of an atlas lie from where the formulas have them."""
    skin, interface = (np.array(truth["atlas"][name]["positions_mm"]) for name in ("skin", "interface"))
    bounds = finger.bounds(finger.named(skin))
    rows = ["| distance of `fe-datagen`'s vertices | nine in ten lie within, nm | farthest, nm |", "|---|---|---|"]
    for name, own, formula in (("skin", skin, bounds[0]), ("interface", interface, bounds[1])):
        away = 1e6 * np.linalg.norm(own - formula, axis=1)
        rows.append(f"| {name} | {np.percentile(away, 90):.1f} | {away.max():.1f} |")
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--finger", type=Path, default=ROOT / "models", help="its bundle, or its finger.toml")
    parser.add_argument("--size", type=float, nargs="+", default=[0.45, 0.3], help="edges under the ball, mm")
    parser.add_argument("--density", nargs="+", default=["medium", "fine"], help="hexahedra; the last is the truth")
    parser.add_argument("--offset", type=float, nargs=2, default=[0, 0], help="of the ball's way, mm along x and y")
    parser.add_argument("--displacement-alone", action="store_true", help="no pressure as an unknown of its own")
    parser.add_argument("--poisson", type=float, default=POISSON, help="Poisson's ratio of all soft tissues")
    parser.add_argument("--out", type=Path, default=ROOT / "out/tetrahedra")
    options = parser.parse_args()
    out, file = options.out.resolve(), options.finger.resolve()
    out.mkdir(parents=True, exist_ok=True)
    finger = Finger(file)
    # One half is solved of a press whose other half is its mirror image.
    finger.symmetric &= options.offset[1] == 0
    hexes = {}
    for density in options.density:
        text = scene(file, density, options.poisson, options.offset)
        hexes[density] = hexahedra.solved(out / f"hexahedra-{density}-{options.poisson:g}.toml", text)
    truth = hexes[options.density[-1]]
    tets = [on_tetrahedra(out, finger, size, options) for size in options.size]
    tables = [table_of_presses(hexes, tets, truth), table_of_volumes(hexes, tets, finger)]
    tables.append(table_of_vertices(truth, finger))
    print("\n\n".join("\n".join(rows) for rows in tables))


if __name__ == "__main__":
    main()
