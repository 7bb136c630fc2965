"""One press, felt twice: by MuJoCo's own tactile sensor, and by Papilla.

A ball of 10 mm radius stands some tenths of a millimetre inside of a fingertip. MuJoCo has the skin as a mesh, with
its sensor `tactile` at the vertices; Papilla has the same vertices.

    pip install mujoco matplotlib
    python mujoco_tactile.py [--depth-mm 0.8] [--method pixels] [--picture tactile.png]

MuJoCo's sensor tells how deep each vertex lies in the ball, m. Nothing yields: it is geometry. Papilla finds the
pressure, Pa, under which the skin gives way until it lies outside of the ball.
"""

import argparse
import json

import mujoco
import numpy as np

import papilla

RADIUS_MM = 10.0
# The pad's lowest point in the finger's frame, mm.
PAD_MM = np.array([11.25, 0.0, -6.53])


def places_of(depth_mm):
    """Where the ball's centre is, mm."""
    return PAD_MM - [0.0, 0.0, RADIUS_MM - depth_mm]


class Sensor:
    """MuJoCo's tactile sensor at the vertices of the skin, and a ball."""

    def __init__(self, atlas):
        spec = mujoco.MjSpec()
        skin = spec.add_mesh(name="skin")
        skin.uservert, skin.userface = 1e-3 * atlas.positions_mm.ravel(), atlas.triangles.ravel().astype(np.int32)
        # The skin is open where the finger ends: it has no volume.
        skin.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        finger = spec.worldbody.add_body(name="finger")
        finger.add_geom(name="pad", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="skin")
        # Two bodies that stand still do not touch in MuJoCo: the ball is free, and nothing is ever stepped here.
        ball = spec.worldbody.add_body(name="ball")
        ball.add_freejoint()
        ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-3 * RADIUS_MM, 0, 0])
        sensor = spec.add_sensor(name="felt", type=mujoco.mjtSensor.mjSENS_TACTILE)
        sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_MESH, "skin"
        sensor.reftype, sensor.refname = mujoco.mjtObj.mjOBJ_GEOM, "pad"
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)

    def depth_m(self, centre_mm):
        """Depth of each vertex in the ball, whose centre is there in the finger's frame."""
        self.data.qpos[:3] = 1e-3 * np.asarray(centre_mm)
        mujoco.mj_forward(self.model, self.data)
        # Three values a vertex: depth, and speeds of sliding along two tangents.
        return self.data.sensordata.reshape(3, -1)[0].copy()


def by_mujoco(atlas, depth_mm):
    """Depth at each vertex of the skin, m, as the sensor tells it."""
    return Sensor(atlas).depth_m(places_of(depth_mm))


def by_papilla(finger, depth_mm):
    """Pressure at each vertex, Pa, and all else that was found."""
    ball = {"shape": {"shape": "sphere", "radius_mm": RADIUS_MM}}
    return finger.touch(ball, [*places_of(depth_mm), 0, 0, 0, 1])


def areas_mm2(atlas):
    """The share of the skin that belongs to each vertex."""
    a, b, c = (atlas.positions_mm[atlas.triangles[:, k]] for k in range(3))
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
    areas = np.zeros(len(atlas.positions_mm))
    for k in range(3):
        np.add.at(areas, atlas.triangles[:, k], third)
    return areas


def figures(atlas, depth_m, touched):
    areas = areas_mm2(atlas)
    overlap_mm = np.clip(
        RADIUS_MM - np.linalg.norm(atlas.positions_mm - places_of(1e3 * depth_m.max()), axis=1), 0, None
    )
    return {
        "mujoco_depth_max_mm": 1e3 * float(depth_m.max()),
        # Of the sensor's depths from those of the skin at rest in the ball.
        "mujoco_from_geometry_mm": float(np.abs(1e3 * depth_m - overlap_mm).max()),
        "mujoco_area_mm2": float(areas[depth_m > 0].sum()),
        "papilla_area_mm2": float(areas[touched.pressure_pa > 0].sum()),
        "papilla_pressure_max_kpa": 1e-3 * float(touched.pressure_pa.max()),
        "papilla_force_n": float(np.linalg.norm(touched.force_n)),
    }


def picture(path, atlas, depth_m, touched):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    # The pad from below: what faces the ball.
    x, y, z = atlas.positions_mm.T
    below = atlas.triangles[(z[atlas.triangles] < -1).all(axis=1)]
    drawn, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    # Titles and labels keep clear of the picture's edge.
    drawn.get_layout_engine().set(w_pad=0.12, h_pad=0.12)
    for axes, values, title, unit in (
        (left, 1e3 * depth_m, "MuJoCo's tactile sensor", "depth in the ball, mm"),
        (right, 1e-3 * touched.pressure_pa, "Papilla, the same press", "pressure, kPa"),
    ):
        shown = axes.tripcolor(x, y, below, values, shading="gouraud", cmap="viridis")
        drawn.colorbar(shown, ax=axes, label=unit)
        axes.set(title=title, xlabel="along the finger, mm", aspect="equal", xlim=(4, 19), ylim=(-7, 7))
    left.set_ylabel("across, mm")
    drawn.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--depth-mm", type=float, default=0.8)
    parser.add_argument("--method", default="pixels")
    parser.add_argument("--picture", metavar="FILE", help="written with matplotlib")
    asked = parser.parse_args()
    finger = papilla.Finger(method=asked.method, pressure="vertices")
    atlas = finger.atlas()
    depth_m, touched = by_mujoco(atlas, asked.depth_mm), by_papilla(finger, asked.depth_mm)
    if asked.picture:
        picture(asked.picture, atlas, depth_m, touched)
    print(json.dumps(figures(atlas, depth_m, touched), indent=1))


if __name__ == "__main__":
    main()
