"""Poses of engines: each against numbers written by hand, and against matrices."""

from types import SimpleNamespace as Message

import numpy as np
import pytest

from papilla import frames

FINGER = [0.1, -0.2, 0.9, 0.2, -0.4, 0.4, 0.8]
OBJECT = [0.12, -0.21, 0.88, 0.1, -0.1, 0.7, 0.7]
HALF = np.sqrt(0.5)


def matrix(pose):
    x, y, z, a, b, c, d = pose
    m = np.eye(4)
    m[:3, :3] = [
        [1 - 2 * (b * b + c * c), 2 * (a * b - c * d), 2 * (a * c + b * d)],
        [2 * (a * b + c * d), 1 - 2 * (a * a + c * c), 2 * (b * c - a * d)],
        [2 * (a * c - b * d), 2 * (b * c + a * d), 1 - 2 * (a * a + b * b)],
    ]
    m[:3, 3] = x, y, z
    return m


def same(found, due):
    found, due = np.atleast_2d(found)[0], np.atleast_2d(due)[0]
    np.testing.assert_allclose(found[:3], due[:3], atol=1e-3)
    assert abs(found[3:] @ due[3:]) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(
    ("convention", "finger", "ball", "due"),
    [
        # Ahead, level, nail up; the ball 11.25 mm behind its end, 2 to the right, 8 below.
        (frames.UNITY, [0, 1, 0, 0, 0, 0, 1], [0.002, 0.992, -0.01125, 0, 0, 0, 1], [11.25, 2, -8]),
        (frames.OPENXR, [0, 1, 0, 0, 0, 0, 1], [0.002, 0.992, 0.01125, 0, 0, 0, 1], [11.25, 2, -8]),
        (frames.UNREAL, [0, 0, 100, 0, 0, 0, 1], [-1.125, 0.2, 99.2, 0, 0, 0, 1], [11.25, 2, -8]),
        # Turned to the right: its left is ahead of the world's origin.
        (frames.UNITY, [0, 0, 0, 0, HALF, 0, HALF], [0, 0, 0.01, 0, HALF, 0, HALF], [0, -10, 0]),
        (frames.OPENXR, [0, 0, 0, 0, -HALF, 0, HALF], [0, 0, -0.01, 0, -HALF, 0, HALF], [0, -10, 0]),
        (frames.UNREAL, [0, 0, 0, 0, 0, HALF, HALF], [1, 0, 0, 0, 0, HALF, HALF], [0, -10, 0]),
    ],
)
def test_places_are_those_of_the_engines_manuals(convention, finger, ball, due):
    same(frames.from_poses(finger, ball, convention), [*due, 0, 0, 0, 1])


def test_matrices_mujoco_and_ros_say_the_same():
    due = np.linalg.inv(matrix(FINGER)) @ matrix(OBJECT)
    due[:3, 3] *= 1000
    placed = frames.from_poses(FINGER, OBJECT)
    np.testing.assert_allclose(matrix(placed[0].astype(float)), due, atol=2e-4)
    same(frames.from_matrices(matrix(FINGER), [matrix(OBJECT)]), placed)
    w_first = [[*p[:3], p[6], *p[3:6]] for p in (FINGER, OBJECT)]
    same(frames.from_mujoco(*w_first), placed)
    same(frames.from_poses(*w_first, scalar_first=True), placed)
    names = "xyz", "xyzw"
    ros = [
        Message(
            position=Message(**dict(zip(names[0], p[:3], strict=True))),
            orientation=Message(**dict(zip(names[1], p[3:], strict=True))),
        )
        for p in (FINGER, OBJECT)
    ]
    same(frames.from_ros(ros[0], [ros[1]]), placed)


def test_a_finger_drawn_larger_feels_the_same():
    large = [[12 * v for v in p[:3]] + p[3:] for p in (FINGER, OBJECT)]
    same(frames.from_poses(*large, scale=12), frames.from_poses(FINGER, OBJECT))


@pytest.mark.parametrize("up", [(0.0, 1.0, 0.0), (0.0, 0.0, -1.0)])
def test_joints_of_either_hand_make_one_finger(up):
    distal, tip = [0, 1, 0.0225, 0, 0, 0, 1], [0, 1, 0, 0, 0, 0, 1]
    if up[2]:
        # Godot's humanoid skeleton: a joint's +y to the tip, -z out of the nail.
        distal[3:] = [0, -HALF, HALF, 0]
    same(frames.finger_of_joints(distal, tip, up=up), tip)
    same(frames.finger_of_joints(distal, tip, up=up, inside_mm=2.5), [0, 1, -0.0025, 0, 0, 0, 1])


@pytest.mark.parametrize(
    ("finger", "word"),
    [
        ([0, 0, 0, 0, 0, 0, 0], "zero"),
        ([0, np.nan, 0, 0, 0, 0, 1], "finite"),
        ([0, 0, 0, 1], "seven"),
    ],
)
def test_what_is_no_pose_is_refused(finger, word):
    with pytest.raises(ValueError, match=word):
        frames.from_poses(finger, OBJECT)
    with pytest.raises(ValueError, match=word):
        frames.from_poses(OBJECT, finger)


def test_what_is_no_rotation_is_refused():
    for wrong, word in ((np.diag([1, -1, 1, 1]), "mirrors"), (np.diag([2, 2, 2, 1]), "scales")):
        with pytest.raises(ValueError, match=word):
            frames.from_matrices(wrong, np.eye(4))
    with pytest.raises(ValueError, match="transposed"):
        frames.from_matrices(matrix(FINGER).T, np.eye(4))
    with pytest.raises(ValueError, match="scale"):
        frames.from_poses(FINGER, OBJECT, scale=0)
    with pytest.raises(ValueError, match="same place"):
        frames.finger_of_joints(FINGER, FINGER)
    with pytest.raises(ValueError, match="along"):
        frames.finger_of_joints([0, 0, 0.02, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1], up=(0.0, 0.0, 1.0))


@pytest.mark.parametrize("convention", [frames.METRES, frames.OPENXR, frames.GODOT, frames.UNITY, frames.UNREAL])
def test_what_is_drawn_is_what_is_felt(convention):
    mm = np.array([[11.25, 2.0, -6.5], [0.0, 1.0, 3.0]])
    np.testing.assert_allclose(frames.vertices_mm(frames.vertices_drawn(mm, convention), convention), mm)
    # A vertex of the drawn finger is where an object would be placed.
    at = frames.vertices_drawn(mm, convention)[0]
    same(frames.from_poses([0, 0, 0, 0, 0, 0, 1], [*at, 0, 0, 0, 1], convention), [*mm[0], 0, 0, 0, 1])
