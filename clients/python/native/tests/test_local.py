"""A session in process has the methods of a session with a service, and its answers, bit for bit."""

import dataclasses
import inspect
import json
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import numpy as np
import pytest

import papilla

BALL = {"shape": {"shape": "sphere", "radius_mm": 10.0}}
RUBBED = BALL | {"friction": 0.5}
POSES = [[11.25, 0.0, -16.53 + depth_mm, 0, 0, 0, 1] for depth_mm in (-0.2, 0.2, 0.5, 0.8, 0.8, 0.3)]
# What differs from one run of the same program to the next.
TIMES = {"total_us", "queue_us", "infer_us"}


def same(here, there):
    """Whether two answers are the same but for what time they took."""
    for field in dataclasses.fields(papilla.Answer):
        if field.name in TIMES:
            continue
        one, other = getattr(here, field.name), getattr(there, field.name)
        if field.name == "touch" and one is not None:
            one, other = one._replace(solve_us=0.0), other._replace(solve_us=0.0)
        parts = [(one, other)]
        if isinstance(one, tuple):
            parts = list(zip(one, other, strict=True))
        for a, b in parts:
            if isinstance(a, np.ndarray):
                assert a.dtype == b.dtype and a.shape == b.shape, field.name
                assert a.tobytes() == b.tobytes(), field.name
            else:
                assert type(a) is type(b) and repr(a) == repr(b), field.name


def both(url, hello, frames):
    """Sends frames to a service and in process; gives both answers to each."""
    with papilla.Session(url, **hello) as there, papilla.local(**hello) as here:
        for member in ("tier", "sections", "sample_type", "vertices", "atlas_hash", "method", "units", "warnings"):
            assert here.ready.get(member) == there.ready.get(member), member
        for frame in frames:
            pair = frame(here), frame(there)
            same(*pair)
            yield pair


def maps(pressure_pa, **more):
    # A clock of the test's own, so that what goes by time goes the same way.
    for number, share in enumerate((0.0, 0.3, 1.0, 1.7, 0.6)):
        time_us = 1_000_000 + 10_000 * number
        yield lambda session, s=share, t=time_us: session.render(pressure_pa * s, client_time_us=t, **more)


@pytest.mark.parametrize(
    "hello",
    [
        {"tier": "nano"},
        {"tier": "small", "effects": ["summary", "afferents"]},
        {"tier": "nano", "effects": ["contact_window"], "answer_sample_type": "u16"},
        {"tier": "nano", "effects": ["spikes", "relaxation"], "map": False},
        {"tier": "nano", "answer_layout": "vertices"},
        *({"tier": "small-maps", "sample_type": kind} for kind in ("f16", "u16", "u8")),
    ],
    ids=lambda hello: "-".join(str(value) for value in hello.values()),
)
def test_maps_are_the_same_to_the_bit(url, pressure_pa, hello):
    answers = list(both(url, hello, maps(pressure_pa)))
    assert [here.status for here, _ in answers] == ["ok"] * 5
    assert answers[0][0].no_contact and not answers[2][0].no_contact


def test_parts_of_maps_are_the_same_to_the_bit(url, pressure_pa):
    part, window = pressure_pa[90:120, 100:140], (100, 90, 40, 30)
    hello = {"tier": "nano"}
    answers = [here for here, _ in both(url, hello, maps(part, window=window))]
    with papilla.local(**hello) as session:
        assert np.array_equal(answers[2].sed, session.render(pressure_pa).sed)


@pytest.mark.parametrize("hello", [{}, {"pressure": "map", "shear": True}, {"force_target": True}], ids=str)
def test_touch_is_the_same_to_the_bit(url, hello):
    net = ((0.0, 0.0, 1.0), 0.4) if "force_target" in hello else None
    hello = {"tier": "nano", "input": "objects", "objects": [RUBBED if "shear" in hello else BALL], **hello}

    def frames():
        for number, pose in enumerate(POSES):
            time_us = 1_000_000 + 10_000 * number
            yield lambda s, p=pose, t=time_us: s.send_poses(p, net=net, client_time_us=t).result()
        yield lambda s: s.touch(None)

    answers = []
    with papilla.Session(url, **hello) as there, papilla.local(**hello) as here:
        assert here.ready["sections"] == there.ready["sections"]
        for frame in frames():
            one, other = frame(here), frame(there)
            if not one.not_tracked:
                same(one, other)
            answers.append(one)
    assert answers[3].touch.force_n[2] > 0.05 and answers[-1].not_tracked


def test_gaps_are_the_same_to_the_bit(url):
    rows, columns = np.mgrid[:224, :224]
    depth_mm = (0.8 - ((rows - 104) ** 2 + (columns - 112) ** 2) / 1000.0).astype(np.float32)
    frames = [lambda s, d=d: s.send_gaps(depth_mm - d, client_time_us=5).result() for d in (0.0, 0.2, 0.5)]
    answers = list(both(url, {"tier": "nano", "input": "gaps", "input_layout": "map"}, frames))
    assert answers[0][0].touch.area_mm2 > 0


def test_what_cannot_be_is_refused_alike(url, pressure_pa):
    bad = pressure_pa.copy()
    bad[3, 3] = np.nan
    frames = [lambda s: s.render(bad, client_time_us=1), lambda s: s.render(-pressure_pa, client_time_us=2)]
    for here, _ in both(url, {"tier": "nano", "out_of_range": "refuse"}, frames):
        assert (here.status == "error" and here.problem.field == "payload") or here.problem.message
    for hello in ({"tier": "none"}, {"effects": ["none"]}, {"input": "objects"}, {"atlas_hash": "0"}):
        found = []
        for opened in (lambda h=hello: papilla.Session(url, **h), lambda h=hello: papilla.local(**h)):
            with pytest.raises(papilla.PapillaError) as refused:
                opened()
            found.append(refused.value)
        assert all(isinstance(each, papilla.Refused | papilla.BadModels) for each in found)
    for member in ("budget_us", "stale_after_us"):
        with pytest.raises(papilla.Refused, match="of a service"):
            papilla.local(**{member: 9000})


def test_a_series_is_the_same_to_the_bit(url, pressure_pa):
    frames, times = np.stack([pressure_pa * share for share in np.linspace(0, 1, 12)]), np.arange(12) * 0.01
    hello = {"tier": "nano", "effects": ["afferents"]}
    with papilla.Session(url, **hello) as there, papilla.local(**hello) as here:
        one, other = here.series(frames, times), there.series(frames, times)
    assert one.sed.tobytes() == other.sed.tobytes() and one.rates_hz.tobytes() == other.rates_hz.tobytes()


def test_both_sessions_have_the_same_methods():
    def methods(kind):
        public = {name: getattr(kind, name) for name in dir(kind) if not name.startswith("_")}
        return {name: inspect.signature(value) if callable(value) else None for name, value in public.items()}

    ours, theirs = methods(papilla.LocalSession), methods(papilla.Session)
    assert set(theirs) <= set(ours) | {"timeout_s"}
    assert {name: ours.get(name) for name in theirs if name != "timeout_s"} == {
        name: signature for name, signature in theirs.items() if name != "timeout_s"
    }


def test_new_terms_and_the_end(pressure_pa):
    with papilla.local(tier="nano") as session:
        before = session.render(pressure_pa).sed
        assert session.renew(tier="small-maps")["tier"] == "small-maps" and session.hello == {"tier": "small-maps"}
        with pytest.raises(papilla.Refused):
            session.renew(effects=["none"])
        assert session.render(pressure_pa).tier == "small-maps"
        assert not np.array_equal(session.render(pressure_pa).sed, before)
    assert not session.connected
    with pytest.raises(papilla.Closed):
        session.render(pressure_pa)


def test_answers_are_arrays_that_can_be_written_to_and_stay(pressure_pa):
    with papilla.local(tier="nano") as session:
        first = session.render(pressure_pa).sed
        kept = first.copy()
        session.render(pressure_pa * 0.5)
        assert np.array_equal(first, kept)
        first += 1


def test_a_series_without_a_service_is_that_of_the_service(url, pressure_pa, monkeypatch):
    frames, times_s = np.linspace(0, 1, 6)[:, None, None] * pressure_pa, 0.01 * np.arange(6)
    for more in ({}, {"effects": ["afferents", "spikes"]}):
        here = papilla.render(frames, times_s, url="local", lanes=None, **more)
        there = papilla.render(frames, times_s, url=url, **more)
        assert (
            here.sed.tobytes() == there.sed.tobytes()
            and here["error_sed_p90"].tobytes() == there["error_sed_p90"].tobytes()
        )
    assert here.spikes.time_us.tobytes() == there.spikes.time_us.tobytes()
    # Stills go over several threads, in any order, to the same bits.
    stills = papilla.render(frames, url="local", lanes=3)
    assert stills.sed.tobytes() == papilla.render(frames, url=url, lanes=1).sed.tobytes()
    atlas = papilla.Atlas.load("local")
    assert atlas.hash == papilla.Atlas.load(url).hash
    with pytest.raises(papilla.BadInput, match="at a service"):
        papilla.Atlas.load("local", finger="anna")
    monkeypatch.setenv("PAPILLA_MODELS", "nowhere")
    with pytest.raises(papilla.BadModels, match="nowhere"):
        papilla.render(frames, url="local")


def series_of(kind):
    """Frames of a series, and its times."""
    rows, columns = np.mgrid[:224, :224]
    if kind == "objects":
        return POSES, None
    if kind == "gaps":
        return np.stack([0.8 - ((rows - 104) ** 2 + (columns - 112) ** 2) / 1000.0 - d for d in (0.0, 0.2, 0.5)]), None
    bump = 9e3 * np.exp(-((columns - 118.0) ** 2 + (rows - 105.0) ** 2) / 250)
    return np.linspace(0, 1, 20)[:, None, None] * bump, 0.01 * np.arange(20)


PIN = {"input": "sed", "drive": "formula", "radius_mm": 1.0, "gain": 0.002, "threshold": 50, "max": 1,
       "actuators": [{"at": {"px": [112, 90]}}]}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "hello"),
    [
        ("pressure", {"tier": "nano", "effects": ["summary", "afferents"]}),
        ("pressure", {"tier": "nano", "effects": ["afferents"], "answer_sample_type": "f16", "sample_type": "u16"}),
        ("pressure", {"tier": "nano", "effects": ["afferents"], "answer_sample_type": "u8"}),
        ("pressure", {"tier": "nano", "effects": ["afferents"], "answer_layout": "vertices"}),
        ("pressure", {"tier": "nano", "answer_layout": "vertices", "answer_sample_type": "u16"}),
        ("pressure", {"tier": "nano", "effects": ["contact_window"]}),
        ("pressure", {"tier": "nano", "effects": ["points", "actuators"], "map": False,
                      "points": [{"px": [112, 90]}, {"px": [118, 105]}], "actuators": PIN}),
        ("objects", {"tier": "nano", "objects": [RUBBED], "pressure": "map", "shear": True, "displacement": True}),
        ("objects", {"objects": [BALL], "pressure": "vertices", "stiffness": True, "map": False}),
        ("gaps", {"tier": "nano"}),
    ],
    ids=lambda hello: "-".join(str(value) for value in hello.values())[:60] if isinstance(hello, dict) else hello,
)  # fmt: skip
def test_all_quantities_of_a_series_are_those_of_the_service(url, kind, hello):
    frames, times_s = series_of(kind)
    here, there = (papilla.render(frames, times_s, url=at, input=kind, **hello) for at in ("local", url))
    assert list(here.values) == list(there.values) and len(here.values) > 4
    # What tells of this run's time.
    clocks = {"total_us", "queue_us", "infer_us", "touch_solve_us"}
    for name, values in there.values.items():
        mine = here[name]
        assert (mine.dtype, mine.shape) == (values.dtype, values.shape), name
        assert name in clocks or mine.tobytes() == values.tobytes(), name
    assert (here.flags.tobytes(), list(here.tier)) == (there.flags.tobytes(), list(there.tier))
    assert here["total_us"].all() and here.warnings == there.warnings


def test_a_series_in_process_names_the_frame_that_is_refused(pressure_pa):
    frames = np.repeat(pressure_pa[None], 40, axis=0)
    frames[29] *= 100
    told = []
    with pytest.raises(papilla.FrameFailed, match="frame 29") as failed:
        terms = {"tier": "nano", "out_of_range": "refuse", "lanes": 1}
        papilla.render(frames, url="local", progress=lambda *done: told.append(done), **terms)
    assert failed.value.frame == 29 and told[-1][1] == 40 and 20 < told[-1][0] < 30
    with papilla.local(tier="nano") as session:
        assert session.series(frames).flagged("out_of_range") == 1
        assert any("beyond" in words or "range" in words for words in session.warnings), session.warnings


@pytest.fixture(scope="module")
def fingers(tmp_path_factory):
    """A folder with another finger than the default one, whose own default is another network."""
    folder = tmp_path_factory.mktemp("fingers")
    other, models = folder / "other", papilla.model.folder(None)
    other.mkdir()
    for file in (
        "atlas.json",
        "finger.contact",
        "finger.toml",
        "contact.json",
        "errors.json",
        "nano.json",
        "nano.onnx",
    ):
        if (models / file).exists():
            (other / file).symlink_to(models / file)
    index = json.loads((models / "index.json").read_text())
    index |= {"default": "nano", "models": ["nano"]}
    for member in ("default_for_pressure", "on_demand"):
        index.pop(member, None)
    (other / "index.json").write_text(json.dumps(index))
    return folder


@pytest.fixture(scope="module")
def served(fingers):
    """A service with that finger."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    program = Path(sys.executable).with_name("papilla-server")
    command = [program, "--bind", f"127.0.0.1:{port}", "--fingers", fingers, "--log", "error"]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        for _ in range(600):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=5).close()
                break
            except OSError:
                assert running.poll() is None
                time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        running.terminate()
        running.wait(30)


def test_fingers_by_name_are_the_same_to_the_bit(served, fingers):
    hello = {"input": "objects", "objects": [BALL], "fingers": [{"name": "other", "width": 1.1}, {}, {"name": "other"}]}
    hello["effects"] = ["summary", "afferents"]
    told = ("name", "tier", "atlas_hash", "vertices", "pressure_max_pa", "sed_scale_j_per_m3", "method")
    with papilla.Session(served, **hello) as there, papilla.local(bundles=fingers, **hello) as here:
        for member in ("tier", "sections", "vertices", "fingers", "method", "warnings"):
            assert here.ready.get(member) == there.ready.get(member), member
        for one, other in zip(here.ready["finger_terms"], there.ready["finger_terms"], strict=True):
            assert {name: one[name] for name in told} == {name: other[name] for name in told}
        for number, pose in enumerate(POSES):
            for finger in (0, 1, 2):
                asked = {"finger": finger, "client_time_us": 1_000_000 + 10_000 * number}
                pair = [session.send_poses(pose, **asked).result() for session in (here, there)]
                same(*pair)
                assert pair[0].tier == ("small" if finger == 1 else "nano")
    # Those of sessions with one of the fingers each.
    with (
        papilla.local(bundles=fingers, **hello) as here,
        papilla.local(models=fingers / "other", **hello_of_one()) as one,
    ):
        assert here.touch(POSES[3], finger=2).sed.tobytes() == one.touch(POSES[3]).sed.tobytes()
        assert here.touch(POSES[3], finger=1).sed.tobytes() != one.touch(POSES[3]).sed.tobytes()


def hello_of_one():
    return {"input": "objects", "objects": [BALL], "effects": ["summary", "afferents"]}


def test_fingers_that_are_not_there_are_named(fingers):
    hello = hello_of_one() | {"fingers": [{"name": "other"}, {"name": "nobody"}]}
    with pytest.raises(papilla.Refused, match="'nobody' was loaded, only default, other") as refused:
        papilla.local(bundles=fingers, **hello)
    assert refused.value.field == "fingers[1].name"
    with pytest.raises(papilla.Refused, match="only default"):
        papilla.local(**hello)
    with pytest.raises(papilla.Refused, match="nobody"):
        papilla.local(bundles=fingers, **hello_of_one(), fingers=[{"name": "../nobody"}])


def test_new_terms_without_a_tier_are_those_of_a_new_session(pressure_pa):
    with papilla.local(tier="nano") as session:
        assert session.renew()["tier"] == "small-maps"
        assert session.renew(tier="small-maps")["tier"] == "small-maps"
