"""Friction in the loop with MuJoCo: what rests, what is held, what slips."""

import importlib.util
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).resolve().parents[2] / "examples/mujoco_hold.py"
METHODS = [("second_order", 10.0), ("coarse_pixels", 10.0), ("pixels", 1.0)]


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("mujoco_hold", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("method", "hold_s"), METHODS)
def test_what_friction_holds_stays_until_it_is_pulled_too_hard(example, method, hold_s):
    found = example.figures(example.rest(method, 1.2), example.pinch(method, hold_s), hold_s)
    print(method, found)
    assert abs(found["rest_n"] / found["weight_n"] - 1) < 1e-3
    assert found["ripple"] < 5e-3
    assert abs(found["sagged_mm"]) < 0.05 and not found["flagged"]
    assert found["slips_at_share"] == pytest.approx(1.0, abs=0.05)
