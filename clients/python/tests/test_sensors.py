"""Sensors: where taxels are, fields that reproduce readings, records, and the command."""

import csv
import json
import subprocess
import sys
from datetime import UTC, datetime

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


def test_what_touches_sharpens_the_map(atlas):
    # A press whose rim is much finer than the taxels; what is known of it is its shape, not its force.
    place = np.array([11.25, 0.0, -6.53])
    inside = np.linalg.norm(atlas.places_mm - place, axis=1)
    truth = np.zeros(224 * 224)
    truth[atlas.pixels[inside < 2.0]] = 2e4
    truth = truth.reshape(224, 224)
    sensor = Taxels.grid(8, 7, pitch_mm=2.0, atlas=atlas, noise=0.05)
    rng = np.random.default_rng(2)
    readings = np.nan_to_num(sensor.read(np.stack([truth, 0.4 * truth]), rng))

    def error(maps):
        return max(np.linalg.norm(maps[i] - s * truth) / np.linalg.norm(s * truth) for i, s in enumerate((1, 0.4)))

    plain, known = sensor.pressure(readings), sensor.pressure(readings, prior=7 * truth)
    assert error(known) < 0.1 < 0.4 < error(plain)
    # A wrong prior does not override the readings, and one of nothing changes nothing.
    beside = np.roll(truth, 25, axis=1)
    assert sensor.reproduction(readings, sensor.pressure(readings, prior=beside)).max() < 0.05
    assert np.array_equal(sensor.pressure(readings, prior=0 * truth), plain)
    for bad, words in ((truth[:8], "shape"), (-truth, "never pulled"), (np.stack([truth] * 3), "is due")):
        with pytest.raises(papilla.BadInput, match=words):
            sensor.pressure(readings, prior=bad)


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


def test_a_wrapped_array_keeps_its_lengths_along_the_skin(atlas):
    wrapped = Taxels.wrapped(8, 9, pitch_mm=1.5, atlas=atlas)
    assert not wrapped.off.any()
    area = np.array([atlas.areas_mm2[pixels].sum() for pixels in wrapped.footprints])
    # A flat array of this width covers more and more skin to the sides; this one 1.5 mm x 1.5 mm with each taxel.
    np.testing.assert_allclose(area, 1.5**2, rtol=0.2)
    middle = np.array([atlas.places_mm[pixels].mean(axis=0) for pixels in wrapped.footprints]).reshape(8, 9, 3)
    for axis in (0, 1):
        steps = np.linalg.norm(np.diff(middle, axis=axis), axis=2)
        np.testing.assert_allclose(steps, 1.5, rtol=0.12)
    assert (np.diff(middle[:, 4, 0]) > 1.3).all() and (np.diff(middle[4, :, 1]) > 0.2).all()
    # It climbs the sides of the finger, and its readings make the pressure that they were read of.
    assert (middle[:, 0, 2] > middle[:, 4, 2] + 1.2).all()
    truth = pressed(atlas, 0.5)
    found = wrapped.pressure(wrapped.read(truth))
    assert wrapped.reproduction(wrapped.read(truth), found) < 0.03
    assert atlas.force_n(found) == pytest.approx(0.5, rel=0.1)


def test_lengths_along_the_skin_are_those_of_the_guide(atlas):
    from papilla.sensors.places import unrolled

    maps = np.full((5, 224 * 224), np.nan)
    maps[:, atlas.pixels] = [*unrolled(atlas), *atlas.places_mm.T]
    maps = maps.reshape(5, 224, 224)
    # From pixel to pixel along rows, and along columns.
    for steps, x_mm in ((np.diff(maps, axis=2), maps[2, :, 1:]), (np.diff(maps, axis=1), maps[2, 1:])):
        off = np.abs(np.hypot(*steps[:2]) / np.linalg.norm(steps[2:], axis=0) - 1)
        for low, high, most in ((6.0, 10.0, 0.25), (10.0, 25.0, 0.07)):
            assert np.nanpercentile(off[(x_mm > low) & (x_mm <= high)], 90) < most


def test_a_wrapped_array_turns_on_the_skin(atlas):
    straight = Taxels.wrapped(1, 7, pitch_mm=1.5, atlas=atlas)
    turned = Taxels.wrapped(7, 1, pitch_mm=1.5, yaw_deg=90.0, atlas=atlas)
    for pixels in straight.footprints:
        best = max(len(np.intersect1d(pixels, other)) for other in turned.footprints)
        assert best > 0.9 * len(pixels)


def test_posed_taxels_cover_the_skin_that_they_face(atlas):
    # The middle of a flat array, taxel by taxel; and one that was turned to face the finger's side.
    flat = Taxels.grid(3, 3, pitch_mm=2.0, atlas=atlas)
    places = [[11.25 + 2.0 * i, 2.0 * j, -6.53] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    posed = Taxels.at(mm=places, area_mm2=4.0, quaternion=[0, 0, 0, 1], atlas=atlas)
    for one, other in zip(flat.footprints, posed.footprints, strict=True):
        assert len(np.setxor1d(one, other)) < 0.12 * len(one)
    side = int(np.argmax(atlas.places_mm[:, 1]))
    # Facing along -y: its z is turned there about x.
    turned = [np.sin(np.pi / 4), 0, 0, np.cos(np.pi / 4)]
    beside = Taxels.at(mm=[atlas.places_mm[side]], area_mm2=4.0, quaternion=turned, atlas=atlas)
    from papilla.sensors.places import normals

    assert (normals(atlas)[beside.footprints[0]][:, 1] > 0.2).all()
    away = Taxels.at(mm=[[11.25, 0, -6.53], [11.25, 0, -12.0]], area_mm2=4.0, quaternion=[0, 0, 0, 1], atlas=atlas)
    assert list(away.off) == [False, True]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda a: Taxels.wrapped(4, 4, pitch_mm=2, centre_mm=[11.25, 0, 0], atlas=a), "mm from the skin"),
        (lambda a: Taxels.wrapped(4, 4, pitch_mm=2, yaw_deg=np.nan, atlas=a), "yaw_deg: nan"),
        (lambda a: Taxels.at(mm=[[11, 0, -6]], area_mm2=1, quaternion=[[0, 0, 1]], atlas=a), r"\(taxels, 4\)"),
        (lambda a: Taxels.at(mm=[[11, 0, -6]], area_mm2=1, quaternion=[1, 1, 1, 1], atlas=a), "unit quaternion"),
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
        (lambda a: Taxels.grid(4, 5, pitch_mm=2, atlas=a).pressure(np.ones((20, 9))), "moveaxis"),
        (lambda a: Taxels.grid(4, 5, pitch_mm=2, atlas=a).pressure(np.ones((5, 4))), "rows and columns seem"),
        (lambda a: Taxels.grid(4.0, 5, pitch_mm=2, atlas=a), "whole numbers"),
        (lambda a: Taxels.grid(4, 5, pitch_mm="2", atlas=a), "pitch_mm: '2'; a distance"),
        (lambda a: Taxels.grid(4, 5, pitch_mm=2, noise="low", atlas=a), "noise: 'low'"),
        (lambda a: Taxels.grid(4, 5, pitch_mm=2, dead=3, atlas=a), "dead: 3; whole numbers"),
        (lambda a: Taxels.wrapped(4, 5, pitch_mm=2, yaw_deg="x", atlas=a), "yaw_deg: 'x'"),
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
        assert read.attrs["sensor_name"] == "glove" and read.attrs["sensor_pitch_mm"] == 2.0
        due = found["expected_error"]["sed_relative_l2"]
        assert read.attrs["sensor_expected_error_sed_relative_l2"] == pytest.approx(due)
        # What is of the network alone is called so, and is not the error to expect of the sensor.
        assert float(read.network_error_sed_median.max()) < due and "error_sed_median" not in read
        assert "network alone" in read.network_error_sed_median.long_name
    assert (tmp_path / "result.png").read_bytes()[:4] == b"\x89PNG"
    text = command(tmp_path, url, "--out", "result.csv", "--no-maps")
    assert text.returncode == 0 and "expected error" in text.stdout, text.stderr
    assert len(list(csv.DictReader((tmp_path / "result.csv").open()))) == 8
    beside = json.loads((tmp_path / "result.csv.json").read_text())
    assert beside["sensor_expected_error_sed_relative_l2"] == pytest.approx(due) and beside["sensor_pitch_mm"] == 2.0


def test_npz_and_nwb_say_what_the_sensor_errs_and_when_it_was(url, atlas, tmp_path):
    from pynwb import NWBHDF5IO

    write_record(tmp_path, atlas, count=3)
    lines = (tmp_path / "record.csv").read_text().splitlines()
    dated = [f"2026-03-01T12:00:00.{20 * i:03},{line.partition(',')[2]}" for i, line in enumerate(lines[1:])]
    (tmp_path / "record.csv").write_text("\n".join(["# a comment", lines[0], *dated]) + "\n")
    record = sensors.read_record(tmp_path / "record.csv", columns="t")
    assert record.start == datetime(2026, 3, 1, 12, tzinfo=UTC) and record.lines == [3, 4, 5]
    sensor = sensors.describe(tmp_path / "glove.toml", atlas=atlas)
    felt = sensors.sense(record, sensor, url=url, tier="half-space", maps=False)
    felt.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as read:
        about = json.loads(str(read["about"]))
    assert about["sensor_expected_error_sa1_relative"] == pytest.approx(felt.expected.sa1_relative)
    assert "network_error_sed_median" in felt.series.values
    felt.save(tmp_path / "a.nwb")
    with NWBHDF5IO(str(tmp_path / "a.nwb"), "r") as file:
        read = file.read()
        assert read.session_start_time == record.start and "sensor_expected_error" in read.session_description


def test_an_array_that_faces_away_is_told_of_its_place_first(url, atlas, tmp_path):
    write_record(tmp_path, atlas, bad=replace("glove.toml", "[grid]", "[grid]\nquaternion = [1, 0, 0, 0]"))
    done = command(tmp_path, url, "--json")
    assert done.returncode == 1 and "taxels lie beside the finger, and the greatest reading is theirs" in done.stderr
    assert "quaternion" in done.stderr and "unit='kPa'" not in done.stderr


def test_readings_in_another_unit_than_the_sensor_are_refused(atlas, grid):
    import xarray

    readings = np.zeros((2, *grid.shape))
    assert grid.pressure(xarray.DataArray(readings, attrs={"units": grid.unit})).shape == (2, 224, 224)
    with pytest.raises(papilla.BadInput, match="the unit 'MPa', the sensor's is 'kPa'"):
        grid.pressure(xarray.DataArray(readings, attrs={"units": "MPa"}))


def columns_of(folder, names, **how):
    rows = [[20 * row, *(10 * row + int(name[1:]) for name in names)] for row in range(2)]
    text = [",".join(["time_ms", *names]), *(",".join(map(str, row)) for row in rows)]
    (folder / "r.csv").write_text("\n".join(text) + "\n")
    return sensors.read_record(folder / "r.csv", **how)


def test_numbered_columns_are_taken_by_their_numbers_or_asked_about(tmp_path):
    letters = sorted((f"t{i}" for i in range(12)), key=str)
    with pytest.raises(papilla.BadInput, match=r"'t2' stands after 't11'.*columns = 't'"):
        columns_of(tmp_path, letters)
    record = columns_of(tmp_path, letters, columns="t")
    assert record.names == [f"t{i}" for i in range(12)]
    np.testing.assert_array_equal(record.readings[1], 10 + np.arange(12))
    assert columns_of(tmp_path, letters, columns=letters).names == letters
    assert columns_of(tmp_path, [f"t{i:02}" for i in range(12)]).readings[0, 11] == 11
    with pytest.raises(papilla.BadInput, match="'t8' stands twice"):
        columns_of(tmp_path, ["t7", "t8", "t8", "t9"], columns="t")
    with pytest.raises(papilla.BadInput, match="'t1' stands twice"):
        columns_of(tmp_path, ["t0", "t1", "t2"], columns=["t0", "t1", "t1"])


def replace(name, old, new):
    return lambda folder: (folder / name).write_text((folder / name).read_text().replace(old, new, 1))


def gap(folder):
    """Takes a reading out of the middle."""
    lines = (folder / "record.csv").read_text().splitlines()
    cells = lines[2].split(",")
    cells[25] = ""
    lines[2] = ",".join(cells)
    (folder / "record.csv").write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    ("spoil", "more", "words"),
    [
        (replace("record.csv", "time_ms", "moment"), (), "no column of times"),
        (replace("record.csv", "\n20,", "\n0,"), (), "frame 1"),
        (replace("record.csv", "\n40,", "\nx,"), (), "line 4, column 'time_ms': 'x' is no number"),
        (replace("record.csv", "\n40,", "\n40,9,"), (), "line 4: 58 cells for 57 columns"),
        (replace("record.csv", "\n20,0.0,", "\n# a comment\n20,0.0,nan,"), (), "line 4: 58 cells"),
        (gap, (), "line 3, column 't24': there is no reading"),
        (replace("glove.toml", "rows = 8", "rows = 7"), (), "56 taxels, and the sensor 'glove' 49"),
        (replace("glove.toml", "rows", "row"), (), "grid.row"),
        (replace("glove.toml", "pitch_mm = 2.0", ""), (), "grid.pitch_mm"),
        (replace("glove.toml", "[grid]", "[grid"), (), "no TOML"),
        (replace("glove.toml", "[grid]", "[grid]\nyaw_deg = 3"), (), "turns by quaternion"),
        (replace("glove.toml", "[grid]", "[grid]\nwrapped = 1"), (), "true or false"),
        (replace("glove.toml", "[record]", '[record]\ntopic = "/t"'), (), "is no bag of ROS"),
        (replace("record.csv", "time_ms", "time_fortnight"), (), "is no unit of time"),
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


@pytest.mark.parametrize("given", [(-1, 0), (0, 0), (np.nan, 0), (2, -1), (2, np.nan), ("2", 0)])
def test_no_errors_are_expected_of_what_no_sensor_is(given):
    with pytest.raises(papilla.BadInput, match="is due"):
        sensors.expected(*given)


def test_the_packages_are_loaded_when_they_are_named():
    code = "import sys, papilla; assert 'papilla.sensors' not in sys.modules; papilla.sensors.Taxels; papilla.nothing"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "no attribute 'nothing'" in done.stderr


def test_dates_are_times(tmp_path):
    stamps = ["2026-03-01T12:00:00.000", "2026-03-01T12:00:00.250", "2026-03-01T12:00:01+00:00"]
    (tmp_path / "a.csv").write_text("stamp,a\n" + "".join(f"{stamp},{i}\n" for i, stamp in enumerate(stamps)))
    assert sensors.read_record(tmp_path / "a.csv").times_s == pytest.approx([0.0, 0.25, 1.0], abs=1e-6)
    (tmp_path / "b.csv").write_text("t,a\n0,2026-03-01\n1,2026-03-02\n")
    with pytest.raises(papilla.BadInput, match="column 'a': dates"):
        sensors.read_record(tmp_path / "b.csv")
    (tmp_path / "c.csv").write_text("t,a\n2026-03-01,1\nlate,2\n")
    with pytest.raises(papilla.BadInput, match="line 3, column 't': 'late'"):
        sensors.read_record(tmp_path / "c.csv")


@pytest.fixture
def bag(tmp_path):
    """Writes a bag of ROS 2 with messages of a type on a topic; gives its folder."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)

    def write(messages, kind="std_msgs/msg/Float32MultiArray", topic="/glove"):
        folder = tmp_path / "bag"
        with Writer(folder, version=9) as writer:
            connection = writer.add_connection(topic, kind, typestore=store)
            for stamp_ns, members in messages:
                message = store.types[kind](**members(store.types))
                writer.write(connection, stamp_ns, store.serialize_cdr(message, kind))
        return folder

    return write


def multi_array(values):
    def members(types):
        layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        return {"layout": layout, "data": np.array(values, np.float32)}

    return members


def joint_state(second, nanosecond, values):
    def members(types):
        stamp = types["builtin_interfaces/msg/Time"](sec=second, nanosec=nanosecond)
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="glove")
        array = np.array(values, np.float64)
        return {"header": header, "name": [], "position": array, "velocity": 2 * array, "effort": 3 * array}

    return members


def test_a_bag_of_ros_is_a_record(bag):
    start = 1_790_000_000_123_456_789
    folder = bag([(start + 10_000_000 * i, multi_array([i, 2.5, -i])) for i in range(4)])
    record = sensors.read_record(folder, topic="/glove")
    np.testing.assert_allclose(record.times_s, 0.01 * np.arange(4), atol=1e-9)
    assert record.readings.tolist() == [[i, 2.5, -i] for i in range(4)] and record.names == ["0", "1", "2"]
    # The file within the folder is the same bag.
    (file,) = folder.glob("*.db3")
    assert sensors.read_record(file, topic="/glove").readings.tolist() == record.readings.tolist()
    with pytest.raises(papilla.BadInput, match=r"no topic '/gloves'; there are /glove"):
        sensors.read_record(folder, topic="/gloves")
    with pytest.raises(papilla.BadInput, match="name the topic of the readings; there are /glove"):
        sensors.read_record(folder)


def test_the_header_of_a_message_has_its_time(bag):
    messages = [(7, joint_state(100, 0, [1.0])), (9, joint_state(100, 250_000_000, [2.0]))]
    folder = bag(messages, "sensor_msgs/msg/JointState")
    record = sensors.read_bag(folder, "/glove", field="effort")
    assert record.times_s.tolist() == [0.0, 0.25] and record.readings.tolist() == [[3.0], [6.0]]
    with pytest.raises(papilla.BadInput, match="position, velocity, effort: name one"):
        sensors.read_bag(folder, "/glove")
    with pytest.raises(papilla.BadInput, match="no member 'force'; there are header, name, position"):
        sensors.read_bag(folder, "/glove", field="force")
    with pytest.raises(papilla.BadInput, match=r"header\.stamp is no array"):
        sensors.read_bag(folder, "/glove", field="header.stamp")


def test_a_bag_that_is_none_is_named(bag, tmp_path):
    folder = bag([(0, multi_array([1.0, 2.0])), (1_000_000, multi_array([1.0]))])
    with pytest.raises(papilla.BadInput, match="message 1 of /glove has 1 readings, the first 2"):
        sensors.read_record(folder, topic="/glove")
    with pytest.raises(papilla.BadInput, match="without a metadata"):
        sensors.read_record(tmp_path, topic="/glove")
    (tmp_path / "torn.mcap").write_bytes(b"no bag")
    with pytest.raises(papilla.BadInput, match="no readable bag"):
        sensors.read_record(tmp_path / "torn.mcap", topic="/glove")


def test_the_command_reads_a_bag(url, atlas, bag, tmp_path):
    forces = write_record(tmp_path, atlas)
    record = sensors.read_record(tmp_path / "record.csv")
    bag([(20_000_000 * i, multi_array(row)) for i, row in enumerate(record.readings)])
    words = [sys.executable, "-m", "papilla", "sense", "bag", "--sensor", "glove.toml", "--url", url]
    more = ["--topic", "/glove", "--json", "--no-maps", "--tier", "half-space"]
    done = subprocess.run([*words, *more], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["force_max_n"] == pytest.approx(forces.max(), rel=0.1)
