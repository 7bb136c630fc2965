"""Friction in the loop with a physics engine: MuJoCo moves the objects, Papilla finds what the skin does to them.

A ball of 50 g comes down on an upturned fingertip and rests there. Then two fingertips pinch a block of 50 g,
hold it against its weight, and a growing pull draws it out. Every millisecond the engine tells where the object
is, and the contact's force and torque push back on it. Nothing else holds it: the engine's own contacts are off.

    pip install mujoco matplotlib
    python mujoco_hold.py [--method pixels] [--hold-s 2] [--picture hold.png]

The contact is elastic and has no damping of its own, so the objects move in a thick medium (1 N s/m).
"""

import argparse
import json

import mujoco
import numpy as np

import papilla
from papilla import frames

FRICTION = 0.6
# A block that falls faster than this slips: skin alone gives way by a tenth of it. A block this far down is lost.
SLIPS_M_PER_S = 0.01
LOST_M = -0.006
MASS_KG = 0.05
WEIGHT_N = 9.81 * MASS_KG
# The pad's lowest point in the finger's frame, m.
PAD_M = np.array([11.25e-3, 0.0, -6.53e-3])
BALL = {"shape": {"shape": "sphere", "radius_mm": 10}, "friction": FRICTION}
# 20 mm square and 6 mm thick; its faces are at z = -3 and 3 mm.
BLOCK = {"shape": {"shape": "plate", "size_mm": [20, 20]}, "friction": FRICTION}
WORLD = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="thing">
      {joints}
      <geom type="{geom}" size="{size}" mass="{mass}" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""
# A ball on a round pad rolls off, as it would in life; this one cannot turn.
SLIDES = "".join(f'<joint type="slide" axis="{axis}" damping="1"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
FREE = '<freejoint name="free"/>'


class Fingertip:
    """A finger that stands still in the engine's world."""

    def __init__(self, finger: papilla.Finger, axes, pad_m):
        """`axes`: where the finger's x, y, z point; `pad_m`: where the pad's lowest point is."""
        self.finger, self.turn = finger, np.array(axes, float).T
        self.put(pad_m)

    def put(self, pad_m):
        """Moves it there."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.turn, np.asarray(pad_m) - self.turn @ PAD_M
        self.pose = frames.seven_of(matrix)

    def push(self, thing, pose, at_m):
        """Force on the thing, N, and torque about `at_m`, N m, in the world; and what was found."""
        touched = self.finger.touch(thing, frames.from_poses(self.pose, pose[None])[0])
        felt = frames.felt(self.pose, touched)
        force = -np.asarray(felt.force_n)
        if not force.any():
            return force, force, touched
        # About the finger's origin, and so about the thing.
        torque = -np.asarray(felt.torque_n_m) + np.cross(self.pose[:3] - at_m, force)
        return force, torque, touched


def world(joints, geom, size):
    model = mujoco.MjModel.from_xml_string(WORLD.format(joints=joints, geom=geom, size=size, mass=MASS_KG))
    return model, mujoco.MjData(model)


def apply(model, data, pushes, pull_n=0.0):
    """Sums what the fingers do to the thing, and a pull straight down; one step."""
    data.xfrc_applied[1, :3] = sum(force for force, _, _ in pushes)
    data.xfrc_applied[1, 3:] = sum(torque for _, torque, _ in pushes)
    data.xfrc_applied[1, 2] -= pull_n
    mujoco.mj_step(model, data)


def rest(method, seconds):
    """A ball comes to rest on a finger: time, height (m), and the force that carries it (N)."""
    model, data = world(SLIDES, "sphere", "0.01")
    tip = Fingertip(papilla.Finger(method=method, pressure=None), [[1, 0, 0], [0, -1, 0], [0, 0, -1]], [0, 0, 0])
    data.qpos[:] = [0, 0, 0.01]
    rows = []
    for _ in range(round(seconds / model.opt.timestep)):
        at = data.qpos.copy()
        force, _, touched = tip.push(BALL, np.array([*at, 0, 0, 0, 1]), at)
        apply(model, data, [(force, np.zeros(3), touched)])
        rows.append([data.time, at[2], force[2], int(touched.flag_bits)])
    return np.array(rows)


def pinch(method, seconds, grip_n=1.0, pull_n_per_s=1.0):
    """Two fingers close on a block, hold it, and it is pulled down until it is gone: time, height (m), grip of each
    finger, and all that pulls it down, its weight and the pull (N), and whether anything was flagged."""
    model, data = world(FREE, "box", "0.01 0.01 0.003")
    model.dof_damping[:] = [1, 1, 1, 1e-4, 1e-4, 1e-4]
    model.opt.gravity[:] = 0
    # The block's z points along the world's x, where the fingers are.
    data.qpos[3:] = [np.sqrt(0.5), 0, np.sqrt(0.5), 0]
    tips = [
        Fingertip(papilla.Finger(method=method, pressure=None), axes, [0, 0, 0])
        for axes in ([[0, 1, 0], [0, 0, -1], [-1, 0, 0]], [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    ]
    rows, deep_m, held_s, gripped = [], -1e-4, 0.0, False
    while held_s < seconds + 4.0 and data.qpos[2] > LOST_M:
        if not gripped:
            deep_m += 1e-5
        for tip, side in zip(tips, (-1, 1), strict=True):
            tip.put([side * (0.003 - deep_m), 0, 0])
        at, quaternion = data.qpos[:3].copy(), np.roll(data.qpos[3:7], -1)
        pushes = [tip.push(BLOCK, np.array([*at, *quaternion]), at) for tip in tips]
        grips = [abs(force[0]) for force, _, _ in pushes]
        if gripped:
            held_s += model.opt.timestep
        elif min(grips) > grip_n:
            gripped, model.opt.gravity[2] = True, -9.81
        pull = pull_n_per_s * max(0.0, held_s - seconds)
        apply(model, data, pushes, pull)
        flagged = any(int(touched.flag_bits) & ~0b10 for _, _, touched in pushes)
        down = WEIGHT_N + pull if gripped else 0.0
        rows.append([held_s if gripped else data.time - 10.0, at[2], *grips, down, flagged])
    return np.array(rows)


def figures(rested, pinched, seconds):
    """What came of it."""
    last = rested[rested[:, 0] > rested[-1, 0] - 0.2, 2]
    held = pinched[(pinched[:, 0] > 0.3) & (pinched[:, 0] < seconds)]
    pulled = pinched[pinched[:, 0] > seconds]
    slips = pulled[-np.gradient(pulled[:, 1], pulled[:, 0]) > SLIPS_M_PER_S] if len(pulled) > 1 else pulled
    share = slips[0, 4] / (FRICTION * slips[0, 2:4].sum()) if len(slips) else None
    return {
        "rest_n": last.mean(),
        "weight_n": WEIGHT_N,
        "ripple": np.ptp(last) / last.mean(),
        "grip_n": held[-1, 2:4].mean(),
        "sagged_mm": 1e3 * (held[0, 1] - held[-1, 1]),
        # Weight and pull over the most that friction holds, coefficient times both grips.
        "slips_at_share": share,
        "flagged": int(held[:, 5].sum()),
    }


def picture(path, rested, pinched, seconds):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
    left.plot(rested[:, 0], rested[:, 2], lw=1)
    left.axhline(WEIGHT_N, color="0.5", ls="--", lw=1)
    left.set(title="a ball of 50 g comes to rest", xlabel="time, s", ylabel="force of the skin, N")
    held = pinched[pinched[:, 0] > 0]
    middle.plot(held[:, 0], 1e3 * held[:, 1], lw=1)
    middle.axvline(seconds, color="0.5", ls="--", lw=1)
    middle.set(title="a block is held, then pulled", xlabel="time, s", ylabel="height, mm")
    right.plot(held[:, 4] / (FRICTION * held[:, 2:4].sum(axis=1)), 1e3 * held[:, 1], lw=1)
    right.axvline(1, color="0.5", ls="--", lw=1)
    right.set(title="it slips at Coulomb's bound", xlabel="weight and pull over the bound", ylabel="height, mm")
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", default="pixels")
    parser.add_argument("--rest-s", type=float, default=1.0)
    parser.add_argument("--hold-s", type=float, default=2.0)
    parser.add_argument("--picture", metavar="FILE", help="written with matplotlib")
    asked = parser.parse_args()
    rested, pinched = rest(asked.method, asked.rest_s), pinch(asked.method, asked.hold_s)
    if asked.picture:
        picture(asked.picture, rested, pinched, asked.hold_s)
    print(json.dumps(figures(rested, pinched, asked.hold_s), indent=1))


if __name__ == "__main__":
    main()
