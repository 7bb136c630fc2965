"""A ball that MuJoCo moves: force every millisecond, and every hundredth of a second what the skin feels of it.

A ball of 50 g comes down on an upturned fingertip, and a guide then moves it along the finger, to and fro. Each step
of 1 ms the contact's force, as Papilla finds it, acts on the ball. Every tenth step a network makes a map of strain
energy density (SED) from the pressure, and MuJoCo's own tactile sensor, of a model in which the ball is at the same
place, tells how deep the vertices of the skin at rest lie in it.

    pip install mujoco matplotlib
    python mujoco_move.py [--method pixels] [--seconds 1.2] [--picture move.png]

The contact has no friction. It is elastic and has no damping of its own, so the ball moves up and down in a thick
medium (4 N s/m).
"""

import argparse
import json

import numpy as np
from mujoco_hold import WEIGHT_N, Fingertip, apply, world
from mujoco_tactile import RADIUS_MM, Sensor

import papilla
from papilla import frames

BALL = {"shape": {"shape": "sphere", "radius_mm": RADIUS_MM}}
# Steps of the engine between two maps.
EVERY = 10
# It falls and yields freely; along the finger a guide holds it, as a spring and a damper, and moves it from a time on.
JOINTS = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1" damping="4"/>'
GUIDE_N_PER_M, GUIDE_N_S_PER_M = 2000.0, 20.0
MOVES_FROM_S, STROKE_M, PERIOD_S = 0.4, 3e-3, 0.8


def move(method, seconds):
    """What each step found: time (s), the ball's centre (m), force on it (N). And of every tenth step: time, maps of
    pressure and SED, and the depth at each vertex (m)."""
    finger, network = papilla.Finger(method=method), papilla.Model()
    sensor = Sensor(finger.atlas())
    tip = Fingertip(finger, [[1, 0, 0], [0, -1, 0], [0, 0, -1]], [0, 0, 0])
    model, data = world(JOINTS, "sphere", str(1e-3 * RADIUS_MM))
    data.qpos[:] = [0, 1e-3 * RADIUS_MM]
    steps, felt = [], []
    for step in range(round(seconds / model.opt.timestep)):
        at_m = np.array([data.qpos[0], 0.0, data.qpos[1]])
        pose = np.array([*at_m, 0, 0, 0, 1])
        force_n, _, touched = tip.push(BALL, pose, at_m)
        if step % EVERY == 0:
            centre_mm = frames.from_poses(tip.pose, pose[None])[0][:3]
            sed = network.sed(touched.pressure_pa)
            felt.append((data.time, touched.pressure_pa.copy(), sed, sensor.depth_m(centre_mm)))
        steps.append([data.time, *at_m, *force_n, int(touched.flag_bits)])
        moves_s = max(0.0, data.time - MOVES_FROM_S)
        due_m = STROKE_M * np.sin(2 * np.pi * moves_s / PERIOD_S)
        data.qfrc_applied[0] = GUIDE_N_PER_M * (due_m - at_m[0]) - GUIDE_N_S_PER_M * data.qvel[0]
        apply(model, data, [(force_n, np.zeros(3), touched)])
    return np.array(steps), felt


def figures(steps, felt):
    """What came of it."""
    before = steps[(steps[:, 0] > MOVES_FROM_S - 0.05) & (steps[:, 0] <= MOVES_FROM_S)]
    times_s, pressure, sed, depth_m = zip(*felt, strict=True)
    return {
        "rest_n": float(before[:, 6].mean()),
        "weight_n": WEIGHT_N,
        "stroke_mm": float(1e3 * np.ptp(steps[:, 1])),
        "maps": len(times_s),
        "pressure_max_kpa": float(1e-3 * max(p.max() for p in pressure)),
        "sed_max_j_per_m3": float(max(s.max() for s in sed)),
        "mujoco_depth_max_mm": float(1e3 * max(d.max() for d in depth_m)),
        # The flag of value 2 says that nothing touches.
        "flagged": int((steps[:, 7].astype(int) & ~0b10 != 0).sum()),
    }


def picture(path, atlas, steps, felt):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    times_s = np.array([found[0] for found in felt])
    # At rest, and at both ends of the stroke.
    shown = [felt[np.abs(times_s - MOVES_FROM_S - share * PERIOD_S).argmin()] for share in (0.0, 0.25, 0.75)]
    x, y, z = atlas.positions_mm.T
    below = atlas.triangles[(z[atlas.triangles] < -1).all(axis=1)]
    drawn, axes = pyplot.subplots(3, 4, figsize=(12, 8), layout="constrained")
    most = [max(found[k].max() for found in shown) for k in (1, 2, 3)]
    for column, (time_s, pressure, sed, depth_m) in enumerate(shown):
        sides = (axes[0][column], axes[1][column], axes[2][column])
        # The fingertip is above, as on the maps.
        first = sides[0].tripcolor(y, -x, below, 1e3 * depth_m, shading="gouraud", vmin=0, vmax=1e3 * most[2])
        sides[0].set(xlim=(-8, 8), ylim=(-21, -2), aspect="equal", title=f"at {time_s:.2f} s")
        second = sides[1].imshow(1e-3 * pressure[30:190, 40:180], cmap="magma", vmin=0, vmax=1e-3 * most[0])
        third = sides[2].imshow(sed[30:190, 40:180], vmin=0, vmax=most[1])
        for axis in sides:
            axis.set(xticks=[], yticks=[])
    labels = ("MuJoCo: depth, mm", "Papilla: pressure, kPa", "Papilla: SED, J/m³")
    for row, (image, label) in enumerate(zip((first, second, third), labels, strict=True)):
        drawn.colorbar(image, ax=axes[row][:3], label=label, shrink=0.9)
    plots = (("force on the ball, N", 6, 1.0), ("along the finger, mm", 1, 1e3), ("height, mm", 3, 1e3))
    for axis, (label, which, scale) in zip(axes[:, 3], plots, strict=True):
        axis.plot(steps[:, 0], scale * steps[:, which], lw=1)
        axis.set(xlabel="time, s", title=label)
    drawn.savefig(path, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", default="pixels")
    parser.add_argument("--seconds", type=float, default=1.2)
    parser.add_argument("--picture", metavar="FILE", help="written with matplotlib")
    asked = parser.parse_args()
    steps, felt = move(asked.method, asked.seconds)
    if asked.picture:
        picture(asked.picture, papilla.Finger().atlas(), steps, felt)
    print(json.dumps(figures(steps, felt), indent=1))


if __name__ == "__main__":
    main()
