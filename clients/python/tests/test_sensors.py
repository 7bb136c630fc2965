"""Sensors: where taxels are, fields that reproduce readings, records, and the command."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest

import papilla
from papilla import sensors
from papilla.sensors import Taxels


@pytest.fixture(scope="module")
def atlas(url):
    return papilla.Atlas.load(url)


@pytest.fixture(scope="module")
def grid(atlas):
    return Taxels.grid(8, 7, pitch_mm=2.0, atlas=atlas, unit="kPa", noise=0.05)


def pressed(atlas, force_n=0.5, at=(11.25, 0.0, -6.53)):
    return atlas.contacts([papilla.Contact(at, force_n)])


def test_taxels_of_a_grid_tile_the_skin_over_them(atlas, grid):
    covered = np.concatenate(grid.footprints)
    assert len(np.unique(covered)) == len(covered) and not grid.off.all()
    # Row 0 at the tip, column 0 at the least y.
    middle = np.array(
        [atlas.places_mm[pixels].mean(axis=0) if len(pixels) else np.full(3, np.nan) for pixels in grid.footprints]
    )
    middle = middle.reshape(8, 7, 3)
    assert (np.diff(middle[:, 3, 0]) > 1.5).all() and (np.diff(middle[4, :, 1]) > 1.0).all()
    assert middle[:, :, 2].max() < -2.0


def test_a_turned_array_is_the_array_turned(atlas):
    quarter = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
    straight = Taxels.grid(1, 5, pitch_mm=2.0, atlas=atlas)
    turned = Taxels.grid(5, 1, pitch_mm=2.0, atlas=atlas, quaternion=quarter)
    same = [set(map(int, pixels)) for pixels in turned.footprints]
    for pixels in straight.footprints:
        assert max(len(set(map(int, pixels)) & other) for other in same) > 0.9 * len(pixels)


def test_readings_of_a_uniform_pressure_are_that_pressure(atlas):
    uniform = np.full((224, 224), 5e3)
    for unit, due in (("kPa", 5.0), ("Pa", 5e3), ("N", 5e3 * 4e-6), ("mN", 5e3 * 4e-3)):
        sensor = Taxels.grid(5, 5, pitch_mm=2.0, atlas=atlas, unit=unit, gain=2.0, offset=1.0)
        readings = sensor.read(uniform)
        live = sensor.live.reshape(5, 5)
        np.testing.assert_allclose(readings[live], due / 2.0 + 1.0, rtol=1e-6)
        np.testing.assert_allclose(sensor.pascals(readings)[0][sensor.live], 5e3, rtol=1e-6)


@pytest.mark.parametrize("pitch_mm", [1.0, 2.0, 4.0])
def test_the_field_reproduces_the_readings_and_never_pulls(atlas, pitch_mm):
    sensor = Taxels.grid(round(20 / pitch_mm), round(14 / pitch_mm), pitch_mm=pitch_mm, atlas=atlas)
    truth = np.stack([pressed(atlas, force) for force in (0.05, 0.3, 1.5)])
    readings = sensor.read(truth)
    maps = sensor.pressure(readings)
    assert maps.shape == (3, 224, 224) and maps.min() >= 0.0
    assert sensor.reproduction(readings, maps).max() < 0.03
    forces = [atlas.force_n(each) for each in maps]
    # A contact narrower than a taxel is spread over its neighbours.
    np.testing.assert_allclose(forces, (0.05, 0.3, 1.5), rtol=0.1 if pitch_mm < 4 else 0.3)


def test_a_finer_sensor_comes_nearer_and_the_smooth_field_beats_steps(atlas):
    truth = pressed(atlas, 0.8)
    errors = []
    for pitch_mm in (1.0, 2.0, 4.0):
        sensor = Taxels.grid(round(20 / pitch_mm), round(14 / pitch_mm), pitch_mm=pitch_mm, atlas=atlas)
        readings = sensor.read(truth).reshape(-1)
        found = sensor.pressure(readings)
        steps = np.zeros(224 * 224)
        for value, pixels in zip(sensor.pascals(readings)[0], sensor.footprints, strict=True):
            steps[atlas.pixels[pixels]] = value
        errors.append(np.linalg.norm(found - truth))
        assert errors[-1] < np.linalg.norm(steps.reshape(224, 224) - truth)
    assert errors[0] < errors[1] < errors[2]


def test_noise_without_a_touch_is_nothing(atlas, grid):
    rng = np.random.default_rng(1)
    readings = grid.read(np.zeros((20, 224, 224)), rng)
    assert (
        np.count_nonzero(grid.pressure(np.where(grid.live.reshape(8, 7), readings, 0)).reshape(20, -1).any(axis=1)) <= 4
    )


def test_dead_taxels_are_left_out(atlas):
    truth = pressed(atlas)
    sensor = Taxels.grid(8, 7, pitch_mm=2.0, atlas=atlas, dead=[31])
    readings = sensor.read(truth)
    assert np.isnan(readings.reshape(-1)[31])
    readings.reshape(-1)[31] = 1e6
    assert sensor.pressure(np.nan_to_num(readings)).max() < 3 * truth.max()


def test_a_list_of_taxels_lies_where_it_is_said_to(atlas):
    places = [[11.25, -2, -6.3], [11.25, 0, -6.5], [11.25, 2, -6.3], [80, 0, 0]]
    by_mm = Taxels.at(mm=places, area_mm2=3.0, atlas=atlas)
    assert list(by_mm.off) == [False, False, False, True] and by_mm.pitch_mm == pytest.approx(2.0, rel=0.05)
    for pixels in by_mm.footprints[:3]:
        assert atlas.areas_mm2[pixels].sum() == pytest.approx(3.0, rel=0.1)
    pixel = int(atlas.pixels[by_mm.footprints[1]].mean())
    assert pixel
    px = [[112.0, 100.0], [125.0, 100.0]]
    by_px = Taxels.at(px=px, area_mm2=[1.0, 4.0], atlas=atlas)
    own = atlas.pixels[by_px.footprints[0]]
    assert np.hypot(own % 224 + 0.5 - 112.0, own // 224 + 0.5 - 100.0).max() < 8


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda a: Taxels.grid(4, 4, pitch_mm=0.002, atlas=a), "was m meant"),
        (lambda a: Taxels.grid(0, 4, pitch_mm=2, atlas=a), "0 x 4 taxels"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, taxel_mm=3, atlas=a), "at most the pitch"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, unit="psi", atlas=a), "none of Pa"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, dead=[16], atlas=a), "count from 0 to 15"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, gain=[1, 2], atlas=a), "one for each of 16"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, gain=0, atlas=a), "gain 0"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, centre_mm=[500, 0, 0], atlas=a), "none of them lies on the finger"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, quaternion=[0, 0, 0, 2], atlas=a), "unit quaternion"),
        (lambda a: Taxels.at(mm=[[1, 2]], area_mm2=1, atlas=a), r"\(taxels, 3\)"),
        (lambda a: Taxels.at(mm=[[11, 0, -6]], px=[[1, 2]], area_mm2=1, atlas=a), "mm or as px"),
        (lambda a: Taxels.at(mm=[[11, 0, -6]], area_mm2=0, atlas=a), "above 0"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, atlas=a).pressure(np.ones((4, 5))), "due"),
        (lambda a: Taxels.grid(4, 5, pitch_mm=2, atlas=a).pressure(np.ones((4, 5, 9))), "moveaxis"),
        (lambda a: Taxels.grid(4, 4, pitch_mm=2, atlas=a).pressure(np.full((3, 16), np.nan)), "frame 0: taxel"),
    ],
)
def test_what_no_sensor_is_gets_named(atlas, make, words):
    with pytest.raises(papilla.BadInput, match=words):
        make(atlas)


SENSOR = """
[sensor]
name = "glove"
unit = "kPa"
noise = 0.02
dead = [0]
[grid]
rows = 8
columns = 7
pitch_mm = 2.0
[record]
columns = "t"
"""


def write_record(folder, atlas, count=8, bad=None):
    (folder / "glove.toml").write_text(SENSOR)
    sensor = sensors.describe(folder / "glove.toml", atlas=atlas)
    forces = 0.6 * np.sin(np.linspace(0.2, np.pi - 0.2, count))
    readings = np.nan_to_num(sensor.read(np.stack([pressed(atlas, force) for force in forces])).reshape(count, -1))
    with (folder / "record.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_ms", *(f"t{i}" for i in range(readings.shape[1]))])
        for number, row in enumerate(readings):
            writer.writerow([20 * number, *np.round(row, 4)])
    if bad is not None:
        bad(folder)
    return forces


def command(folder, url, *more):
    words = [sys.executable, "-m", "papilla", "sense", "record.csv", "--sensor", "glove.toml", "--url", url, *more]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)


def test_the_command_makes_a_result_of_a_record(url, atlas, tmp_path):
    import xarray

    forces = write_record(tmp_path, atlas)
    done = command(
        tmp_path, url, "--out", "result.nc", "--picture", "result.png", "--json", "--spikes", "--tier", "nano"
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["frames"] == 8 and found["duration_s"] == pytest.approx(0.14)
    assert found["force_max_n"] == pytest.approx(forces.max(), rel=0.1)
    assert 0 < found["expected_error"]["sed_relative_l2"] < 1 and found["reproduction_error_max"] < 0.1
    with xarray.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as read:
        assert read.sensor_pressure_pa.shape == (8, 224, 224)
        np.testing.assert_allclose(read.summary_force_n, forces, rtol=0.15)
        np.testing.assert_allclose(read.time, 0.02 * np.arange(8))
    assert (tmp_path / "result.png").read_bytes()[:4] == b"\x89PNG"
    text = command(tmp_path, url, "--out", "result.csv", "--no-maps")
    assert text.returncode == 0 and "expected error" in text.stdout, text.stderr
    assert len(list(csv.DictReader((tmp_path / "result.csv").open()))) == 8


def replace(name, old, new):
    return lambda folder: (folder / name).write_text((folder / name).read_text().replace(old, new, 1))


@pytest.mark.parametrize(
    ("spoil", "more", "words"),
    [
        (replace("record.csv", "time_ms", "moment"), (), "no column of times"),
        (replace("record.csv", "\n20,", "\n0,"), (), "frame 1"),
        (replace("record.csv", "\n40,", "\nx,"), (), "line 4, column 'time_ms': 'x' is no number"),
        (replace("record.csv", "\n40,", "\n40,9,"), (), "line 4: 58 cells for 57 columns"),
        (replace("glove.toml", "rows = 8", "rows = 7"), (), "56 taxels, and the sensor 'glove' 49"),
        (replace("glove.toml", "rows", "row"), (), "grid.row"),
        (replace("glove.toml", "pitch_mm = 2.0", ""), (), "grid.pitch_mm"),
        (replace("glove.toml", "[grid]", "[grid"), (), "no TOML"),
        (replace("glove.toml", '"kPa"', '"Pa"'), (), "unit='kPa'"),
        (lambda folder: None, ("--out", "x.mat"), "none of .nc"),
        (lambda folder: (folder / "record.csv").unlink(), (), "does not exist"),
    ],
)
def test_a_bad_record_is_named_and_leaves_nothing(url, atlas, tmp_path, spoil, more, words):
    write_record(tmp_path, atlas, bad=spoil)
    before = sorted(tmp_path.iterdir())
    done = command(tmp_path, url, *(more or ("--out", "result.npz", "--tier", "half-space")))
    assert done.returncode == 1 and words in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_records_of_npz_and_of_semicolons(tmp_path):
    np.savez(tmp_path / "a.npz", times_s=[5.0, 5.1], readings=np.ones((2, 3, 2)))
    record = sensors.read_record(tmp_path / "a.npz")
    assert record.readings.shape == (2, 6) and record.times_s == pytest.approx([0.0, 0.1])
    (tmp_path / "b.csv").write_text("a;b\n1,5;2\n2,5;3\n")
    record = sensors.read_record(tmp_path / "b.csv", rate_hz=100)
    assert record.readings[1, 0] == 2.5 and record.times_s[1] == pytest.approx(0.01)


def test_expected_errors_grow_with_pitch_and_noise():
    fine, coarse, noisy = sensors.expected(1.0, 0.0), sensors.expected(4.0, 0.0), sensors.expected(1.0, 0.05)
    assert fine.sed_relative_l2 < noisy.sed_relative_l2 < coarse.sed_relative_l2 and not coarse.beyond
    assert sensors.expected(8.0, 0.0).beyond and sensors.expected(1.5, 0.01).sed_relative_l2 > fine.sed_relative_l2


def test_the_packages_are_loaded_when_they_are_named():
    code = "import sys, papilla; assert 'papilla.sensors' not in sys.modules; papilla.sensors.Taxels; papilla.nothing"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "no attribute 'nothing'" in done.stderr
