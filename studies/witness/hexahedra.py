"""The same press by `fe-datagen solve`, on its own mesh of hexahedra, and SED out of its map."""

import json
import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from witness.shape import ROOT


def fe_datagen(*words) -> float:
    """Runs it; processor seconds."""
    program = shutil.which(os.environ.get("FE_DATAGEN", "fe-datagen"))
    if program is None:
        sys.exit("there is no program fe-datagen: build it, and name it by FE_DATAGEN")
    words = [program, *map(str, words)]
    print("+", *words, file=sys.stderr, flush=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    log = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if log.returncode != 0:
        sys.exit(f"fe-datagen ended with {log.returncode}: {log.stdout[-2000:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def solved(scene: Path, text: str) -> dict:
    """Force, SED map and volumes of a scene. What is solved already is read."""
    folder = scene.with_suffix("")
    took, deck = folder / "processor_s.json", folder / f"{scene.stem}.inp"
    if not (took.is_file() and scene.is_file() and scene.read_text() == text):
        took.unlink(missing_ok=True)
        scene.write_text(text)
        seconds = fe_datagen("solve", scene, "--out", folder)
        fe_datagen("export", scene, "--format", "inp", "--out", folder)
        took.write_text(json.dumps(seconds))
    summary = json.loads((folder / "summary.json").read_text())
    with np.load(folder / "maps.npz") as maps:
        sed = maps["sed_dermis_j_per_m3"][-1]
    return {
        "force_n": np.linalg.norm(summary["increments"][-1]["force_n"]),
        "sed": sed,
        "atlas": json.loads((folder / "atlas.json").read_text()),
        "elements": summary["elements"],
        "unknowns": summary["unknowns"],
        "volumes_mm3": volumes_mm3(deck.read_text()),
        "s": json.loads(took.read_text()),
    }


def at(of: dict, places):
    """SED of a map, J/m3, at places of the interface near the pad, by the atlas' triangles seen from below."""
    patch = of["atlas"]["interface"]
    positions, uv = np.array(patch["positions_mm"]), np.array(patch["uv_px"])
    triangles = np.array(of["atlas"]["triangles"])
    corner = positions[triangles][:, :, :2]
    below = positions[triangles][:, :, 2].max(1) < 0
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    whole = cross(b - a, c - a)
    found = np.full(len(places), np.nan)
    for n, place in enumerate(places):
        parts = np.stack([cross(b - place[:2], c - place[:2]), cross(c - place[:2], a - place[:2])], 1)
        parts = np.concatenate([parts, (whole - parts.sum(1))[:, None]], 1) / whole[:, None]
        hit = np.flatnonzero(below & (parts.min(1) > -1e-6))
        if len(hit):
            column, row = parts[hit[0]] @ uv[triangles[hit[0]]] - 0.5
            i, k = int(np.floor(row)), int(np.floor(column))
            v, u = row - i, column - k
            window = of["sed"][i : i + 2, k : k + 2]
            found[n] = np.array([1 - v, v]) @ window @ np.array([1 - u, u])
    return found


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def volumes_mm3(deck: str) -> dict:
    """Volumes of the tissues in a deck, whose elements have 20 nodes."""
    places, found = {}, {}
    for part in re.split(r"^(?=\*[A-Z])", deck, flags=re.MULTILINE)[1:]:
        head, _, rest = part.partition("\n")
        if head.startswith("*NODE, NSET=NBODY"):
            for line in rest.splitlines():
                number, *place = line.split(",")
                places[int(number)] = [float(v) for v in place]
        elif head.startswith("*ELEMENT, TYPE=C3D20") and "INDENTER" not in head:
            nodes = np.array([int(v) for v in re.findall(r"\d+", rest)]).reshape(-1, 21)[:, 1:]
            corner = np.array([[places[n] for n in own] for own in nodes.tolist()])
            slopes, weights = RULE
            jacobian = np.einsum("eni,qnj->eqij", corner, slopes)
            tissue = head.rpartition("ELSET=E")[2].strip().lower()
            found[tissue] = float((np.linalg.det(jacobian) @ weights).sum())
    return found


def rule():
    """Slopes of the functions of 20 nodes at 27 points, and the points' weights."""
    corners = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)]
    corners += [(x, y, 1) for x, y, _ in corners]
    pairs = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
    middles = [[(a + b) / 2 for a, b in zip(corners[i], corners[k], strict=True)] for i, k in pairs]
    nodes = np.array([*corners, *middles], float)

    def functions(p):
        f = 1 + nodes * p
        at_corner = f[:, 0] * f[:, 1] * f[:, 2] * ((nodes * p).sum(1) - 2) / 8
        bubble = np.where(nodes == 0, 1 - p**2, f)
        return np.where((nodes == 0).any(1), bubble.prod(1) / 4, at_corner)

    line = ((-np.sqrt(0.6), 5 / 9), (0.0, 8 / 9), (np.sqrt(0.6), 5 / 9))
    points = [((x, y, z), a * b * c) for x, a in line for y, b in line for z, c in line]
    # Quadratic along each line: central differences are exact.
    step = 0.1 * np.eye(3)
    slopes = [np.stack([(functions(p + h) - functions(p - h)) / 0.2 for h in step], 1) for p, _ in points]
    return np.array(slopes), np.array([w for _, w in points])


RULE = rule()
