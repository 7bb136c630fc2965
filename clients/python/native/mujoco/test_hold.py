"""Friction in the loop with MuJoCo: what rests, what is held, what slips. And its own tactile sensor."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

import papilla

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
METHODS = ("second_order", "coarse_pixels", "pixels")
# The ball rests and the block is held for so long.
LONG_S = 10.0
# The scripts import one another, as they do when they are run.
sys.path.insert(0, str(EXAMPLES))


def loaded(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def example():
    return loaded("mujoco_hold")


@pytest.mark.parametrize("method", METHODS)
def test_what_friction_holds_stays_until_it_is_pulled_too_hard(example, method):
    rested = example.rest(method, LONG_S)
    found = example.figures(rested, example.pinch(method, LONG_S), LONG_S)
    print(method, found)
    # From the second second on the ball has its place.
    settled = rested[rested[:, 0] > 2.0]
    assert abs(settled[0, 1] - settled[-1, 1]) < 1e-5
    assert abs(found["rest_n"] / found["weight_n"] - 1) < 1e-3
    assert found["ripple"] < 5e-3
    assert abs(found["sagged_mm"]) < 0.05 and not found["flagged"]
    assert found["slips_at_share"] == pytest.approx(1.0, abs=0.05)


def test_mujocos_sensor_tells_geometry_and_papilla_pressure():
    example = loaded("mujoco_tactile")
    finger = papilla.Finger(method="pixels", pressure="vertices")
    atlas = finger.atlas()
    found = {}
    for depth_mm in (0.4, 0.8):
        found[depth_mm] = example.figures(
            atlas, example.by_mujoco(atlas, depth_mm), example.by_papilla(finger, depth_mm)
        )
        print(depth_mm, found[depth_mm])
        assert found[depth_mm]["mujoco_depth_max_mm"] == pytest.approx(depth_mm, abs=0.05)
        assert found[depth_mm]["mujoco_from_geometry_mm"] < 0.05
        # The skin gives way, so that it touches on less than what lies in the ball at rest.
        assert 0.0 < found[depth_mm]["papilla_area_mm2"] < found[depth_mm]["mujoco_area_mm2"]
    # Twice as deep: twice the depth, but far more than twice the force.
    assert found[0.8]["papilla_force_n"] > 2.3 * found[0.4]["papilla_force_n"]


def test_what_a_moving_ball_is_felt_by_moves_with_it():
    example = loaded("mujoco_move")
    steps, felt = example.move("pixels", 1.2)
    found = example.figures(steps, felt)
    print(found)
    assert found["rest_n"] == pytest.approx(found["weight_n"], rel=1e-3) and not found["flagged"]
    assert found["stroke_mm"] == pytest.approx(6.0, rel=0.03)
    ball_mm = 1e3 * np.interp([time_s for time_s, *_ in felt], steps[:, 0], steps[:, 1])
    touches = np.array([pressure.any() for _, pressure, _, _ in felt])
    assert touches[5:].all()
    x_mm = papilla.Finger().atlas().positions_mm[:, 0]
    rows = np.arange(224)
    for moved_mm, (_, pressure, sed, depth_m) in list(zip(ball_mm, felt, strict=True))[5:]:
        # By MuJoCo the deepest skin is near the ball, wherever that is; the pad is round.
        assert x_mm[depth_m.argmax()] - 11.25 == pytest.approx(moved_mm, abs=1.5)
        # The contact that Papilla finds lies there too: its pixels are 0.137 mm wide on average.
        where = [float(rows @ image.sum(axis=1) / image.sum()) for image in (pressure, sed)]
        assert 0.137 * abs(where[0] - where[1]) < 2.0 and sed.max() > 50
    ends = [felt[np.abs(ball_mm - moved_mm).argmin()][1] for moved_mm in (-3.0, 3.0)]
    rows_of = [float(rows @ image.sum(axis=1) / image.sum()) for image in ends]
    # The ball rolls over a round pad: of two balls of R and r the contact moves by R / (R + r) of the way.
    assert 2.5 < 0.137 * (rows_of[1] - rows_of[0]) < 5.0
