"""The gallery: each script runs, finds what it promises, and draws its picture."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture
def example(tmp_path, monkeypatch, url):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setenv("PAPILLA_URL", url)
    monkeypatch.setenv("RUNS", "2")
    monkeypatch.setattr("sys.argv", ["example"])

    def run(name):
        found = runpy.run_path(str(EXAMPLES / f"{name}.py"))
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
        return found

    return run


def test_touch(example):
    forces_n = example("touch")["forces_n"]
    assert forces_n[0] == 0.0 and (np.diff(forces_n) > 0).all() and forces_n[-1] > 0.2


def test_figure4(example):
    found = example("figure4")
    errors = [
        found["error"](predicted, indentation.sed_j_per_m3)
        for predicted, indentation in zip(found["predictions"], found["indentations"], strict=True)
    ]
    assert max(errors) < 0.3


def test_spikes(example):
    trains = example("spikes")["trains"]
    # In each of the ten taps.
    taps = np.histogram(trains.time_us, np.arange(0, 1_100_000, 100_000))[0]
    assert (taps > 20).all() and trains.lost == 0


def test_series(example, tmp_path):
    found = example("series")
    assert (tmp_path / "series.csv").is_file() and (tmp_path / "series.nc").is_file()
    force_n = found["series"].force_n[:, 2]
    assert force_n.max() > 0.02 and force_n[0] == force_n[-1] == 0.0


def test_sensor(example):
    felt = example("sensor")["felt"]
    assert felt.series["summary_force_n"].max() == pytest.approx(0.8, rel=0.1)
    assert 0 < felt.summary()["reproduction_error_max"] < 0.2 and len(felt.series.spikes.unit) > 50


def test_mesh(example):
    force_n = example("mesh")["series"].force_n[:, 2]
    assert (np.diff(force_n) > 0).all() and force_n[-1] > 0.1


def test_hold(example):
    held = example("hold")["held"]
    last = {tissue: series["summary_sed_max_j_per_m3"][-1] for tissue, series in held.items()}
    assert last[None] < last["subcutaneous"] < last["skin"]


def test_tradeoff(example):
    found = example("tradeoff")
    assert {"nano", "small", "small-maps", "large"} <= set(found["names"]) and min(found["times_ms"]) > 0
    of_maps, of_poses = (dict(zip(found["names"], found[of], strict=True)) for of in ("of_maps", "of_poses"))
    # Each errs less from what it learnt than its sibling.
    assert of_maps["small-maps"] < of_maps["small"] and of_poses["small"] < of_poses["small-maps"]
