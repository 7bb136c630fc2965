"""The gallery's scripts that need no service run, and find what they promise."""

import runpy
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_finger(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = runpy.run_path(str(EXAMPLES / "finger.py"))["found"]
    assert all((np.diff(force_n) >= 0).all() and force_n[-1] > 0.05 for force_n in found.values())
    assert len((tmp_path / "force.csv").read_text().splitlines()) == 10


def test_own_pressure(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = runpy.run_path(str(EXAMPLES / "own_pressure.py"))
    assert abs(found["state"].force_n[2] - 0.1) < 0.02
    assert found["network"].max() > found["state"].sed_j_per_m3.max() > 0
    assert len(found["trains"].unit) > 10 and (tmp_path / "felt.npz").is_file()
