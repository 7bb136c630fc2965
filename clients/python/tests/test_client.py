"""What the conformance script does not cover: the asyncio session, misuse, the example."""

import asyncio
import os
import runpy
import socket
import time
from pathlib import Path

import numpy as np
import pytest

import papilla
from papilla import answer as answers
from papilla import wire

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def bump(peak_pa=1e4):
    v, u = np.mgrid[:224, :224]
    return peak_pa * np.exp(-((u - 118.0) ** 2 + (v - 105.0) ** 2) / 250)


def test_http_and_sessions_give_the_same_map(url):
    over_http = papilla.sed(bump(), url=url, tier="nano")
    with papilla.Session(url, tier="nano") as session:
        answer = session.render(bump())
    assert over_http.shape == (224, 224) and over_http.max() > 10
    np.testing.assert_allclose(answer.sed, over_http, rtol=1e-5, atol=1e-4)


def test_asyncio_sessions_side_by_side(url):
    async def render(scale):
        async with papilla.AsyncSession(url, tier="half-space", effects=["summary"]) as session:
            answers = [await session.render(scale * bump()) for _ in range(3)]
            assert session.connected and session.connections == 1
            return answers[-1]

    async def both():
        return await asyncio.gather(render(1.0), render(0.5))

    whole, half = asyncio.run(both())
    # The half-space is linear, SED is quadratic.
    assert half.summary.sed_max_j_per_m3 == pytest.approx(whole.summary.sed_max_j_per_m3 / 4, rel=0.01)
    assert half.summary.force_n == pytest.approx(whole.summary.force_n / 2, rel=1e-5)


def test_the_indentations_of_the_service_are_rendered_as_its_card_promises(url):
    indentation = papilla.indentation(0, url=url)
    named = papilla.indentation(0, url=url, finger="default")
    assert named.name == indentation.name and (named.sed_j_per_m3 == indentation.sed_j_per_m3).all()
    with pytest.raises(papilla.Refused, match="no finger 'nobody'"):
        papilla.indentation(0, url=url, finger="nobody")
    rendered = papilla.sed(indentation.pressure_pa, url=url)
    error = np.linalg.norm(rendered - indentation.sed_j_per_m3) / np.linalg.norm(indentation.sed_j_per_m3)
    assert error < 0.3, f"relative L2 {error}"


def test_a_contact_presses_with_its_force(url):
    atlas = papilla.Atlas.load(url)
    pressure_pa = atlas.contacts([papilla.Contact((11.25, 0.0, -6.5), 0.3, 2.0)])
    with papilla.Session(url, tier="half-space", effects=["summary"]) as session:
        assert session.ready["atlas_hash"] == atlas.hash
        answer = session.render(pressure_pa)
    assert answer.summary.force_n == pytest.approx(0.3, rel=1e-4)
    assert answer.summary.contact_area_mm2 == pytest.approx(np.pi * 4, rel=0.1)


def test_a_rough_ball_pulls_the_skin_along(url):
    ball = {"shape": {"shape": "sphere", "radius_mm": 10}, "friction": 0.5}
    with papilla.Session(url, input="objects", objects=[ball], map=False, shear=True) as session:
        session.touch([11.25, 0.0, -16.0, 0, 0, 0, 1])
        answer = session.touch([11.25, 0.5, -16.0, 0, 0, 0, 1])
        vertices = session.ready["vertices"]
    pull_n, press_n = answer.touch.force_n[1:]
    assert pull_n == pytest.approx(0.5 * press_n, rel=0.25)
    assert answer.shear_pa.shape == (vertices, 3)
    assert answer.shear_pa[:, 1].sum() == pytest.approx(abs(answer.shear_pa[:, 1]).sum(), rel=0.1)


def test_members_hold_what_they_say(url):
    ball = {"shape": {"shape": "sphere", "radius_mm": 10}}
    with papilla.Session(url, input="objects", objects=[ball], fingers=[{}, {}], map=False, pressure="map") as session:
        pose = [11.25, 0.0, -16.0, 0, 0, 0, 1]
        assert session.touch(pose).pressure_pa.shape == (224, 224)
        sent = [session.send_poses(pose, finger=1) for _ in range(3)]
        assert [outcome.result(10).finger for outcome in sent] == [1, 1, 1]


def test_a_service_that_says_nothing_holds_nobody():
    listening = socket.create_server(("127.0.0.1", 0))
    with pytest.raises(papilla.Unreachable, match="papilla-server"):
        papilla.Session(f"127.0.0.1:{listening.getsockname()[1]}")
    with pytest.raises(ValueError, match="timeout_s"):
        papilla.Session(timeout_s=0)


def test_misuse_is_told(url):
    with pytest.raises(papilla.Unreachable, match="papilla-server"):
        papilla.Session("http://127.0.0.1:1")
    with pytest.raises(papilla.Unreachable, match="papilla-server"):
        papilla.sed(bump(), url="http://127.0.0.1:1")
    with pytest.raises(papilla.Refused) as refused:
        papilla.Session(url, tier="none-such")
    assert (refused.value.code, refused.value.field) == ("unknown_tier", "tier")
    with pytest.raises(papilla.Refused) as refused:
        papilla.sed(-bump(), url=url)
    assert refused.value.code == "negative_pressure"
    with papilla.Session(url, tier="half-space") as session:
        with pytest.raises(ValueError, match="window"):
            session.send(np.zeros((10, 12)))
        with pytest.raises(ValueError, match="window"):
            session.send(np.zeros((10, 12)), window=(0, 0, 10, 12))
        late = session.render(bump(), deadline_us=1)
        with pytest.raises(papilla.NotRendered, match="late"):
            _ = late.sed
    with pytest.raises(papilla.Closed):
        session.send(bump())


def test_a_frame_that_waits_can_be_closed_on(url):
    session = papilla.Session(url, tier="s1-base16")
    sent = [session.send(bump()) for _ in range(3)]
    session.close()
    assert {outcome.result(5).status for outcome in sent} <= {"ok", "superseded", "lost"}


def test_spikes_are_collected_and_written(url, tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(tmp_path)
    trains = runpy.run_path(str(EXAMPLES / "spikes.py"))["trains"]
    written = np.load(tmp_path / "spikes.npz")
    assert written["lost"] == 0 and str(written["atlas_hash"]) == trains.atlas_hash
    assert set(written["unit_class"][written["unit"]]) == {"sa1", "ra", "pc"}
    assert np.all(np.diff(written["time_us"]) >= 0) and written["time_us"].max() <= 999_000
    # Taps that come ten times a second are answered ten times a second.
    per_ms = np.bincount(written["time_us"] // 1000, minlength=1000)
    per_tap = per_ms[:1000].reshape(10, 100).sum(1)
    assert per_tap.min() > 100 and per_tap[2:].std() < 0.05 * per_tap.mean()
    assert trains.of(int(trains.unit[0]))[0] == written["time_us"][0]


def test_spikes_that_did_not_fit_are_counted(url):
    with papilla.Session(url, tier="half-space", effects=["spikes"], spikes={"spikes_max": 5}) as session:
        trains = papilla.SpikeTrains(session.ready)
        for ms in range(0, 60, 10):
            trains.add(session.render(bump(1e3 * ms), client_time_us=1000 * ms))
        session.renew(effects=[])
        with pytest.raises(papilla.PapillaError, match="spikes"):
            papilla.SpikeTrains(session.ready)
    assert 0 < len(trains.unit) <= 30 and trains.lost > 0


@pytest.mark.parametrize("unit", ["us", "ms", "ns"])
def test_times_in_another_unit_are_noticed_in_a_live_session(url, unit):
    of_ns = {"us": 1000, "ms": 1_000_000, "ns": 1}[unit]
    with papilla.Session(url, tier="half-space", effects=["relaxation", "summary"], map=False) as session:
        flagged, begin = [], time.monotonic()
        until_s = 3.0 if unit == "us" else 20.0
        while not any(flagged) and time.monotonic() - begin < until_s:
            answer = session.render(bump(1e4), client_time_us=time.monotonic_ns() // of_ns)
            flagged.append(answer.coarse_clock)
            time.sleep(0.01)
        told = [words for words in session.warnings if "ms or ns in place of us" in words]
    assert any(flagged) == bool(told) == (unit != "us") and len(told) <= 1
    assert not any(flagged[:50])


def test_nwb_files_hold_the_units(url, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    with papilla.Session(url, tier="half-space", effects=["spikes"]) as session:
        trains = papilla.SpikeTrains(session.ready)
        for ms in range(60):
            trains.add(session.render(bump(500.0 * ms), client_time_us=1000 * ms))
    trains.save_nwb(tmp_path / "spikes.nwb")
    with pynwb.NWBHDF5IO(str(tmp_path / "spikes.nwb"), "r") as file:
        units = file.read().units
        assert len(units) == len(trains.classes)
        assert sum(len(units["spike_times"][n]) for n in range(len(units))) == len(trains.unit)


def test_figure_4_is_drawn(url, tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path(str(EXAMPLES / "figure4.py"))
    assert (tmp_path / "figure4.png").stat().st_size > 20_000
    assert len(names["indentations"]) == 3
    assert os.environ["PAPILLA_URL"] == url


def test_numbers_that_no_frame_can_hold_are_named():
    """They ended in `struct.error`, or in another finger's."""
    pose = np.zeros((1, 7), np.float32)
    for finger in (256, -1, 1.5, None):
        for encode in (
            lambda: wire.encode_rows("objects", pose, None, finger, 1, 1),  # noqa: B023
            lambda: wire.encode_not_tracked(finger, 1, 1),  # noqa: B023
        ):
            with pytest.raises(papilla.BadFrame, match="finger") as refused:
                encode()
            assert refused.value.member == "finger"
    whole = np.zeros((224, 224), np.float32)
    with pytest.raises(papilla.BadFrame, match="deadline_us"):
        wire.encode(whole, wire.WHOLE, "f32", 1, 0, 2**32)
    with pytest.raises(papilla.BadFrame, match="client_time_us"):
        wire.encode(whole, wire.WHOLE, "f32", 1, -1, 0)


def test_what_no_message_holds_is_named(url):
    ball = {"shape": "sphere", "radius_mm": 10}
    with pytest.raises(papilla.BadInput, match=r"objects\[0\]: this is a shape"):
        papilla.Session(url, input="objects", objects=[ball])
    with pytest.raises(papilla.BadInput, match=r"objects\[0\].shape.radius_mm: a finite number"):
        papilla.Session(url, input="objects", objects=[{"shape": ball | {"radius_mm": float("nan")}}])
    pose = [11.25, 0, -16.2, 0, 0, 0, 1]
    with papilla.Session(url, input="objects", objects={"shape": ball}, map=False, force_target=True) as session:
        assert session.touch(pose, net=([0, 0, 1], 0.5)).touch.force_n[2] == pytest.approx(0.5, rel=0.05)
        for net in ({"direction": [0, 0, 1], "force_n": 1}, [0, 0, 1], ([0, 1], 1.0), 1.0):
            with pytest.raises(papilla.BadInput, match=r"net: .*as \(\[0, 0, 1\], 1\.0\)"):
                session.touch(pose, net=net)
    with papilla.Session(url, sample_type="f16") as session:
        assert session.render(bump(6e4)).status == "ok"
        with pytest.raises(papilla.BadInput, match=r"greatest value is 80000, and f16 ends at 65504.*'f32'"):
            session.render(np.full((224, 224), 8e4))


def test_what_needs_a_service_says_so(monkeypatch):
    with pytest.raises(papilla.BadInput, match=r"papilla\.local"):
        papilla.Session("local")
    with pytest.raises(papilla.BadInput, match="no /v1/presses: give the address of a service"):
        papilla.indentation(url="local")
    for there in (None, object()):
        monkeypatch.setattr("papilla.http.find_spec", lambda _, there=there: there)
        for call in (papilla.Session, lambda url: papilla.sed(bump(), url=url), papilla.Atlas.load):
            with pytest.raises(papilla.Unreachable, match="is papilla-server running there") as refused:
                call("127.0.0.1:9")
            # Only where this process could compute.
            assert ("url='local'" in str(refused.value)) == (there is not None)


def test_sed_is_sed_and_rates_are_rates():
    """Units of u16: each has a scale of its own; what is not there is a named error."""
    head = wire.HEADER.pack(b"PPL1", 3, 2, 2, 0, 7, 2, 1, 5, 9, 2.0, 3, 4, 0, 0, 0, 96, 0)
    rates = np.full(224 * 224, 30, "<u2")
    body = np.array([1.5], "<f4").tobytes() + bytes(12) + np.array([0.5], "<f4").tobytes() + bytes(12)
    message = head + body + rates.tobytes() + np.array([100, 200], "<u2").tobytes()
    sections = [
        {"name": "point_rates", "offset": 48, "bytes": 4},
        {"name": "rates", "offset": 64, "bytes": 16 + 2 * 224 * 224},
        {"name": "map", "offset": 80 + 2 * 224 * 224, "bytes": 2 * 224 * 224},
    ]
    header = wire.decode(message)
    answer = answers.read(message, header, {"sections": sections}, "nano")
    assert answer.sed[4, 3] == 200 and answer.sed[4, 4] == 400 and answer.sed.sum() == 600
    assert answer.rates_hz.shape == (224, 224) and (answer.rates_hz == 15).all()
    assert answer.point_rates_hz.tolist() == [1.5] and answer.not_tracked and answer.coarse_clock
    sections.pop(1)
    plain = answers.read(message, header, {"sections": sections}, "nano")
    with pytest.raises(papilla.NotCarried, match="afferents"):
        _ = plain.rates_hz
