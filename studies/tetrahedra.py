#!/usr/bin/env python3
"""Is a finger pressed the same on tetrahedra, by another program?

    python studies/tetrahedra.py [--finger FINGER.toml] [--size MM...] [--density NAME...] [--out out/tetrahedra]

Meshes a finger with tetrahedra, presses them with a ball in CalculiX, and compares force and SED at the
interface with `fe-datagen solve` of the same press on hexahedra. Nothing is shared but the numbers of the
finger and `fe-datagen export`, which writes the deck: this file has the formulas of the shape
(docs/concepts/physics.md) once more, gmsh makes triangles of the skin, which are extruded inward, and
CalculiX solves. Skin offsets (skin.json) and maps of layers are not known here. Finger and press are the
same on both sides, so one half is meshed. The volumes of the tissues are compared too.

Needs numpy and gmsh (PyPI), ccx (Debian package calculix-ccx) and fe-datagen: FE_DATAGEN, CCX, or PATH. Run it
in the root of the repository. What is solved stays in --out and is not solved again.
"""

import argparse
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
DEPTH_MM = 0.6
BALL_MM = 6.0
TISSUES = ("epidermis", "dermis", "subcutaneous")
# Where nodes lie through each layer, as parts of its thickness.
THROUGH = {
    "epidermis": [0.0, 0.5, 1.0],
    "dermis": [0.0, 0.12, 0.35, 1.0],
    "subcutaneous": [0.0, 0.2, 0.5, 1.0],
}
# Radius around the touch where elements have --size, and by how much they grow beyond for each mm.
FINE_MM, GROWTH, LARGEST_MM = 2.4, 0.35, 2.5
# SED is compared within this distance of the touch.
COMPARED_MM = 5.0
# Young's moduli, MPa, and Poisson's ratio, as docs/reference/scenes.md has them.
YOUNG_MPA = {"epidermis": 0.136, "dermis": 0.080, "subcutaneous": 0.034}
POISSON = 0.48


class Finger:
    """The shape, by its formulas. A point of the skin is named by a point of a capsule: a unit half sphere with
    x <= 0, and behind it a unit tube with x from 0 to 1."""

    def __init__(self, file: Path) -> None:
        read = tomllib.loads((ROOT / "models/finger.toml").read_text())
        for table, own in tomllib.loads(file.read_text()).items():
            read.setdefault(table, {}).update(own)
        if "skin" in read["shape"]:
            sys.exit(f"{file}: names a skin's offset, which this study does not know")
        if any(isinstance(thickness, list) for thickness in read["layers"].values()):
            sys.exit(f"{file}: has the map of a layer, which this study does not know")
        self.shape, self.layer, self.rod, self.plate = (read[k] for k in ("shape", "layers", "bone", "nail"))
        self.length, self.cap = self.shape["length_mm"], self.shape["cap_length_mm"]
        self.half = 0.5 * self.shape["width_mm"], 0.5 * self.shape["height_mm"]

    def palmar(self, x):
        t = np.clip((x - self.cap) / (self.length - self.cap), 0, 1)
        return self.half[1] - self.shape["crease_depth_mm"] * t * t * (3 - 2 * t)

    def skin(self, q):
        x, y, z = q.T
        e = self.shape["cap_exponent"]
        size = (np.hypot(y, z) ** e + np.abs(x) ** e) ** (-1 / e)
        cap = np.stack([self.cap * (1 + x * size), self.half[0] * y * size, self.half[1] * z * size], 1)
        along = self.cap + x * (self.length - self.cap)
        height = np.where(z < 0, self.palmar(along), self.half[1])
        body = np.stack([along, self.half[0] * y, height * z], 1)
        return np.where((x < 0)[:, None], cap, body)

    def level(self, p):
        x, y, z = p.T
        e = self.shape["cap_exponent"]
        height = np.where(z < 0, self.palmar(x), self.half[1])
        section = (y / self.half[0]) ** 2 + (z / height) ** 2
        cap = section ** (e / 2) + (np.maximum(self.cap - x, 0) / self.cap) ** e - 1
        return np.where(x < self.cap, cap, section - 1)

    def normal(self, p):
        step = 1e-5 * np.eye(3)
        n = np.stack([self.level(p + h) - self.level(p - h) for h in step], 1)
        return n / np.linalg.norm(n, axis=1)[:, None]

    def bone(self, q):
        rod, neck = self.rod, self.rod["tip_mm"] + self.rod["cap_mm"]
        waist = self.length - rod["waist_at"] * (self.length - rod["tip_mm"])
        x, y, z = q.T
        along = np.where(x < 0, neck + rod["cap_mm"] * x, neck + x * (self.length - neck))

        def half(i):
            def step(t):
                t = np.clip(t, 0, 1)
                return t * t * (3 - 2 * t)

            tuft, mid, base = (rod[k][i] for k in ("tuft_mm", "waist_mm", "base_mm"))
            front = tuft + (mid - tuft) * step((along - neck) / (waist - neck))
            back = mid + (base - mid) * step((along - waist) / (self.length - waist))
            return 0.5 * np.where(along < neck, tuft, np.where(along < waist, front, back))

        return np.stack([along, half(0) * y, rod["offset_mm"] + half(1) * z], 1)

    def bounds(self, q):
        """Skin, interface, lower side of the dermis and bone below points of the capsule: [4, N, 3]."""
        skin, bone = self.skin(q), self.bone(q)
        n = self.normal(skin)
        gap = ((skin - bone) * n).sum(1)
        epidermis, both = self.layer["epidermis_mm"], self.layer["epidermis_mm"] + self.layer["dermis_mm"]
        room = 0.75 * gap / both
        d = np.clip((room - 1) / 0.1, -1, 1)
        squeeze = np.minimum(1, room) - 0.25 * 0.1 * (1 - np.abs(d)) ** 2
        below = [skin - (depth * squeeze)[:, None] * n for depth in (epidermis, both)]
        return np.stack([skin, *below, bone])

    def under_nail(self, p):
        (wide, long), tip = self.plate["size_mm"], self.plate["tip_mm"]
        x, y, z = p.T
        return (z > 0.5 * self.half[1]) & (np.abs(y) <= 0.5 * wide) & (x >= tip) & (x <= tip + long)

    def touch(self):
        """Where a ball touches first that comes from below."""
        return np.array([self.cap, 0.0, -self.half[1]])


def snapped(q):
    """Onto the capsule."""
    ball = q / np.linalg.norm(q, axis=1)[:, None]
    # The tip's pole is on no tube.
    across = np.maximum(np.linalg.norm(q[:, 1:], axis=1), 1e-12)
    tube = np.concatenate([q[:, :1], q[:, 1:] / across[:, None]], 1)
    return np.where((q[:, 0] < 0)[:, None], ball, tube)


def capsule(finger: Finger, size_mm: float):
    """Triangles of the half of the capsule with y >= 0, fine where the ball touches."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    # As long as the finger behind its cap, in half widths.
    long = (finger.length - finger.cap) / finger.half[0]
    occ = gmsh.model.occ
    ball = occ.addSphere(0, 0, 0, 1)
    box = occ.addBox(0, -2, -2, 2, 4, 4)
    occ.cut([(3, ball)], [(3, box)])
    tube = occ.addCylinder(0, 0, 0, long, 0, 0, 1)
    occ.fragment(occ.getEntities(3), [(3, tube)])
    occ.cut(occ.getEntities(3), [(3, occ.addBox(-2, -2, -2, long + 4, 2, 4))])
    occ.synchronize()
    touch, scale = finger.touch(), finger.half[0]

    def wanted(_dim, _tag, x, y, z, _size):
        q = np.array([[x if x < 0 else x / long, y, z]])
        away = np.linalg.norm(finger.skin(snapped(q))[0] - touch) if x * x + y * y + z * z > 0.01 else 99.0
        return min(size_mm + GROWTH * max(away - FINE_MM, 0.0), LARGEST_MM) / scale

    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.model.mesh.setSizeCallback(wanted)
    gmsh.model.mesh.generate(2)
    tags, places, _ = gmsh.model.mesh.getNodes()
    number = {int(tag): n for n, tag in enumerate(tags)}
    places = places.reshape(-1, 3)
    triangles = []
    for _, surface in gmsh.model.getEntities(2):
        _, _, corners = gmsh.model.mesh.getElements(2, surface)
        own = np.array([number[int(c)] for c in np.concatenate(corners)]).reshape(-1, 3)
        # The discs inside and at the end, and the plane of symmetry, are no skin.
        of = places[own].reshape(-1, 3)
        if np.ptp(of[:, 0]) > 1e-9 and np.ptp(of[:, 1]) > 1e-9:
            triangles.append(own)
    gmsh.finalize()
    triangles = np.concatenate(triangles)
    used, triangles = np.unique(triangles, return_inverse=True)
    q = places[used]
    q[:, 0] = np.where(q[:, 0] < 0, q[:, 0], q[:, 0] / long)
    q[np.abs(q[:, 0] - 1) < 1e-9, 0] = 1.0
    q[np.abs(q) < 1e-9] = 0.0
    return snapped(q), triangles.reshape(-1, 3)


class Mesh:
    """Tetrahedra of ten nodes, curved as the finger is."""

    def __init__(self, finger: Finger, q, triangles) -> None:
        self.finger, self.q = finger, q
        # A level is a tissue's number and a part of its thickness; the last of one tissue is the first of the next.
        self.levels = [(t, f) for t, tissue in enumerate(TISSUES) for f in THROUGH[tissue][:-1]] + [(2, 1.0)]
        self.nodes, self.number = [], {}
        tets, tissue_of = [], []
        corners = np.sort(triangles, 1)
        for level in range(len(self.levels) - 1):
            tissue = self.levels[level][0]
            for a, b, c in corners.tolist():
                top, low = [(v, level) for v in (a, b, c)], [(v, level + 1) for v in (a, b, c)]
                tets += [[*top, low[2]], [*top[:2], low[1], low[2]], [top[0], *low]]
                tissue_of += [tissue] * 3
        self.tets = [self.ten(tet) for tet in tets]
        self.tissue_of = tissue_of
        last = len(self.levels) - 1
        flags = finger.under_nail(finger.skin(q))[triangles].all(1)
        self.faces = {"skin": [], "nail": [], "bone": []}
        for (a, b, c), nail in zip(triangles.tolist(), flags.tolist(), strict=True):
            self.faces["nail" if nail else "skin"].append(self.six([(v, 0) for v in (a, b, c)]))
            self.faces["bone"].append(self.six([(v, last) for v in (a, b, c)]))
        self.place()

    def node(self, *ends) -> int:
        """A corner, or the middle between two: both ends lie on levels of one tissue."""
        key = tuple(sorted(ends))
        if key not in self.number:
            self.number[key] = len(self.nodes)
            self.nodes.append(key)
        return self.number[key]

    def ten(self, tet):
        edges = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
        return [self.node(v) for v in tet] + [self.node(tet[i], tet[j]) for i, j in edges]

    def six(self, face):
        return [self.node(v) for v in face] + [self.node(face[i], face[j]) for i, j in ((0, 1), (1, 2), (2, 0))]

    def place(self) -> None:
        ends = [(key[0], key[-1]) for key in self.nodes]
        q = snapped(np.array([(self.q[a[0]] + self.q[b[0]]) / 2 for a, b in ends]))
        bounds = self.finger.bounds(q)
        tissue, part = [], []
        for a, b in ends:
            (ta, fa), (tb, fb) = self.levels[min(a[1], b[1])], self.levels[max(a[1], b[1])]
            if tb > ta:
                fb = 1.0
            tissue.append(ta)
            part.append((fa + fb) / 2)
        tissue, part = np.array(tissue), np.array(part)[:, None]
        every = np.arange(len(tissue))
        self.places = (1 - part) * bounds[tissue, every] + part * bounds[tissue + 1, every]
        # Gmsh's order is positive: two corners are swapped, and the edges with them, where the volume is not.
        # Edges follow Gmsh's: 01, 12, 20, 30, 23, 13.
        corner = self.places[np.array([tet[:4] for tet in self.tets])]
        one, two, three = (corner[:, k] - corner[:, 0] for k in (1, 2, 3))
        volume = (np.cross(one, two) * three).sum(1)
        turned = (0, 2, 1, 3, 6, 5, 4, 7, 9, 8)
        self.tets = [
            tet if v > 0 else [tet[k] for k in turned]
            for tet, v in zip(self.tets, volume, strict=True)
        ]

    def write(self, path: Path) -> None:
        import gmsh

        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        model, mesh = gmsh.model, gmsh.model.mesh
        for t, tissue in enumerate(TISSUES):
            model.addDiscreteEntity(3, t + 1)
            model.setPhysicalName(3, model.addPhysicalGroup(3, [t + 1]), tissue)
        tags = np.arange(1, len(self.places) + 1)
        mesh.addNodes(3, 1, tags, self.places.ravel())
        for t in range(3):
            own = [tet for tet, of in zip(self.tets, self.tissue_of, strict=True) if of == t]
            mesh.addElementsByType(t + 1, 11, [], (np.array(own) + 1).ravel())
        for n, (name, faces) in enumerate(self.faces.items()):
            model.addDiscreteEntity(2, n + 1)
            mesh.addElementsByType(n + 1, 9, [], (np.array(faces) + 1).ravel())
            model.setPhysicalName(2, model.addPhysicalGroup(2, [n + 1]), name)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.write(str(path))
        gmsh.finalize()


def press(poisson: float) -> str:
    """What both scenes say alike."""
    text = PRESS
    for tissue, young in YOUNG_MPA.items():
        text += f"\n[materials.{tissue}]\nyoungs_modulus_mpa = {young}\npoissons_ratio = {poisson}\n"
    return text


PRESS = f"""
[indenter]
shape = "sphere"
radius_mm = {BALL_MM}

[motion]
depth_mm = {DEPTH_MM}
increments = 3
"""


def program(variable: str, name: str) -> str:
    found = shutil.which(os.environ.get(variable, name))
    if found is None:
        sys.exit(f"there is no program {name}: install it, or name it by {variable}")
    return found


def run(*words, cwd=ROOT) -> float:
    """Runs a command; its processor seconds."""
    words = [str(word) for word in words]
    print("+", *words, file=sys.stderr, flush=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    log = subprocess.run(words, cwd=cwd, stdout=subprocess.PIPE, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if log.returncode != 0:
        sys.exit(f"{words[0]} ended with {log.returncode}: {log.stdout[-2000:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def on_hexahedra(out: Path, finger: Path, density: str, poisson: float) -> dict:
    """The press by fe-datagen on its own mesh."""
    folder = out / f"hexahedra-{density}-{poisson:g}"
    scene = out / f"hexahedra-{density}-{poisson:g}.toml"
    head = f'outputs = ["maps"]\n\n[geometry]\nkind = "fingertip"\nfinger = "{finger}"\ndensity = "{density}"\n'
    scene.write_text(head + press(poisson))
    took = folder / "processor_s.json"
    if not took.is_file():
        seconds = run(program("FE_DATAGEN", "fe-datagen"), "solve", scene, "--out", folder)
        took.write_text(json.dumps(seconds))
    summary = json.loads((folder / "summary.json").read_text())
    force = np.linalg.norm(summary["increments"][-1]["force_n"])
    with np.load(folder / "maps.npz") as maps:
        sed = maps["sed_dermis_j_per_m3"][-1]
    atlas = json.loads((folder / "atlas.json").read_text())
    deck = folder / f"{scene.stem}.inp"
    if not deck.is_file():
        run(program("FE_DATAGEN", "fe-datagen"), "export", scene, "--format", "inp", "--out", folder)
    return {
        "force_n": force,
        "sed": sed,
        "atlas": atlas,
        "elements": summary["elements"],
        "unknowns": summary["unknowns"],
        "volumes_mm3": volumes_mm3(*read_deck(deck.read_text(), "C3D20", 20)),
        "s": json.loads(took.read_text()),
    }


def blocks(deck: str):
    """The keyword lines of a deck, each with the lines below it."""
    for part in re.split(r"^(?=\*[A-Z])", deck, flags=re.MULTILINE)[1:]:
        head, _, rest = part.partition("\n")
        yield head, rest


def read_deck(deck: str, kind: str = "C3D10", nodes: int = 10):
    """Places of the body's nodes, by number, and elements of each tissue: number and nodes."""
    places, elements = {}, {}
    for head, rest in blocks(deck):
        if head.startswith("*NODE, NSET=NBODY"):
            for line in rest.splitlines():
                number, *place = line.split(",")
                places[int(number)] = [float(v) for v in place]
        elif head.startswith(f"*ELEMENT, TYPE={kind}") and "INDENTER" not in head:
            numbers = [int(v) for v in re.findall(r"\d+", rest)]
            elements[head.rpartition("ELSET=E")[2].strip().lower()] = np.array(numbers).reshape(-1, nodes + 1)
    return places, elements


def volumes_mm3(places: dict, elements: dict) -> dict:
    """Volumes of the tissues on C3D10 or C3D20, curved as their nodes are."""
    found = {}
    for tissue, own in elements.items():
        at = np.array([[places[n] for n in nodes] for nodes in own[:, 1:].tolist()])
        slopes, weights = TET_RULE if at.shape[1] == 10 else HEX_RULE
        jacobian = np.einsum("eni,qnj->eqij", at, slopes)
        found[tissue] = float((np.linalg.det(jacobian) @ weights).sum())
    return found


def tet_rule():
    """Slopes of a C3D10's functions at five points, which integrate a cubic, and their weights."""
    points = [[0.25, 0.25, 0.25, 0.25]] + [[1 / 2 if k == i else 1 / 6 for k in range(4)] for i in range(4)]
    corner = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    edges = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
    slopes = []
    for p in points:
        own = [(4 * p[k] - 1) * corner[k] for k in range(4)]
        slopes.append(own + [4 * (p[i] * corner[j] + p[j] * corner[i]) for i, j in edges])
    return np.array(slopes), np.array([-4 / 5, 9 / 20, 9 / 20, 9 / 20, 9 / 20]) / 6


def hex_rule():
    """Slopes of a C3D20's functions at 27 points, and their weights."""
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
    rule = [((x, y, z), a * b * c) for x, a in line for y, b in line for z, c in line]
    # Quadratic along each line: central differences are exact.
    step = 0.1 * np.eye(3)
    slopes = [np.stack([(functions(p + h) - functions(p - h)) / 0.2 for h in step], 1) for p, _ in rule]
    return np.array(slopes), np.array([w for _, w in rule])


TET_RULE, HEX_RULE = tet_rule(), hex_rule()


def tables(path: Path):
    """Tables of a .dat file: heading, time and rows."""
    heading, time, rows = "", 0.0, []
    for line in path.read_text().splitlines():
        text = line.strip()
        if not text:
            continue
        if text[0].isalpha() and not text.startswith("NaN"):
            yield heading, time, rows
            heading, _, time = text.rpartition("time")
            time, rows = float(time), []
        else:
            rows.append(text.split())
    yield heading, time, rows


def sed_j_per_m3(strain, poisson: float):
    """SED of the dermis of Green's strain: xx, yy, zz, xy, xz, yz."""
    young = YOUNG_MPA["dermis"]
    mu, bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))
    xx, yy, zz, xy, xz, yz = 2 * strain.T
    c = np.stack([np.stack(row, -1) for row in ((1 + xx, xy, xz), (xy, 1 + yy, yz), (xz, yz, 1 + zz))], -2)
    j = np.sqrt(np.linalg.det(c))
    trace = np.trace(c, axis1=1, axis2=2)
    return 1e6 * (mu / 2 * (j ** (-2 / 3) * trace - 3) + bulk / 2 * (j - 1) ** 2)


def on_tetrahedra(out: Path, finger: Finger, size_mm: float, poisson: float) -> dict:
    """The press by CalculiX; SED on the dermis' side at the corners on the interface."""
    folder = out / f"tetrahedra-{size_mm:g}-{poisson:g}"
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "press.toml"
    if not (folder / "finger.msh").is_file():
        Mesh(finger, *capsule(finger, size_mm)).write(folder / "finger.msh")
    head = '[geometry]\nkind = "mesh"\nfile = "finger.msh"\nfixed = ["bone", "nail"]\ncontact = "skin"\n'
    scene.write_text(head + press(poisson))
    took = folder / "processor_s.json"
    if not took.is_file():
        run(program("FE_DATAGEN", "fe-datagen"), "export", scene, "--format", "inp", "--out", folder)
        deck = (folder / "press.inp").read_text()
        # A scene holds nodes in all directions. The base is held along the finger alone, and the plane
        # of symmetry across it.
        places, _ = read_deck(deck)
        held = ""
        for name, axis, at in (("NBASE", 0, finger.length), ("NMIDDLE", 1, 0.0)):
            nodes = [n for n, place in places.items() if abs(place[axis] - at) < 1e-6]
            held += f"*NSET, NSET={name}\n" + "".join(f"{n},\n" for n in nodes)
            held += f"*BOUNDARY\n{name},{axis + 1},{axis + 1}\n"
        deck = deck.replace("*STEP", held + "*STEP", 1)
        # What is written of stress takes most of the disk, and is not read.
        (folder / "press.inp").write_text(deck.replace("\nE,S\n", "\nE\n"))
        took.write_text(json.dumps(run(program("CCX", "ccx"), "-i", "press", cwd=folder)))
    places, elements = read_deck((folder / "press.inp").read_text())
    force = strain = None
    for heading, time, rows in tables(folder / "press.dat"):
        if abs(time - 1) > 1e-6:
            continue
        if heading.startswith("total force") and "NINDENTER" in heading:
            # Of one half. What holds the ball in its plane is no force of the whole.
            force = 2 * abs(float(rows[0][2]))
        if heading.startswith("strains"):
            strain = {(int(row[0]), int(row[1])): [float(v) for v in row[2:8]] for row in rows}
    if force is None or strain is None:
        sys.exit(f"{folder}/press.dat: CalculiX stopped before the end")
    dermis = elements["dermis"]
    at_points = np.array([[strain[int(e), k] for k in (1, 2, 3, 4)] for e in dermis[:, 0]])
    sed = sed_j_per_m3(at_points.reshape(-1, 6), poisson).reshape(-1, 4)
    # Point k lies near corner k. A field that is linear in the element, from its points to its corners.
    near, far = 0.585410196624968, 0.138196601125011
    at_corners = (sed - far * sed.sum(1, keepdims=True)) / (near - far)
    shared = set(dermis[:, 1:5].ravel().tolist()) & set(elements["epidermis"][:, 1:5].ravel().tolist())
    corner = np.array([[places[n] for n in tet] for tet in dermis[:, 1:5].tolist()])
    edges = corner[:, 1:] - corner[:, :1]
    volume = np.abs(np.linalg.det(edges)) / 6
    sums = dict.fromkeys(shared, 0.0)
    weights, areas = dict(sums), dict(sums)
    for tet, values, v, own in zip(dermis[:, 1:5].tolist(), at_corners, volume, corner, strict=True):
        on = [k for k, n in enumerate(tet) if n in shared]
        for k in on:
            sums[tet[k]] += v * values[k]
            weights[tet[k]] += v
        if len(on) == 3:
            a, b, c = own[on]
            for k in on:
                areas[tet[k]] += np.linalg.norm(np.cross(b - a, c - a)) / 6
    numbers = sorted(shared)
    held = 3 * len(places)
    return {
        "force_n": force,
        "places": np.array([places[n] for n in numbers]),
        "sed": np.array([sums[n] / weights[n] for n in numbers]),
        "areas": np.array([areas[n] for n in numbers]),
        "unknowns": held,
        "elements": sum(len(e) for e in elements.values()),
        # Of the whole.
        "volumes_mm3": {tissue: 2 * volume for tissue, volume in volumes_mm3(places, elements).items()},
        "s": json.loads(took.read_text()),
    }


def read_map(of: dict, places):
    """SED of a map at places of the interface near the pad, by the atlas' triangles seen from below."""
    patch = of["atlas"]["interface"]
    positions, uv = np.array(patch["positions_mm"]), np.array(patch["uv_px"])
    triangles = np.array(of["atlas"]["triangles"])
    corner = positions[triangles][:, :, :2]
    below = positions[triangles][:, :, 2].max(1) < 0
    found = np.full(len(places), np.nan)
    for n, place in enumerate(places):
        a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
        whole = cross2(b - a, c - a)
        parts = np.stack([cross2(b - place[:2], c - place[:2]), cross2(c - place[:2], a - place[:2])], 1)
        parts = np.concatenate([parts, (whole - parts.sum(1))[:, None]], 1) / whole[:, None]
        hit = np.flatnonzero(below & (parts.min(1) > -1e-6))
        if len(hit):
            column, row = parts[hit[0]] @ uv[triangles[hit[0]]] - 0.5
            i, k = int(np.floor(row)), int(np.floor(column))
            v, u = row - i, column - k
            window = of["sed"][i : i + 2, k : k + 2]
            found[n] = np.array([1 - v, v]) @ window @ np.array([1 - u, u])
    return found


def cross2(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def compared(finger: Finger, hexes: dict, tets: dict) -> dict:
    away = np.linalg.norm(tets["places"][:, :2] - finger.touch()[:2], axis=1)
    near = (away < COMPARED_MM) & (tets["places"][:, 2] < 0)
    own, other, area = tets["sed"][near], read_map(hexes, tets["places"][near]), tets["areas"][near]
    known = np.isfinite(other)
    norm = lambda values: np.sqrt((area[known] * values[known] ** 2).sum())  # noqa: E731
    return {
        "force": tets["force_n"] / hexes["force_n"] - 1,
        "sed_relative_l2": norm(own - other) / norm(other),
        "sed_largest": own[known].max() / other[known].max() - 1,
        "sed_mean": (area * own)[known].sum() / (area * other)[known].sum() - 1,
        "points": int(known.sum()),
        "volumes": {tissue: own / hexes["volumes_mm3"][tissue] - 1 for tissue, own in tets["volumes_mm3"].items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--finger", type=Path, default=ROOT / "models/finger.toml", help="its file")
    parser.add_argument("--size", type=float, nargs="+", default=[0.45, 0.3], help="edges under the ball, mm")
    parser.add_argument("--density", nargs="+", default=["medium", "fine"], help="hexahedra; the last is the truth")
    parser.add_argument("--poisson", type=float, default=POISSON, help="Poisson's ratio of all soft tissues")
    parser.add_argument("--out", type=Path, default=ROOT / "out/tetrahedra")
    options = parser.parse_args()
    out, file = options.out.resolve(), options.finger.resolve()
    out.mkdir(parents=True, exist_ok=True)
    finger = Finger(file)
    hexes = {density: on_hexahedra(out, file, density, options.poisson) for density in options.density}
    truth = hexes[options.density[-1]]
    rows = ["| solved by | elements | unknowns | processor time, s | force, N | force: difference | SED: relative L2 |"]
    rows[0] += " SED: largest value | SED: mean |"
    rows += ["|---" * 9 + "|"]
    for density, of in hexes.items():
        rows.append(
            f"| `fe-datagen` | {of['elements']} hexahedra, `{density}` | {of['unknowns']} | {of['s']:.0f} "
            f"| {of['force_n']:.4f} | {100 * (of['force_n'] / truth['force_n'] - 1):+.2f} % | | | |"
        )
    found = []
    for size in options.size:
        of = on_tetrahedra(out, finger, size, options.poisson)
        row = compared(finger, truth, of)
        kept = {key: of[key] for key in ("force_n", "elements", "unknowns", "volumes_mm3", "s")}
        found.append({"size_mm": size, **kept, **row})
        rows.append(
            f"| CalculiX | {of['elements']} tetrahedra, {size:g} mm | {of['unknowns']} | {of['s']:.0f} "
            f"| {of['force_n']:.4f} | {100 * row['force']:+.2f} % | {100 * row['sed_relative_l2']:.2f} % "
            f"| {100 * row['sed_largest']:+.2f} % | {100 * row['sed_mean']:+.2f} % |"
        )
    rows += ["", "| tetrahedra, mm | " + " | ".join(f"{tissue}: volume" for tissue in TISSUES) + " |", "|---" * 4 + "|"]
    for row in found:
        parts = (f"{100 * row['volumes'][tissue]:+.3f} %" for tissue in TISSUES)
        rows.append(f"| {row['size_mm']:g} | " + " | ".join(parts) + " |")
    (out / f"tetrahedra-{options.poisson:g}.json").write_text(json.dumps(found, indent=2) + "\n")
    (out / f"tetrahedra-{options.poisson:g}.md").write_text("\n".join(rows) + "\n")
    print("\n".join(rows))


if __name__ == "__main__":
    main()
