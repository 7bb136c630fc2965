"""The shape of a finger by the formulas of docs/concepts/physics.md and docs/guides/fingers.md, once more.

A point of the skin is named by a point q of a capsule: a unit half sphere with x <= 0, and behind it a unit tube
with x from 0 to 1.
"""

import itertools
import json
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# Control values of a skin's offset: along v, from the tip to the end, and along u, round the finger.
ROWS, COLUMNS = 17, 24
# Step along the skin for its normal, in radii of the capsule.
STEP = 1e-5


def snapped(q):
    """Onto the capsule."""
    ball = q / np.linalg.norm(q, axis=1)[:, None]
    # The tip's pole is on no tube.
    across = np.maximum(np.linalg.norm(q[:, 1:], axis=1), 1e-12)
    tube = np.concatenate([q[:, :1], q[:, 1:] / across[:, None]], 1)
    return np.where((q[:, 0] < 0)[:, None], ball, tube)


def capsule_at(u, v):
    """Points of the capsule: u turns once round it from the palmar side, v goes from the tip, 0, to the end, 2."""
    x, across = np.where(v < 1, -np.cos(np.pi / 2 * v), v - 1), np.sin(np.pi / 2 * np.minimum(v, 1))
    return np.stack([x, across * np.sin(2 * np.pi * u), -across * np.cos(2 * np.pi * u)], 1)


def cones(grid):
    """Volume between the origin and a surface that is given by a grid of points."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return ((np.cross(a, b) * c).sum() + (np.cross(a, c) * d).sum()) / 6


def spline(distance):
    """The cubic B-spline over knots 1 apart."""
    d = np.abs(distance)
    return np.where(d < 1, 2 / 3 - d**2 + d**3 / 2, np.maximum(2 - d, 0) ** 3 / 6)


class Offset:
    """How far the skin of a finger lies outside the template's."""

    def __init__(self, file: Path) -> None:
        read = json.loads(file.read_text())
        rows = np.array(read["offset_mm"])
        if read["format"] != 1 or rows.shape != (ROWS, COLUMNS):
            sys.exit(f"{file}: is not of format 1, with {ROWS} rows of {COLUMNS} numbers")
        # Before the tip comes the row behind it, seen from the other side; beyond the end a straight line.
        before, beyond = np.roll(rows[1], COLUMNS // 2), 2 * rows[-1] - rows[-2]
        self.control = np.stack([before, *rows, beyond])

    def __call__(self, q):
        x, y, z = q.T
        u = np.arctan2(y, -z) / (2 * np.pi) * COLUMNS
        v = np.where(x < 0, np.arctan2(np.hypot(y, z), -x) / (np.pi / 2), 1 + np.minimum(x, 1))
        half = COLUMNS / 2
        across = spline((u[:, None] - np.arange(COLUMNS) + half) % COLUMNS - half)
        along = spline(v[:, None] / 2 * (ROWS - 1) - np.arange(-1, ROWS + 1))
        return np.einsum("nr,rc,nc->n", along, self.control, across)


class Finger:
    """Skin, layers and bone of the finger of a file or a bundle."""

    def __init__(self, file: Path) -> None:
        file = file / "finger.toml" if file.is_dir() else file
        read = tomllib.loads((ROOT / "models/finger.toml").read_text())
        for table, own in tomllib.loads(file.read_text()).items():
            read.setdefault(table, {}).update(own)
        if any(isinstance(thickness, list) for thickness in read["layers"].values()):
            sys.exit(f"{file}: has the map of a layer, which this study does not know")
        self.shape, self.layer, self.rod, self.plate = (read[k] for k in ("shape", "layers", "bone", "nail"))
        self.length, self.cap = self.shape["length_mm"], self.shape["cap_length_mm"]
        self.half = 0.5 * self.shape["width_mm"], 0.5 * self.shape["height_mm"]
        skin = self.shape.get("skin")
        self.offset = Offset(file.parent / skin) if skin else None
        self.symmetric = skin is None

    def palmar(self, x):
        t = np.clip((x - self.cap) / (self.length - self.cap), 0, 1)
        return self.half[1] - self.shape["crease_depth_mm"] * t * t * (3 - 2 * t)

    def template(self, q):
        x, y, z = q.T
        e = self.shape["cap_exponent"]
        size = (np.hypot(y, z) ** e + np.abs(x) ** e) ** (-1 / e)
        cap = np.stack([self.cap * (1 + x * size), self.half[0] * y * size, self.half[1] * z * size], 1)
        along = self.cap + x * (self.length - self.cap)
        height = np.where(z < 0, self.palmar(along), self.half[1])
        body = np.stack([along, self.half[0] * y, height * z], 1)
        return np.where((x < 0)[:, None], cap, body)

    def named(self, p):
        """The points of the capsule that name points of the skin."""
        q = self.named_of_template(p)
        # An offset changes little over the way that it moves the skin: each round leaves a tenth of the error.
        for _ in range(30 if self.offset else 0):
            q = self.named_of_template(p - self.offset(q)[:, None] * self.template_normal(self.template(q)))
        return q

    def named_of_template(self, p):
        x, y, z = p.T
        x, y = x - self.cap, y / self.half[0]
        height = np.where((x > 0) & (z < 0), self.palmar(p[:, 0]), self.half[1])
        long = np.where(x < 0, self.cap, self.length - self.cap)
        return snapped(np.stack([x / long, y, z / height], 1))

    def level(self, p):
        """0 on the template's skin, negative inside."""
        x, y, z = p.T
        e = self.shape["cap_exponent"]
        height = np.where(z < 0, self.palmar(x), self.half[1])
        section = (y / self.half[0]) ** 2 + (z / height) ** 2
        cap = section ** (e / 2) + (np.maximum(self.cap - x, 0) / self.cap) ** e - 1
        return np.where(x < self.cap, cap, section - 1)

    def template_normal(self, p):
        step = 1e-5 * np.eye(3)
        n = np.stack([self.level(p + h) - self.level(p - h) for h in step], 1)
        return n / np.linalg.norm(n, axis=1)[:, None]

    def skin(self, q):
        p = self.template(q)
        return p if self.offset is None else p + self.offset(q)[:, None] * self.template_normal(p)

    def normal(self, q):
        n = self.template_normal(self.template(q))
        if self.offset is None:
            return n
        # Two directions along the capsule, and what they are along the skin.
        out = np.where((q[:, :1] < 0), q, q * [0, 1, 1])
        other = np.eye(3)[np.abs(out).argmin(1)]
        ways = [np.cross(out, other), np.cross(out, np.cross(out, other))]
        ways = [STEP * way / np.linalg.norm(way, axis=1)[:, None] for way in ways]
        n_of_skin = np.cross(*(self.skin(snapped(q + way)) - self.skin(snapped(q - way)) for way in ways))
        n_of_skin /= np.linalg.norm(n_of_skin, axis=1)[:, None]
        return n_of_skin * np.sign((n_of_skin * n).sum(1))[:, None]

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
        skin, bone, n = self.skin(q), self.bone(q), self.normal(q)
        gap = ((skin - bone) * n).sum(1)
        epidermis, both = self.layer["epidermis_mm"], self.layer["epidermis_mm"] + self.layer["dermis_mm"]
        room = 0.75 * gap / both
        d = np.clip((room - 1) / 0.1, -1, 1)
        squeeze = np.minimum(1, room) - 0.25 * 0.1 * (1 - np.abs(d)) ** 2
        below = [skin - (depth * squeeze)[:, None] * n for depth in (epidermis, both)]
        return np.stack([skin, *below, bone])

    def volumes_mm3(self, steps: int = 600):
        """Volumes of the three layers, whatever their mesh: by flat triangles between many points of their bounds."""
        u, v = np.meshgrid(np.linspace(0, 1, steps + 1), np.linspace(1e-6, 2, steps + 1), indexing="ij")
        bounds = self.bounds(capsule_at(u.ravel(), v.ravel())).reshape(4, steps + 1, steps + 1, 3)
        bounds = bounds - [self.length, 0, 0]
        inside = np.array([cones(grid) for grid in bounds])
        # A layer ends at the base, between the edges of its bounds.
        ends = np.array([cones(np.stack([a[:, -1], b[:, -1]], 1)) for a, b in itertools.pairwise(bounds)])
        return np.abs(inside[:-1] - inside[1:] + ends)

    def under_nail(self, p):
        (wide, long), tip = self.plate["size_mm"], self.plate["tip_mm"]
        x, y, z = p.T
        return (z > 0.5 * self.half[1]) & (np.abs(y) <= 0.5 * wide) & (x >= tip) & (x <= tip + long)

    def touch(self, offset_mm, ball_mm: float):
        """Centre of a ball that comes from below, at first touch, and the point that it touches. Its way passes
        the lowest point of the skin, with an offset along x and y."""
        lowest = self.least(lambda p: p[:, 2])
        over = lowest[:2] + offset_mm

        def free(p):
            away = ball_mm**2 - ((p[:, :2] - over) ** 2).sum(1)
            return np.where(away > 0, p[:, 2] - np.sqrt(np.maximum(away, 0)), np.inf)

        touched = self.least(free)
        return np.array([*over, free(touched[None])[0]]), touched

    def least(self, value):
        """The point of the palmar skin with the least value: on a grid that closes in."""
        u, v, wide = 0.0, 1.0, 0.95
        for _ in range(30):
            us, vs = np.meshgrid(u + wide / 4 * np.linspace(-1, 1, 21), v + wide * np.linspace(-1, 1, 21))
            on = np.clip(vs.ravel(), 0, 2)
            p = self.skin(capsule_at(us.ravel(), on))
            k = value(p).argmin()
            u, v, wide = us.ravel()[k], on[k], 0.6 * wide
        return p[k] * [1, 0, 1] if self.symmetric else p[k]
