"""A rigid ball pressed into tetrahedra that do not lock, by NGSolve.

Displacement is quadratic, and pressure linear (Taylor and Hood), continuous within each tissue. The energy is
that of docs/concepts/physics.md, with pressure p as an unknown of its own:

    mu / 2 (J^(-2/3) I1 - 3) + p (J - 1) - p^2 / 2 K

A penalty keeps the skin out of the ball. NGSolve derives forces and stiffness from this energy, and Newton's
method solves them.
"""

import sys

import netgen.meshing as netgen
import ngsolve as ngs
import numpy as np
import pypardiso
from scipy import sparse

from witness.mesh import SIDES, TISSUES, Mesh

# Penalties, MPa/mm, each of which starts where the one before ended. With the last of them a pressure of
# 0.02 MPa leaves 0.1 um of the skin in the ball.
PENALTIES = (0.05, 0.2, 1.0, 5.0, 30.0, 200.0)
NEWTON_MAX = 40
# Largest step of Newton's method that ends it, as a part of the depth; that before the last penalty.
ENOUGH, ENOUGH_BEFORE = 1e-4, 0.15
# Points of a face, in its barycentric coordinates, of equal weight.
POINTS = np.array([[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])


def solid(mesh: Mesh):
    """The mesh for NGSolve, with quadratic edges."""
    raw = netgen.Mesh(dim=3)
    raw.AddPoints(np.ascontiguousarray(mesh.places))
    for n, (name, faces) in enumerate(mesh.faces.items()):
        raw.Add(netgen.FaceDescriptor(surfnr=n + 1, domin=1, domout=0, bc=n + 1))
        raw.SetBCName(n, name)
        if len(faces):
            raw.AddElements(dim=2, index=n + 1, data=np.ascontiguousarray(faces, dtype=np.int32), base=0)
    for t, tissue in enumerate(TISSUES):
        own = np.ascontiguousarray(mesh.tets[mesh.tissue == t], dtype=np.int32)
        raw.AddElements(dim=3, index=t + 1, data=own, base=0)
        raw.SetMaterial(t + 1, tissue)
    made = ngs.Mesh(raw)
    space = ngs.VectorH1(made, order=2)
    scalar = space.components[0]
    # What a function of an edge is in its middle: by a function whose middles are known.
    square = ngs.GridFunction(scalar)
    square.Set(ngs.x**2)
    ends = np.array([[v.nr for v in edge.vertices] for edge in made.edges])
    dof = np.array([scalar.GetDofNrs(ngs.NodeId(ngs.EDGE, k))[0] for k in range(len(ends))])
    a, b = mesh.places[ends[:, 0]], mesh.places[ends[:, 1]]
    k = np.abs(a[:, 0] - b[:, 0]).argmax()
    height = -((a[k, 0] - b[k, 0]) ** 2) / 4 / square.vec[int(dof[k])]
    number = {tuple(edge): n for n, edge in enumerate(mesh.edges.tolist())}
    order = [number[tuple(sorted(edge))] for edge in ends.tolist()]
    moved = (mesh.middles[order] - (a + b) / 2) / height
    bend = ngs.GridFunction(space)
    for axis in range(3):
        bend.components[axis].vec.FV().NumPy()[dof] = moved[:, axis]
    made.SetDeformation(bend)
    return made


class Body:
    """Unknowns and energy on a mesh of NGSolve; `laws` are mu and K of each tissue, MPa."""

    def __init__(self, made, laws: dict, mixed: bool) -> None:
        rigid = "bone|nail"
        held = {"dirichletx": f"{rigid}|base", "dirichlety": f"{rigid}|middle", "dirichletz": rigid}
        spaces = [ngs.VectorH1(made, order=2, **held)]
        if mixed:
            spaces += [ngs.Compress(ngs.H1(made, order=1, definedon=made.Materials(t))) for t in TISSUES]
        self.made, self.laws, self.mixed = made, laws, mixed
        self.space = ngs.FESpace(spaces) if mixed else spaces[0]
        self.now = ngs.GridFunction(self.space)
        self.centre = [ngs.Parameter(0.0) for _ in range(3)]
        self.radius, self.penalty = ngs.Parameter(1.0), ngs.Parameter(1.0)
        u, pressures = self.split(self.space.TrialFunction())
        self.contact = ngs.BilinearForm(self.space, symmetric=True)
        self.contact += ngs.Variation(self.pressed(u) * ngs.ds("skin", bonus_intorder=2))
        self.whole = ngs.BilinearForm(self.space, symmetric=True)
        self.whole += ngs.Variation(self.pressed(u) * ngs.ds("skin", bonus_intorder=2))
        for tissue, p in zip(TISSUES, pressures, strict=True):
            energy = self.energy(tissue, ngs.Grad(u), p)
            self.whole += ngs.Variation(energy.Compile() * ngs.dx(tissue, bonus_intorder=1))

    def split(self, of):
        """Displacement, and the pressure of each tissue."""
        if not self.mixed:
            return of, [None] * len(TISSUES)
        of = of.components if isinstance(of, ngs.GridFunction) else of
        return of[0], of[1:]

    def split_spaces(self):
        return self.space.components if self.mixed else [self.space]

    def energy(self, tissue: str, gradient, p):
        """Per undeformed volume, MPa."""
        mu, bulk = self.laws[tissue]
        f = gradient + ngs.Id(3)
        j = ngs.Det(f)
        shear = mu / 2 * (j ** (-2 / 3) * ngs.InnerProduct(f, f) - 3)
        return shear + (bulk / 2 * (j - 1) ** 2 if p is None else p * (j - 1) - p * p / (2 * bulk))

    def pressed(self, u):
        """Energy of the penalty per area."""
        away = ngs.CF((ngs.x, ngs.y, ngs.z)) + u - ngs.CF(tuple(self.centre))
        deep = self.radius - ngs.Norm(away)
        return ngs.IfPos(deep, self.penalty / 2 * deep * deep, 0)

    def place(self, centre, radius: float) -> None:
        for parameter, value in zip(self.centre, centre, strict=True):
            parameter.Set(float(value))
        self.radius.Set(radius)

    def solve(self, depth_mm: float, enough: float) -> int:
        """Equilibrium; the number of iterations."""
        rest = self.now.vec.CreateVector()
        values, now = rest.FV().NumPy(), self.now.vec.FV().NumPy()
        of_u = self.split_spaces()[0].ndof
        for iteration in range(1, NEWTON_MAX + 1):
            self.whole.Apply(self.now.vec, rest)
            self.whole.AssembleLinearization(self.now.vec)
            step = self.step(values)
            size = np.abs(step[:of_u]).max() / depth_mm
            # A step of many times the depth leaves Newton's reach.
            damping = min(1.0, 2.0 / size)
            before = now.copy()
            while True:
                now[:] = before - damping * step
                if self.least_volume() > 0.1:
                    break
                damping *= 0.5
            print(f"    {iteration}: step {size:.2e}, damping {damping:.2f}", file=sys.stderr, flush=True)
            if size < enough:
                return iteration
        sys.exit(f"Newton's method found no equilibrium at {depth_mm:.2f} mm")

    def step(self, rest):
        """What Newton's method takes away from the unknowns."""
        entries, columns, starts = self.whole.mat.CSR()
        matrix = sparse.csr_array((entries, columns, starts), shape=(len(rest), len(rest)))
        own = np.flatnonzero(np.array(self.space.FreeDofs()) & (np.diff(matrix.indptr) > 0))
        upper = sparse.triu(matrix[own][:, own], format="csr")
        # Quasi-definite, so there is no need of pivots; positive definite without pressure.
        solver = pypardiso.PyPardisoSolver(mtype=-2 if self.mixed else 2)
        step = np.zeros(len(rest))
        step[own] = solver.solve(sparse.csr_matrix(upper), rest[own])
        solver.free_memory(everything=True)
        return step

    def least_volume(self) -> float:
        u, _ = self.split(self.now)
        points = self.made.MapToAllElements(ngs.IntegrationRule(ngs.TET, 3), ngs.VOL)
        return float(ngs.Det(ngs.Grad(u) + ngs.Id(3))(points).min())

    def force(self):
        """On the skin, N: what the contact's forces do along each axis."""
        rest = self.now.vec.CreateVector()
        self.contact.Apply(self.now.vec, rest)
        values, u = rest.FV().NumPy(), self.split_spaces()[0]
        return -np.array([values[u.components[axis].ndof * axis :][: self.made.nv].sum() for axis in range(3)])

    def sed(self, faces, tets, tissue: str):
        """SED of a tissue, J/m3, at POINTS of its elements' sides that are among some faces: places, values, and
        which elements and sides these are."""
        whole = {tuple(face) for face in np.sort(faces, 1).tolist()}
        u, pressures = self.split(self.now)
        mu, bulk = self.laws[tissue]
        f = ngs.Grad(u) + ngs.Id(3)
        j = ngs.Det(f)
        p = pressures[TISSUES.index(tissue)]
        volume = bulk / 2 * (j - 1) ** 2 if p is None else p * p / (2 * bulk)
        value = mu / 2 * (j ** (-2 / 3) * ngs.InnerProduct(f, f) - 3) + volume
        wanted = ngs.CF((ngs.x, ngs.y, ngs.z, value))
        # Points on all four sides of the reference element, whose fourth corner is 0.
        corner = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], float)
        points = np.concatenate([POINTS @ corner[list(side)] for side in SIDES])
        rule = ngs.IntegrationRule([tuple(point) for point in points.tolist()], [1.0] * len(points))
        found = wanted(self.made.MapToAllElements(rule, self.made.Materials(tissue)))
        found = np.asarray(found).reshape(len(tets), len(SIDES), len(POINTS), 4)
        sides = np.sort(tets[:, SIDES], 2).tolist()
        on = np.array([[tuple(side) in whole for side in own] for own in sides])
        return found[on][..., :3], 1e6 * found[on][..., 3], np.argwhere(on)


def press(mesh: Mesh, laws: dict, centre, ball_mm: float, depth_mm: float, mixed: bool) -> dict:
    """A ball comes from below, from a centre where it touches first: force, and SED at the interface, of the dermis."""
    ngs.ngsglobals.msg_level = 0
    made = solid(mesh)
    volumes = {t: ngs.Integrate(ngs.CF(1), made, definedon=made.Materials(t)) for t in TISSUES}
    body = Body(made, laws, mixed)
    body.place(centre + [0, 0, depth_mm], ball_mm)
    iterations = []
    for penalty in PENALTIES:
        body.penalty.Set(penalty)
        iterations.append(body.solve(depth_mm, ENOUGH if penalty == PENALTIES[-1] else ENOUGH_BEFORE))
    places, sed, on = body.sed(mesh.faces["interface"], mesh.tets[mesh.tissue == 1], "dermis")
    corners = mesh.tets[mesh.tissue == 1][on[:, 0]]
    a, b, c = (mesh.places[corners[np.arange(len(on)), np.array(SIDES)[on[:, 1], k]]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return {
        "force_n": body.force(),
        "places": places.reshape(-1, 3),
        "sed": sed.ravel(),
        "areas": np.repeat(areas / len(POINTS), len(POINTS)),
        "volumes_mm3": volumes,
        "unknowns": int(sum(body.space.FreeDofs())),
        "iterations": iterations,
    }
