"""A series of frames in one call, and its files."""

import csv
import json
import sys

import numpy as np
import pytest

import papilla
from papilla import check

BALL = {"shape": {"shape": "sphere", "radius_mm": 10}}


def bump(peak_pa=1e4):
    v, u = np.mgrid[:224, :224]
    return peak_pa * np.exp(-((u - 118.0) ** 2 + (v - 105.0) ** 2) / 250)


def ramp(count=12):
    return np.linspace(0.2, 1.0, count)[:, None, None] * bump()


def poses(count=8, deepest_mm=0.6):
    rows = np.tile([11.25, 0.0, -16.53, 0, 0, 0, 1], (count, 1))
    rows[:, 2] += np.linspace(0.0, deepest_mm, count)
    return rows


@pytest.mark.parametrize("lanes", [1, 3])
def test_every_frame_of_a_series_is_answered_as_if_it_were_alone(url, lanes):
    series = papilla.render(ramp(), url=url, tier="nano", lanes=lanes)
    assert series.sed.shape == (12, 224, 224) and series.times_s is None
    with papilla.Session(url, tier="nano") as session:
        for number in (0, 5, 11):
            np.testing.assert_array_equal(series.sed[number], session.render(ramp()[number]).sed)
    assert set(series.tier) == {"nano"} and series.flagged() == 0


def test_a_series_says_how_wrong_each_answer_may_be(url):
    path = poses()
    series = papilla.render(path, url=url, input="objects", objects=[BALL])
    with papilla.Session(url, input="objects", objects=[BALL], error_estimate=True) as session:
        one_by_one = [session.touch(pose[None]).error_estimate for pose in path]
    stated = np.stack([series[f"error_{name}"] for name in papilla.ErrorEstimate._fields], axis=1)
    np.testing.assert_allclose(stated[1:], one_by_one[1:], rtol=1e-3)
    assert np.isfinite(stated[1:]).all() and (stated[1:, 0] < stated[1:, 1]).all()
    assert np.isinf(stated[0]).all()  # nothing touches
    without = papilla.render(path, url=url, input="objects", objects=[BALL], error_estimate=False)
    assert "error_sed_p90" not in without.values


def test_a_series_remembers_in_the_order_of_its_frames(url):
    held = np.repeat(bump()[None], 10, axis=0)
    times_s = 0.05 * np.arange(10)
    effects = {"effects": ["relaxation", "afferents", "summary"], "tier": "half-space"}
    series = papilla.render(held, times_s, url=url, **effects)
    with papilla.Session(url, **effects) as session:
        one_by_one = [session.render(held[i], client_time_us=round(5e4 * i)) for i in range(10)]
    np.testing.assert_array_equal(series.sed, [answer.sed for answer in one_by_one])
    np.testing.assert_array_equal(series.rates_hz, [answer.rates_hz for answer in one_by_one])
    # The skin gives way under a held pressure.
    assert (np.diff(series["summary_sed_max_j_per_m3"]) > 0).all()


def test_poses_give_forces_and_friction_in_order(url):
    rough = BALL | {"friction": 0.5}
    path = np.concatenate([poses(4), poses(4)])
    path[4:] = path[3]
    path[4:, 1] = [0.1, 0.2, 0.3, 0.4]
    series = papilla.render(path, url=url, input="objects", objects=[rough], map=False)
    assert series.force_n.shape == (8, 3)
    assert (np.diff(series.force_n[:4, 2]) > 0).all() and series.force_n[-1, 1] > 0.01
    metres = path.copy()
    metres[:, :3] *= 1e-3
    with pytest.raises(papilla.BadInput, match="unit='m'"):
        papilla.render(metres, url=url, input="objects", objects=[rough], map=False)
    again = papilla.render(metres, url=url, unit="m", input="objects", objects=[rough], map=False)
    np.testing.assert_allclose(again.force_n, series.force_n, rtol=1e-5, atol=1e-6)


def test_gaps_and_pressure_at_vertices(url):
    atlas = papilla.Atlas.load(url)
    depth_mm = -6.3 - atlas.positions_mm[:, 2]
    gaps = np.stack([depth_mm + 0.1 * i for i in range(3)])
    series = papilla.render(gaps, url=url, input="gaps", input_layout="vertices", map=False)
    assert (np.diff(series["touch_area_mm2"]) > 0).all()
    pressed = np.clip(1e4 * depth_mm, 0, None)[None]
    at_vertices = papilla.render(pressed, url=url, tier="half-space", input_layout="vertices", effects=["summary"])
    as_map = papilla.render(atlas.rasterise(pressed[0])[None], url=url, tier="half-space", effects=["summary"])
    force_n = [float(each["summary_force_n"][0]) for each in (at_vertices, as_map)]
    assert force_n[0] == pytest.approx(force_n[1], rel=1e-3)


def test_poses_of_one_object_may_come_one_by_one(url):
    hello = {"input": "objects", "objects": [BALL], "map": False}
    whole, single = papilla.render(poses(), url=url, **hello), papilla.render(iter(poses()), url=url, **hello)
    np.testing.assert_array_equal(single.force_n, whole.force_n)


def test_a_series_in_chunks_is_the_series(url):
    times_s = 0.01 * np.arange(12)
    terms = {"url": url, "tier": "half-space", "effects": ["spikes", "summary"], "map": False}
    whole = papilla.render(ramp(), times_s, **terms)
    parts = list(papilla.render_chunks(iter(ramp()), times_s, chunk=5, **terms))
    assert [len(part) for part in parts] == [5, 5, 2]
    np.testing.assert_array_equal(np.concatenate([part["summary_force_n"] for part in parts]), whole["summary_force_n"])
    np.testing.assert_array_equal(np.concatenate([part.spikes.time_us for part in parts]), whole.spikes.time_us)
    assert len(whole.spikes.unit) > 0 and whole.spikes.lost == 0 and [part.spikes.lost for part in parts] == [0, 0, 0]
    unknown = papilla.render((frame for frame in ramp()), times_s, **terms)
    np.testing.assert_array_equal(unknown.spikes.unit, whole.spikes.unit)


def spoilt(values, number=3, row=10, column=20):
    frames = ramp()
    frames[number, row, column] = values
    return frames


@pytest.mark.parametrize(
    ("frames", "more", "words"),
    [
        (np.moveaxis(ramp(), 0, -1), {}, "np.moveaxis"),
        (bump(), {}, "one frame"),
        (np.ones((5, 8, 8)), {}, "papilla.sensors.Taxels"),
        (np.ones((5, 1, 7)), {}, "input='objects'"),
        (1e-3 * ramp(), {}, "unit='kPa'"),
        (ramp(), {"unit": "psi"}, "none of Pa, kPa, MPa"),
        (ramp().astype(str), {}, "real numbers"),
        (ramp() + 1j, {}, "real numbers"),
        (spoilt(np.nan), {}, r"frame 3: nan at \[10, 20\]"),
        (spoilt(-5.0), {}, r"frame 3: -5.0 at \[10, 20\].*np.maximum"),
        ([[1, 2], [3]], {}, "equally long"),
        (ramp()[:0], {}, "there are none"),
        (ramp(), {"times": np.arange(11)}, "one time for each frame"),
        (ramp(), {"times": [0, 1, 1, *range(3, 12)]}, "frame 2: 1 s follows 1 s"),
        (ramp(), {"times": [0, np.nan, *range(2, 12)]}, "nan at"),
        (ramp(), {"effects": ["spikes"]}, "'spikes' depends on time"),
        (ramp(), {"budget_us": 5000}, "name a tier"),
        (ramp(), {"lanes": 2, "effects": ["relaxation"], "times": np.arange(12)}, "over one"),
    ],
)
def test_bad_input_is_named_with_its_cure(url, frames, more, words):
    with pytest.raises(papilla.BadInput, match=words):
        papilla.render(frames, url=url, **more)


@pytest.mark.parametrize("threads", [1, 3])
def test_the_first_of_the_bad_frames_is_named_by_several_threads(threads, monkeypatch):
    monkeypatch.setattr(check, "_OF_A_THREAD", 16)
    monkeypatch.setattr(check, "_TOGETHER", 48)
    frames = np.ones((100, 4, 4), np.float32)
    frames[41, 2, 3] = 7.0
    assert check.every_frame(frames, (4, 4), "pressure", 1e3, threads) == 7e3
    frames[[30, 70], 1, 2] = -1.0
    with pytest.raises(papilla.BadInput, match=r"frame 30: -1.0 at \[1, 2\]"):
        check.every_frame(frames, (4, 4), "pressure", 1.0, threads)
    poses = np.zeros((100, 1, 7))
    poses[50, 0] = [0, -3, 0, 0, 0, 0, 9]
    assert check.every_frame(poses, (1, 7), "objects", 1e3, threads) == 3e3


def test_small_values_are_taken_where_their_unit_is_said(url):
    in_kpa = papilla.render(1e-3 * ramp(), unit="kPa", url=url, tier="half-space")
    np.testing.assert_allclose(in_kpa.sed, papilla.render(ramp(), url=url, tier="half-space").sed, rtol=1e-4, atol=1e-4)
    assert len(papilla.render(1e-3 * ramp(), unit="Pa", url=url, tier="half-space")) == 12
    slow = papilla.render(ramp(), np.arange(12), url=url, tier="half-space")
    assert any("were ms" in words for words in slow.warnings)


def labelled(values, dims, **attributes):
    import xarray

    return xarray.DataArray(values, dims=dims, attrs=attributes)


def test_arrays_with_named_axes_and_units_are_read_by_them(url):
    due = papilla.render(ramp(), 0.01 * np.arange(12), url=url, tier="half-space", effects=["afferents"])
    turned = labelled(1e-3 * np.moveaxis(ramp(), 0, 2).swapaxes(0, 1), ("column", "row", "time"), units="kPa")
    times = labelled(10.0 * np.arange(12), ("time",), units="ms")
    read = papilla.render(turned, times, url=url, tier="half-space", effects=["afferents"])
    np.testing.assert_allclose(read.sed, due.sed, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(read.times_s, due.times_s)
    # The same of a frame, of frames that come one by one, and of poses.
    one = labelled(1e-3 * bump().T, ("column", "row"), units="kPa")
    np.testing.assert_allclose(papilla.sed(one, url=url), papilla.sed(bump(), url=url), rtol=1e-4, atol=1e-4)
    with papilla.Session(url) as session:
        np.testing.assert_allclose(session.render(one).sed, session.render(bump()).sed, rtol=1e-4, atol=1e-4)
        assert session.warnings == []
    assert papilla.render((one for _ in range(2)), url=url, tier="half-space").sed.shape == (2, 224, 224)
    in_m = labelled(poses() * np.array([1e-3] * 3 + [1.0] * 4), ("frame", "pose"), units="m")
    hello = {"input": "objects", "objects": BALL, "map": False}
    np.testing.assert_allclose(
        papilla.render(in_m, url=url, **hello).force_n, papilla.render(poses(), url=url, **hello).force_n, rtol=1e-3
    )


@pytest.mark.parametrize(
    ("values", "more", "words"),
    [
        (lambda: labelled(bump(), ("row", "column"), units="psi"), {}, "the unit 'psi', none of Pa"),
        (lambda: labelled(bump(), ("row", "column"), units="Pa"), {"unit": "kPa"}, "own attribute says 'Pa'"),
        (lambda: np.ma.masked_less(bump(), 1.0), {}, r"values are masked: give \.filled"),
        (lambda: 1e-3 * bump(), {}, "unit='kPa'"),
    ],
)
def test_values_that_mean_something_else_are_named(url, values, more, words):
    with pytest.raises(papilla.BadInput, match=words):
        papilla.sed(values(), url=url, **more)
    with pytest.raises(papilla.BadInput, match=words):
        papilla.render((values() for _ in range(2)), url=url, **more)


def test_a_session_asks_once_whether_small_values_are_in_another_unit(url):
    with papilla.Session(url, tier="half-space") as session:
        session.render(np.zeros((224, 224)))
        assert session.warnings == []
        for _ in range(2):
            assert session.render(1e-3 * bump()).status == "ok"
        assert session.warnings == ["the greatest value is 10, which is little for Pa: was kPa or MPa meant?"]
    with papilla.Session(url, input="objects", objects=[BALL], map=False) as session:
        session.touch([0.01125, 0, -0.0162, 0, 0, 0, 1])
        assert session.warnings[0] == "the greatest value is 0.0162, which is little for mm: was m meant?"
    with papilla.Session(url, tier="half-space") as session:
        session.series(1e-3 * ramp(), unit="Pa")
        assert session.warnings == []


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.ones((8, 8)), "papilla.sensors.Taxels"),
        (np.ones(224 * 224), "reshape"),
        (np.ones((3, 224, 224)), "papilla.render"),
    ],
)
def test_a_single_map_of_another_shape_says_what_to_do(url, values, words):
    with pytest.raises(papilla.BadInput, match=words):
        papilla.sed(values, url=url)
    with papilla.Session(url) as session, pytest.raises(papilla.BadInput, match=words):
        session.render(values)


def test_a_frame_without_an_answer_is_an_error_with_its_number(url):
    frames = ramp()
    frames[7] *= 1e9
    with pytest.raises(papilla.FrameFailed, match="frame 7 is error") as failed:
        papilla.render(frames, url=url, tier="half-space")
    assert failed.value.frame == 7


def test_progress_is_told_and_can_stop_a_series(url):
    seen = []
    papilla.render(ramp(), url=url, tier="half-space", progress=lambda done, of: seen.append((done, of)))
    assert seen == [(i + 1, 12) for i in range(12)]

    def interrupt(done, of):
        if done == 4:
            raise KeyboardInterrupt

    with papilla.Session(url, tier="half-space") as session:
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                session.series(ramp(), progress=interrupt)
        assert len(session.series(ramp())) == 12
    with pytest.raises(KeyboardInterrupt):
        papilla.render(ramp(), url=url, tier="half-space", progress=interrupt, lanes=3)


@pytest.fixture(scope="module")
def series(url):
    times_s = 2.0 + 0.01 * np.arange(12)
    return papilla.render(ramp(), times_s, url=url, tier="half-space", effects=["spikes", "afferents", "summary"])


def test_files_hold_what_the_series_holds(series, tmp_path):
    import xarray
    from pynwb import NWBHDF5IO

    series.to_netcdf(tmp_path / "a.nc")
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as read:
        assert read.sed_j_per_m3.dims == ("time", "row", "column") and read.sed_j_per_m3.units == "J m-3"
        np.testing.assert_array_equal(read.sed_j_per_m3, series.sed)
        np.testing.assert_array_equal(read.time, series.times_s)
        assert read.flags.attrs["flag_meanings"].split()[0] == "out_of_range" and read.attrs["tier"] == "half-space"
        assert len(read.spike_time_s) == len(series.spikes.unit) > 0
    series.to_npz(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as read:
        np.testing.assert_array_equal(read["rates_hz"], series.rates_hz)
        assert list(read["tier"]) == ["half-space"] * 12
    series.to_csv(tmp_path / "a.csv")
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    assert len(rows) == 12 and float(rows[3]["time_s"]) == series.times_s[3]
    assert float(rows[3]["sed_j_per_m3_max"]) == pytest.approx(series.sed[3].max())
    series.to_nwb(tmp_path / "a.nwb")
    with NWBHDF5IO(str(tmp_path / "a.nwb"), "r") as file:
        read = file.read()
        force = read.processing["papilla"]["summary_force_n"]
        np.testing.assert_array_equal(force.data[:], series["summary_force_n"])
        assert read.processing["papilla"]["sed_j_per_m3"].data.compression == "gzip"
        np.testing.assert_array_equal(read.processing["papilla"]["sed_j_per_m3"].data[3], series.sed[3])
        assert force.unit == "N" and sum(len(times) for times in read.units["spike_times"][:]) == len(
            series.spikes.unit
        )
        assert min(times[0] for times in read.units["spike_times"][:] if len(times)) >= series.times_s[0] - 0.01
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.csv.json", "a.nc", "a.npz", "a.nwb"]
    assert json.loads((tmp_path / "a.csv.json").read_text())["tier"] == "half-space"


def test_nothing_is_left_half_written(series, tmp_path, monkeypatch):
    target = tmp_path / "a.npz"
    target.write_bytes(b"old")

    def breaks(file, **_):
        file.write(b"half")
        raise OSError("the disk is full")

    monkeypatch.setattr(np, "savez_compressed", breaks)
    with pytest.raises(OSError, match="disk is full"):
        series.to_npz(target)
    assert target.read_bytes() == b"old" and list(tmp_path.iterdir()) == [target]
    with pytest.raises(papilla.BadInput, match="does not exist"):
        series.to_csv(tmp_path / "nowhere" / "a.csv")


@pytest.mark.parametrize(
    ("module", "method", "extra"),
    [("xarray", "to_netcdf", "xarray"), ("h5netcdf", "to_netcdf", "xarray"), ("pynwb", "to_nwb", "nwb")],
)
def test_a_missing_package_is_named_by_its_extra(series, tmp_path, monkeypatch, module, method, extra):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(papilla.MissingExtra, match=rf"papilla\[{extra}\]"):
        getattr(series, method)(tmp_path / "a")
    assert not list(tmp_path.iterdir())


def test_what_was_not_asked_for_is_not_carried(series):
    with pytest.raises(papilla.NotCarried, match="ask for more in the hello"):
        _ = series.force_n
