"""Tetrahedra of a finger: triangles of its skin by gmsh, extruded inward to prisms, each divided in three."""

import numpy as np

from witness.shape import Finger, snapped

TISSUES = ("epidermis", "dermis", "subcutaneous")
# Where corners lie through each layer, as parts of its thickness.
THROUGH = {
    "epidermis": [0.0, 0.5, 1.0],
    "dermis": [0.0, 0.12, 0.35, 1.0],
    "subcutaneous": [0.0, 0.2, 0.5, 1.0],
}
# Radius around the touch where triangles have the size asked for, and by how much they grow beyond for each mm.
FINE_MM, GROWTH, LARGEST_MM = 2.4, 0.35, 2.5
SIDES = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


def capsule(finger: Finger, size_mm: float, touch):
    """Triangles of the capsule, of a symmetric finger of its half with y >= 0, fine where the ball touches."""
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
    if finger.symmetric:
        occ.cut(occ.getEntities(3), [(3, occ.addBox(-2, -2, -2, long + 4, 2, 4))])
    occ.synchronize()
    scale = finger.half[0]

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
    """Corners and tetrahedra, the middles of edges on the finger, and faces by name.

    places   [N, 3], mm
    tets     [E, 4] corners, of positive volume where the first three turn left as seen from the fourth
    tissue   [E] number of the tissue
    edges    [M, 2] corners, and `middles` [M, 3], mm: where the finger has the middle of that edge
    faces    of skin, nail, bone, base, middle (the plane of symmetry) and interface: [F, 3] corners
    """

    def __init__(self, finger: Finger, size_mm: float, touch) -> None:
        q, triangles = capsule(finger, size_mm, touch)
        # A level is a tissue's number and a part of its thickness; the last of one tissue is the first of the next.
        levels = [(t, f) for t, tissue in enumerate(TISSUES) for f in THROUGH[tissue][:-1]] + [(2, 1.0)]
        count, above = len(q), np.sort(triangles, 1)
        tets, tissue = [], []
        for level, (t, _) in enumerate(levels[:-1]):
            a, b, c = (above + level * count).T
            low = count
            tets += [np.stack([a, b, c, c + low], 1), np.stack([a, b, b + low, c + low], 1)]
            tets += [np.stack([a, a + low, b + low, c + low], 1)]
            tissue += [np.full(3 * len(above), t)]
        self.tets, self.tissue = np.concatenate(tets), np.concatenate(tissue)
        bounds = finger.bounds(q)
        self.places = np.concatenate([(1 - f) * bounds[t] + f * bounds[t + 1] for t, f in levels])
        self.turn()
        self.edges = np.unique(np.sort(self.tets[:, EDGES].reshape(-1, 2), 1), axis=0)
        self.middles = middles(finger, q, levels, self.edges)
        self.faces = self.named(finger, q, count, len(levels) - 1)
        self.faces["interface"] = above + [t for t, _ in levels].index(1) * count

    def turn(self) -> None:
        first, second, third = (self.places[self.tets[:, k]] - self.places[self.tets[:, 3]] for k in range(3))
        turned = (np.cross(first, second) * third).sum(1) < 0
        self.tets[turned] = self.tets[turned][:, [1, 0, 2, 3]]

    def named(self, finger: Finger, q, count: int, last: int) -> dict:
        sides = np.sort(self.tets[:, SIDES].reshape(-1, 3), 1)
        sides, times = np.unique(sides, axis=0, return_counts=True)
        outer = sides[times == 1]
        level = outer // count
        top = (level == 0).all(1)
        nail = np.zeros(len(outer), bool)
        nail[top] = finger.under_nail(finger.skin(q))[outer[top]].all(1)
        # A skin with an offset is not square to the base, so that layers below it leave the base's plane.
        x, y, _ = np.moveaxis(q[outer % count], 2, 0)
        base = (x == 1).all(1)
        is_of = {"nail": nail, "skin": top & ~nail, "bone": (level == last).all(1), "base": base}
        rest = ~np.any(list(is_of.values()), axis=0)
        if rest.any() and not (finger.symmetric and (y[rest] == 0).all()):
            raise ValueError("faces of the mesh lie neither on the finger's surface nor in its plane of symmetry")
        return {**{name: outer[own] for name, own in is_of.items()}, "middle": outer[rest]}


def middles(finger: Finger, q, levels, edges):
    """Where the finger has the middles of edges; both ends lie on levels of one tissue."""
    count = len(q)
    on = snapped((q[edges[:, 0] % count] + q[edges[:, 1] % count]) / 2)
    bounds = finger.bounds(on)
    tissues, parts = (np.array(of) for of in zip(*levels, strict=True))
    upper, lower = edges.min(1) // count, edges.max(1) // count
    t = tissues[upper]
    end = np.where(tissues[lower] > t, 1.0, parts[lower])
    part = ((parts[upper] + end) / 2)[:, None]
    every = np.arange(len(edges))
    return (1 - part) * bounds[t, every] + part * bounds[t + 1, every]
