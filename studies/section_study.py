#!/usr/bin/env python3
"""How far is SED at the dermis-epidermis interface from mesh convergence? A plane-strain section, pressed by
four indenters on meshes that differ in one thing at a time, against a fine quadratic mesh.

    pip install numpy scipy meshio
    section_study.py FE_DATAGEN [--study layers|spacing] [--out DIR] [--indenter NAME]

Meshes are written as Gmsh files, solved by `FE_DATAGEN solve`, and SED is evaluated here from the displacement:
W = mu/2 (J^(-2/3) I1 - 3) + K/2 (theta - 1)^2, theta the element's own dilatation (constant for Quad4, linear for Quad9),
on the dermis side. 'centre' reads it in the middle of the first dermis element, 'face' on that element's face (for linear
elements what the code does today: in depth their strain is still that of the middle), 'extrapolated' takes the strain of
the first two linear elements to the interface. Errors are relative L2 over
x = -6 to 6 mm. Units: mm, N, MPa; SED in J/m3. Without --study linear and quadratic elements are compared;
'layers' changes how many quadratic elements go through each layer, 'spacing' their width and where contact is found.
"""
import argparse
import json
import subprocess
from pathlib import Path

import meshio
import numpy as np
from scipy.optimize import brentq
from scipy.spatial import cKDTree

A, B = 8.72, 6.53  # semi-axes of the skin, mm
NU = 0.48
MU_DERMIS = 0.08 / 2 / (1 + NU)
CORNERS = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
GAUSS = [(-0.774596669, 5 / 9), (0.0, 8 / 9), (0.774596669, 5 / 9)]
INDENTERS = {
    "plate": (1.0, 'shape = "plate"\nsize_mm = [20.0, 20.0]'),
    "bar2": (1.0, 'shape = "cylinder"\nradius_mm = 2.0\nlength_mm = 30.0\nend_radius_mm = 1.0'),
    "bar1": (0.8, 'shape = "cylinder"\nradius_mm = 1.0\nlength_mm = 30.0\nend_radius_mm = 0.5'),
    "punch": (0.8, 'shape = "plate"\nsize_mm = [4.0, 20.0]\nedge_radius_mm = 0.5'),
    "edge": (0.8, 'shape = "plate"\nsize_mm = [1.0, 20.0]\nedge_radius_mm = 0.2'),
}


def even(k):
    return list(np.linspace(0, 1, k + 1))


MEDIUM = ([0, 1], [0, 0.15, 0.35, 0.65, 1], [0, 0.15, 0.35, 0.65, 1])
FINE = ([0, 1], [0, 0.1, 0.25, 0.45, 0.7, 1], [0, 0.1, 0.2, 0.32, 0.47, 0.63, 0.81, 1])
MEDIUM_Q = ([0, 0.5, 1], [0, 0.175, 0.35, 0.675, 1], [0, 0.2, 0.4, 0.7, 1])
GRADED = ([0, 0.5, 1], [0, 0.04, 0.08, 0.2, 0.35, 0.65, 1], [0, 0.2, 0.4, 0.7, 1])
GRADED_L = (even(4), [0, 0.04, 0.1, 0.2, 0.4, 0.7, 1], [0, 0.2, 0.4, 0.7, 1])
RICH = (even(4), list(np.linspace(0, 1, 13) ** 1.3), list(np.linspace(0, 1, 13) ** 1.2))
REFERENCE = (even(4), [0, 0.03, 0.06, 0.12, 0.2, 0.35, 0.5, 0.75, 1], list(np.linspace(0, 1, 9) ** 1.2))
# name: lattice intervals round the section (half of them within 40 degrees of the pad), quadratic, layers
MESHES = {
    "linear, medium layers, .71 mm": (32, False, MEDIUM),
    "linear, fine layers, .47 mm": (48, False, FINE),
    "linear, medium layers, .09 mm": (256, False, MEDIUM),
    "linear, graded layers, .18 mm": (128, False, GRADED_L),
    "linear, graded layers, .09 mm": (256, False, GRADED_L),
    "linear, rich layers, .09 mm": (256, False, RICH),
    "quadratic, medium layers, .71 mm": (32, True, MEDIUM_Q),
    "quadratic, medium layers, .18 mm": (128, True, MEDIUM_Q),
    "quadratic, graded layers, .36 mm": (64, True, GRADED),
    "quadratic, graded layers, .18 mm": (128, True, GRADED),
    "quadratic, graded layers, .09 mm": (256, True, GRADED),
}

FAT = [0, 0.2, 0.4, 0.7, 1]
# Quadratic elements through epidermis and dermis; two through the fat.
LAYERS = {
    "1 and 3": GRADED,
    "2 and 3": (even(4), GRADED[1], FAT),
    "2 and 2": (even(4), [0, 0.08, 0.2, 0.5, 1], FAT),
    "3 and 6": (even(6), [0, 0.02, 0.04, 0.08, 0.12, 0.18, 0.25, 0.35, 0.45, 0.58, 0.72, 0.86, 1], list(np.linspace(0, 1, 9) ** 1.2)),
}
# name: lattice intervals, quadratic, layers, contact
STUDIES = {
    "elements": {name: (*mesh, "nodes") for name, mesh in MESHES.items()},
    "layers": {f"{name} elements, .06 mm": (384, True, layers, "nodes") for name, layers in LAYERS.items()},
    "spacing": {
        f"2 and 3 elements, {name} mm, {rule}": (n, True, LAYERS["2 and 3"], rule)
        for name, n in ((".24", 96), (".18", 128), (".12", 192), (".09", 256))
        for rule in ("nodes", "faces_finely")
    },
}


def angles(n):
    h, w = n // 2, np.deg2rad(40)
    pad = np.linspace(-w, w, h + 1)
    s, rest, first = np.linspace(-1, 1, n - h + 1), np.pi - w, 2 * w / h
    grow = lambda k: rest * (1 - np.sinh(k * (1 - 2 / (n - h))) / np.sinh(k)) - first
    k = brentq(grow, 1e-5, 20) if grow(1e-5) * grow(20) < 0 else 1e-5
    return np.concatenate([pad[:-1], (np.pi + rest * np.sinh(k * s) / np.sinh(k))[:-1]]) - np.pi / 2


def place(t, r):
    outer = np.array([A * np.cos(t), B * np.sin(t)])
    normal = np.array([np.cos(t) / A, np.sin(t) / B])
    normal /= np.linalg.norm(normal)
    if r <= 1.2 + 1e-12:
        return outer - normal * r
    bone = np.array([4.5 * np.cos(t), 2 + 3 * np.sin(t)])
    return (outer - normal * 1.2) * (2.2 - r) + bone * (r - 1.2)


def element(n, i, j, quadratic):
    at = lambda a, b: b * n + a % n
    if not quadratic:
        return [at(i, j + 1), at(i, j), at(i + 1, j), at(i + 1, j + 1)]
    return [at(i, j + 2), at(i, j), at(i + 2, j), at(i + 2, j + 2), at(i, j + 1), at(i + 1, j), at(i + 2, j + 1), at(i + 1, j + 2), at(i + 1, j + 1)]


def write_mesh(path, n, quadratic, layers):
    epidermis, dermis, fat = layers
    t = angles(n)
    depths = [0.2 * f for f in epidermis] + [0.2 + f for f in dermis[1:]] + [1.2 + f for f in fat[1:]]
    nodes = np.array([place(t[i], r) for r in depths for i in range(n)])
    step, ends = (2 if quadratic else 1), (len(epidermis) - 1, len(epidermis) + len(dermis) - 2)
    cells, skin, bone = [[], [], []], [], []
    for j in range(0, len(depths) - 1, step):
        for i in range(0, n, step):
            cells[0 if j < ends[0] else 1 if j < ends[1] else 2].append(element(n, i, j, quadratic))
            line = lambda b: [b * n + i, b * n + (i + step) % n] + ([b * n + i + 1] if quadratic else [])
            if j == 0:
                skin.append(line(0))
            if j == len(depths) - 1 - step:
                bone.append(line(len(depths) - 1))
    names = ["epidermis", "dermis", "subcutaneous"]
    out = ["$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n"]
    out += [f'2 {k + 1} "{name}"\n' for k, name in enumerate(names)] + ['1 4 "skin"\n1 5 "bone"\n$EndPhysicalNames\n$Entities\n0 2 3 0\n']
    out += [f"{tag} -9 -7 0 9 7 0 1 {group} 0\n" for tag, group in ((1, 4), (2, 5), (1, 1), (2, 2), (3, 3))]
    out += [f"$EndEntities\n$Nodes\n1 {len(nodes)} 1 {len(nodes)}\n2 1 0 {len(nodes)}\n"]
    out += [f"{i + 1}\n" for i in range(len(nodes))] + [f"{x:.16g} {y:.16g} 0\n" for x, y in nodes] + ["$EndNodes\n"]
    blocks = [(1, 1, 8 if quadratic else 1, skin), (1, 2, 8 if quadratic else 1, bone)]
    blocks += [(2, k + 1, 10 if quadratic else 3, cells[k]) for k in range(3)]
    total, number = sum(len(b[3]) for b in blocks), 0
    out.append(f"$Elements\n{len(blocks)} {total} 1 {total}\n")
    for dimension, tag, kind, rows in blocks:
        out.append(f"{dimension} {tag} {kind} {len(rows)}\n")
        for row in rows:
            number += 1
            out.append(f"{number} " + " ".join(str(v + 1) for v in row) + "\n")
    path.write_text("".join(out) + "$EndElements\n")
    return nodes


def shapes(x, y, quadratic):
    if not quadratic:
        return (np.array([a * (1 + b * y) / 4 for a, b in CORNERS]), np.array([b * (1 + a * x) / 4 for a, b in CORNERS]),
                np.array([(1 + a * x) * (1 + b * y) / 4 for a, b in CORNERS]))
    value = lambda s: np.array([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2])
    slope = lambda s: np.array([s - 0.5, -2 * s, s + 0.5])
    ix, iy = [0, 0, 2, 2, 0, 1, 2, 1, 1], [0, 2, 2, 0, 1, 2, 1, 0, 1]
    return slope(x)[ix] * value(y)[iy], value(x)[ix] * slope(y)[iy], value(x)[ix] * value(y)[iy]


def gradient(points, moved, x, y, quadratic):
    dx, dy, n = shapes(x, y, quadratic)
    jacobian = np.array([dx @ points, dy @ points])
    return (np.linalg.solve(jacobian, np.array([dx, dy])) @ moved).T, n @ points, abs(np.linalg.det(jacobian))


def deformation(h):
    f = np.eye(3)
    f[:2, :2] += h
    return f, np.linalg.det(f)


def dilatation(points, moved, quadratic):
    m = 3 if quadratic else 1
    mass, load = np.zeros((m, m)), np.zeros(m)
    for x, wx in GAUSS:
        for y, wy in GAUSS:
            h, _, volume = gradient(points, moved, x, y, quadratic)
            psi = np.array([1, x, y])[:m]
            mass += wx * wy * volume * np.outer(psi, psi)
            load += wx * wy * volume * psi * (deformation(h)[1] - 1)
    return np.linalg.solve(mass, load)


def energy(h, theta):
    bulk = 2 * MU_DERMIS * (1 + NU) / 3 / (1 - 2 * NU)
    f, j = deformation(h)
    return (MU_DERMIS / 2 * (j ** (-2 / 3) * np.trace(f.T @ f) - 3) + bulk / 2 * theta**2) * 1e6


def solve(program, folder, indenter, n, quadratic, layers, contact="nodes"):
    depth, shape = INDENTERS[indenter]
    name = f"{indenter}-{n}-{'q' if quadratic else 'l'}-{len(layers[0])}-{len(layers[1])}-{layers[1][1]:.3f}-{contact}"
    nodes = write_mesh(folder / f"{name}.msh", n, quadratic, layers)
    scene = folder / f"{name}.toml"
    scene.write_text(f'contact = "{contact}"\neffects = ["plane_strain", "finite_strain", "layers"]\n[geometry]\nkind = "mesh"\nfile = "{name}.msh"\n'
                     f'fixed = ["bone"]\ncontact = "skin"\n[indenter]\n{shape}\n[motion]\ndepth_mm = {depth}\nincrements = 2\n')
    out = folder / name
    if not (out / "summary.json").exists():
        done = subprocess.run([program, "solve", scene, "--out", out], capture_output=True, text=True)
        if done.returncode not in (0, 3):  # 3: solved, but a check of the path (energy against work) is not met
            raise SystemExit(f"{name}: {done.stderr}")
    field = meshio.read(sorted(out.glob("state-*.vtu"))[-1])
    moved = np.asarray(field.point_data["displacement_mm"])[cKDTree(field.points[:, :2]).query(nodes)[1], :2]
    summary = json.loads((out / "summary.json").read_text())
    return nodes, moved, summary["increments"][-1]["force_n"][1], summary["unknowns"]


def sed(nodes, moved, n, quadratic, layers, reading, at):
    step, first, rows = (2 if quadratic else 1), len(layers[0]) - 1, []
    for i in range(0, n, step):
        e = element(n, i, first, quadratic)
        if nodes[e[1], 1] > 0:
            continue
        theta = dilatation(nodes[e], moved[e], quadratic)
        value = lambda x, y: theta @ np.array([1, x, y])[: len(theta)]
        if reading == "centre":
            h, place_, _ = gradient(nodes[e], moved[e], 0, 0, quadratic)
            rows.append((*place_, energy(h, value(0, 0))))
        elif reading == "extrapolated":
            below = element(n, i, first + step, quadratic)
            h1, p1, _ = gradient(nodes[e], moved[e], 0, 0, quadratic)
            h2, p2, _ = gradient(nodes[below], moved[below], 0, 0, quadratic)
            top = gradient(nodes[e], moved[e], 0, 1, quadratic)[1]
            a = np.linalg.norm(p1 - top) / np.linalg.norm(p2 - p1)
            rows.append((*top, energy(h1 + a * (h1 - h2), theta[0] + a * (theta[0] - dilatation(nodes[below], moved[below], quadratic)[0]))))
        else:
            for x in (-0.57735, 0.57735) if quadratic else (0.0,):
                h, place_, _ = gradient(nodes[e], moved[e], x, 1, quadratic)
                rows.append((*place_, energy(h, value(x, 1))))
    rows = np.array(sorted(rows))
    return np.interp(at, rows[:, 0], rows[:, 2])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--out", type=Path, default=Path("section-study"))
    parser.add_argument("--indenter", choices=INDENTERS, action="append")
    parser.add_argument("--study", choices=STUDIES, default="elements")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    at = np.linspace(-6, 6, 481)
    for indenter in options.indenter or INDENTERS:
        nodes, moved, force, unknowns = solve(options.program, options.out, indenter, 512, True, REFERENCE)
        truth = sed(nodes, moved, 512, True, REFERENCE, "face", at)
        print(f"{indenter}: reference {force:.6f} N/mm, peak {truth.max():.1f} J/m3, {unknowns} unknowns")
        for name, (n, quadratic, layers, contact) in STUDIES[options.study].items():
            nodes, moved, f, unknowns = solve(options.program, options.out, indenter, n, quadratic, layers, contact)
            cells = []
            for reading in ("face",) if quadratic else ("face", "extrapolated"):
                v = sed(nodes, moved, n, quadratic, layers, reading, at)
                cells.append(f"{reading} {100 * np.linalg.norm(v - truth) / np.linalg.norm(truth):5.1f} % (peak {100 * (v.max() / truth.max() - 1):+.1f})")
            print(f"  {name:34s} {unknowns:6d} unknowns  force {100 * (f / force - 1):+.2f} %  " + "  ".join(cells))


if __name__ == "__main__":
    main()
