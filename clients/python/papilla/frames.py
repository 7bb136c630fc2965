"""Poses of engines and robots to poses in the finger's frame, and forces back.

docs/reference/frames-and-units.md has the picture. The finger's frame: its origin is the foremost point of
the skin, x runs back along the finger, y to the right as the finger points ahead with the nail up, z out of
the nail; mm, right-handed. A pose is seven numbers, x y z and a quaternion x y z w.

    finger = frames.finger_of_joints(distal, tip, frames.UNITY)
    answer = session.touch(frames.from_poses(finger, objects, frames.UNITY))
    felt = frames.felt(finger, answer.touch, frames.UNITY)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answer import Touch

Numbers = NDArray[np.float64]


class Convention(NamedTuple):
    """An engine's axes and its unit of length."""

    name: str
    rows: tuple[tuple[int, int, int], ...]
    """The matrix from the engine's axes to those of the finger's frame, and from an object's to its shape's."""
    unit_mm: float
    """mm in a unit of length."""

    @property
    def matrix(self) -> Numbers:
        return np.array(self.rows, np.float64)

    @property
    def handed(self) -> float:
        """1: right-handed; -1: left-handed."""
        return float(np.sign(np.linalg.det(self.matrix)))


METRES = Convention("metres", ((1, 0, 0), (0, 1, 0), (0, 0, 1)), 1000.0)
"""The finger's own axes in metres: MuJoCo, ROS and all else where you say how a body's axes lie."""
MILLIMETRES = Convention("millimetres", METRES.rows, 1.0)
OPENXR = Convention("OpenXR", ((0, 0, 1), (1, 0, 0), (0, 1, 0)), 1000.0)
"""x right, y up, -z ahead, to the fingertip: OpenXR, WebXR, three.js."""
GODOT = OPENXR._replace(name="Godot")
UNITY = Convention("Unity", ((0, 0, -1), (1, 0, 0), (0, 1, 0)), 1000.0)
"""Left-handed: x right, y up, z ahead."""
UNREAL = Convention("Unreal", ((-1, 0, 0), (0, 1, 0), (0, 0, 1)), 10.0)
"""Left-handed, cm: x ahead, y right, z up."""


class Felt(NamedTuple):
    """What pushes back on the finger, in the engine's world. An object feels the opposite."""

    force_n: Numbers
    torque_n_m: Numbers
    """About the finger's origin; in a left-handed world by the left hand's rule, as its engine wants it."""
    centre: Numbers
    """Of the pressure, in the engine's unit of length."""


def from_poses(
    finger: ArrayLike,
    objects: ArrayLike,
    convention: Convention = METRES,
    *,
    scalar_first: bool = False,
    scale: float = 1.0,
) -> NDArray[np.float32]:
    """Rows for `Session.touch`: where each object is in the finger's frame, mm, and its turn x y z w.

    `finger` is a pose in the engine's world, `objects` a row for each object of the hello. `scalar_first`:
    quaternions are w x y z, as MuJoCo has them. `scale`: how many times as large as life all is drawn.
    Raises ValueError where a number is not finite or a quaternion is zero.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise ValueError(f"scale is {scale}; it says how many times as large as life all is drawn, 1 for as large")
    (at, turn), *_ = _read("finger", finger, scalar_first)
    rows = [_relative(at, turn, *body, convention, scale) for body in _read("objects", objects, scalar_first)]
    return np.array(rows, np.float32)


def from_mujoco(finger: ArrayLike, objects: ArrayLike, *, scale: float = 1.0) -> NDArray[np.float32]:
    """Of MuJoCo's poses: x y z in metres, then the quaternion w x y z, as `xpos` and `xquat` hold them."""
    return from_poses(finger, objects, METRES, scalar_first=True, scale=scale)


def from_ros(finger: Any, objects: list[Any], *, scale: float = 1.0) -> NDArray[np.float32]:
    """Of `geometry_msgs/Pose` messages, all in one frame (metres, x y z w)."""

    def seven(pose: Any) -> list[float]:
        at, turn = pose.position, pose.orientation
        return [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]

    return from_poses(seven(finger), [seven(pose) for pose in objects], METRES, scale=scale)


def from_matrices(
    finger: ArrayLike, objects: ArrayLike, convention: Convention = METRES, *, scale: float = 1.0
) -> NDArray[np.float32]:
    """Of 4 x 4 matrices that take a body's coordinates to the world's (column vectors).

    Raises ValueError for what is no rotation and shift: a mirrored, scaled or transposed one.
    """
    bodies = [seven_of(matrix) for matrix in np.asarray(objects, np.float64).reshape(-1, 4, 4)]
    return from_poses(seven_of(finger), bodies, convention, scale=scale)


def seven_of(matrix: ArrayLike) -> Numbers:
    """The pose of seven numbers of a 4 x 4 matrix."""
    m = np.asarray(matrix, np.float64)
    if m.shape != (4, 4) or not np.isfinite(m).all():
        raise ValueError("a matrix of 4 x 4 finite numbers is due")
    if not np.allclose(m[3], (0, 0, 0, 1), atol=1e-6):
        raise ValueError("the last row is not 0 0 0 1; give the transposed matrix if it holds the place")
    r = m[:3, :3]
    if not np.allclose(r @ r.T, np.eye(3), atol=1e-3):
        raise ValueError("the matrix scales or shears; take the scale out of it")
    if np.linalg.det(r) < 0:
        raise ValueError("the matrix mirrors; name the engine's convention in place of mirroring an axis")
    # The four ways to read the quaternion; the one with the largest member is the exact one.
    d = np.diag(r)
    squares = np.array([1 + d[0] - d[1] - d[2], 1 - d[0] + d[1] - d[2], 1 - d[0] - d[1] + d[2], 1 + d.sum()])
    sums, differences = r + r.T, r - r.T
    ways = np.array(
        [
            [squares[0], sums[0, 1], sums[0, 2], differences[2, 1]],
            [sums[0, 1], squares[1], sums[1, 2], differences[0, 2]],
            [sums[0, 2], sums[1, 2], squares[2], differences[1, 0]],
            [differences[2, 1], differences[0, 2], differences[1, 0], squares[3]],
        ]
    )
    way = ways[int(np.argmax(squares))]
    return np.concatenate([m[:3, 3], way / np.linalg.norm(way)])


def finger_of_joints(
    distal: ArrayLike,
    tip: ArrayLike,
    convention: Convention = OPENXR,
    *,
    up: tuple[float, float, float] | None = None,
    inside_mm: float = 0.0,
    scalar_first: bool = False,
) -> Numbers:
    """The finger's pose in the engine's world, of two tracked joints: that of the distal phalanx and the tip.

    The finger points from the one to the other, its nail the way of the distal joint's `up` (an axis of
    the joint; the engine's own by default, which is OpenXR's +y out of the nail). The tip's joint is the
    frame's origin, or lies `inside_mm` behind it. Left and right hands are the same: the model's finger
    is symmetric.
    """
    ((behind, turn), (ahead, _)) = (_read(n, p, scalar_first)[0] for n, p in (("distal", distal), ("tip", tip)))
    axes = convention.matrix
    # In the engine's axes: back, and out of the nail.
    back = behind - ahead
    length = np.linalg.norm(back)
    if length * convention.unit_mm < 1.0:
        raise ValueError("distal and tip are the same place; the joints are those of OpenXR's distal and tip")
    back /= length
    nail = _turned(turn, axes[2] if up is None else np.asarray(up, np.float64))
    nail -= back * (nail @ back)
    size = np.linalg.norm(nail)
    if size < 1e-3:
        raise ValueError("up points along the finger; it is the joint's axis that points out of the nail")
    nail /= size
    # Its columns are where the engine's axes of the finger point.
    lateral = convention.handed * np.cross(nail, back)
    turned = np.column_stack([back, lateral, nail]) @ axes
    matrix = np.eye(4)
    matrix[:3, :3] = turned
    return np.concatenate([ahead - back * inside_mm / convention.unit_mm, seven_of(matrix)[3:]])


def felt(
    finger: ArrayLike,
    touch: Touch,
    convention: Convention = METRES,
    *,
    scalar_first: bool = False,
    scale: float = 1.0,
) -> Felt:
    """What pushes back on the finger, in the engine's world: force, torque, where."""
    (at, turn), *_ = _read("finger", finger, scalar_first)
    back = convention.matrix.T

    def out(vector: ArrayLike) -> Numbers:
        return _turned(turn, back @ np.asarray(vector, np.float64))

    centre = at + out(touch.centre_mm) * scale / convention.unit_mm
    return Felt(out(touch.force_n), convention.handed * 1e-3 * out(touch.torque_n_mm), centre)


def vertices_mm(points: ArrayLike, convention: Convention) -> Numbers:
    """Vertices of an object's mesh, in its own axes in the engine, for the `vertices_mm` of a hello.

    Triangles of Unity and Godot are clockwise seen from outside: turn them (`triangles[:, ::-1]`).
    """
    return np.asarray(points, np.float64) @ convention.matrix.T * convention.unit_mm


def vertices_drawn(points_mm: ArrayLike, convention: Convention) -> Numbers:
    """Places of the finger's frame (`Atlas.positions_mm`) in the drawn finger's own axes; see `vertices_mm`."""
    return np.asarray(points_mm, np.float64) @ convention.matrix / convention.unit_mm


def _read(what: str, poses: ArrayLike, scalar_first: bool) -> list[tuple[Numbers, Numbers]]:
    """Places and unit quaternions."""
    rows = np.atleast_2d(np.asarray(poses, np.float64))
    if rows.ndim != 2 or rows.shape[1] != 7:
        raise ValueError(f"{what}: x y z and a quaternion are due, seven numbers; there are {rows.shape[-1]}")
    if not np.isfinite(rows).all():
        raise ValueError(f"{what}: a number is not finite; while the hand is not tracked call send_not_tracked")
    read = []
    for row in rows:
        turn = np.roll(row[3:], -1) if scalar_first else row[3:]
        size = np.linalg.norm(turn)
        if size < 1e-6:
            raise ValueError(f"{what}: a quaternion is zero; while the hand is not tracked call send_not_tracked")
        read.append((row[:3], turn / size))
    return read


def _times(a: Numbers, b: Numbers) -> Numbers:
    """Hamilton's product of x y z w."""
    return np.concatenate([a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3]), [a[3] * b[3] - a[:3] @ b[:3]]])


def _turned(turn: Numbers, v: Numbers) -> Numbers:
    doubled = 2 * np.cross(turn[:3], v)
    turned: Numbers = v + turn[3] * doubled + np.cross(turn[:3], doubled)
    return turned


def _relative(
    at: Numbers, turn: Numbers, other_at: Numbers, other_turn: Numbers, convention: Convention, scale: float
) -> Numbers:
    back = turn * (-1, -1, -1, 1)
    place = convention.matrix @ _turned(back, other_at - at) * convention.unit_mm / scale
    own = _times(back, other_turn)
    # A turn's axis is mirrored with the axes, and its sense once more.
    axis = convention.handed * (convention.matrix @ own[:3])
    return np.concatenate([place, axis, own[3:]])
