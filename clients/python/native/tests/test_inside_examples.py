"""The gallery's scripts that need no service run, find what they promise, and draw their pictures."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def example(tmp_path, monkeypatch):
    """Runs a script in its short form; gives its names."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setenv("PAPILLA_URL", "local")

    def run(name, picture=True, **short):
        for variable, value in short.items():
            monkeypatch.setenv(variable, value)
        found = runpy.run_path(str(EXAMPLES / f"{name}.py"))
        if picture:
            assert (tmp_path / f"{name}.png").stat().st_size > 10_000
        return found

    return run


def test_finger(example, tmp_path):
    found = example("finger", picture=False)["found"]
    assert all((np.diff(force_n) >= 0).all() and force_n[-1] > 0.05 for force_n in found.values())
    assert len((tmp_path / "force.csv").read_text().splitlines()) == 10


def test_touch(example):
    forces_n = example("touch")["forces_n"]
    assert forces_n[0] == 0.0 and (np.diff(forces_n) > 0).all() and forces_n[-1] > 0.2


def test_hold(example):
    found = example("hold")
    sed = {tissue: series["summary_sed_max_j_per_m3"] for tissue, series in found["held"].items()}
    # Once the pressure stands, only tissue that relaxes goes on yielding.
    assert np.ptp(sed[None][10:]) < 1e-3 * sed[None][10]
    assert all((np.diff(sed[tissue][10:]) >= 0).all() for tissue in ("skin", "subcutaneous"))
    assert found["share"] > 5 and 1e4 < found["press"].max() < 1e5


def test_spikes(example):
    trains = example("spikes")["trains"]
    taps = np.histogram(trains.time_us, np.arange(0, 1_100_000, 100_000))[0]
    assert (taps > 20).all() and trains.lost == 0


def test_own_pressure(example, tmp_path):
    found = example("own_pressure")
    assert abs(found["state"].force_n[2] - 0.1) < 0.02
    assert found["array"].reproduction(found["readings"], found["pressure_pa"]).max() < 0.02
    assert 0.5 < found["network"].max() / found["state"].sed_j_per_m3.max() < 2.0
    assert len(found["trains"].unit) > 10 and (tmp_path / "felt.npz").is_file()


def test_effect_worth(example):
    found = {effect.name: effect for effect in example("effect_worth")["found"]}
    assert found["layers"].sed_change > 0.05 and found["finite_strain"].sed_change > 0.05
    assert all(effect.why_not is None and effect.seconds_without > 0 for effect in found.values())


def test_hard_case(example):
    found = example("hard_case")
    assert found["failed"].kind == "no_equilibrium" and found["refused"].field == "indenter.radius_mm"
    assert len(found["found"]) == found["failed"].states > 5 and (np.diff(found["forces_n"]) > 0).all()


def test_campaign(example):
    found = example("campaign", PRESSES="2")
    states = found["states"]
    assert len(found["dataset"]) == 8 and states["sed_dermis_j_per_m3"].shape == (8, 224, 224)
    assert (np.diff(states["force_n"][:4, 2]) > 0).all()


def test_braille(example):
    found = example("braille", WORD="al")
    trains, dots_mm = found["trains"], found["dots_mm"]
    mine = trains.classes[trains.unit] == "sa1"
    assert mine.sum() > 50
    # Spikes fall on the dots, not between them.
    at_mm = np.interp(1e-6 * trains.time_us[mine], found["times_s"], found["way_mm"])
    x_mm, y_mm = found["units_mm"][trains.unit[mine], :2].T
    spikes_mm = np.stack([at_mm + y_mm, 11.25 - x_mm], axis=1)
    off_mm = np.linalg.norm(spikes_mm[:, None] - dots_mm[None], axis=2).min(axis=1)
    assert np.median(off_mm) < 1.5


def test_hand(example):
    found = example("hand", FRAMES="12")
    forces_n = [answer.touch.force_n[2] for answer in found["answers"][-1]]
    np.testing.assert_allclose(forces_n, [force_n for _, force_n in found["hand"].values()], rtol=0.02)
    assert all(len(own.unit) > 0 for own in found["trains"])


def test_pins(example):
    found = example("pins")
    fit, formula = found["driven"]["fit"], found["driven"]["formula"]
    # The pin in the middle of the ring stays still, those under it press.
    middle = found["places"].index((11.25, 0.0))
    assert fit[middle] < 0.3 * fit.max() and 4 <= (fit > 0.05 * fit.max()).sum() < len(fit)
    assert formula.max() > 0
