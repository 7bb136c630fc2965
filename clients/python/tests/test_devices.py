"""What haptic devices get of a session of the real service: in strength, in rate, and when it is gone."""

import json
import os
import subprocess
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft4Validator, Draft202012Validator
from referencing import Registry, Resource

import papilla
from papilla import devices, hjif

BALL = {"shape": {"shape": "sphere", "radius_mm": 10.0}}
SCHEMA = json.loads((Path(__file__).parent / "hjif.schema.json").read_text())
# Folder of the schemas that MPEG publishes, which state no licence and so are not here (docs/guides/devices.md).
PUBLISHED = os.environ.get("PAPILLA_HJIF_SCHEMAS")
PAD = {"radius_mm": 1.0, "gain": 0.0005, "actuators": [{"at": {"mm": [x, 0.0, -6.5]}} for x in (8.0, 11.25, 14.5)]}


class Clock:
    """A clock of the test's own: how old an answer is does not hang on how busy the machine is."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


def pose(depth_mm):
    return [11.25, 0.0, -16.53 + depth_mm, 0, 0, 0, 1]


@pytest.fixture
def session(url):
    with papilla.Session(
        url,
        input="objects",
        objects=[BALL],
        map=False,
        tier="half-space",
        effects=["actuators", "spikes"],
        actuators=PAD,
    ) as opened:
        yield opened


def test_one_amplitude_follows_the_force(session):
    clock = Clock()
    device = devices.Device(devices.force(full_n=1.0, threshold_n=0.01), clock=clock)
    assert device.poll() is None, "silent before the first answer"
    seen = []
    for depth_mm in (0.0, 0.3, 0.6, 0.9, 3.0):
        clock.now_s += 0.02
        answer = session.touch(pose(depth_mm))
        device.feed(answer)
        command = device.poll()
        size_n = np.linalg.norm(answer.touch.force_n)
        seen.append(command.amplitude if command else 0.0)
        assert seen[-1] == pytest.approx(np.clip((size_n - 0.01) / 0.99, 0.0, 1.0), abs=1e-12)
    assert seen[0] == 0.0 and all(a < b for a, b in pairwise(seen)) and seen[-1] == 1.0


def test_it_fades_to_zero_when_frames_stop(session):
    clock = Clock()
    device = devices.Device(devices.force(full_n=1.0), hold_s=0.05, fade_s=0.1, max_hz=1000.0, clock=clock)
    device.feed(session.touch(pose(0.6)))
    begun = device.poll().amplitude
    assert begun > 0.05
    sent = []
    for _ in range(20):
        clock.now_s += 0.01
        if command := device.poll():
            sent.append(command.amplitude)
            assert command.duration_s == pytest.approx(0.15), "it ends by itself if the program hangs"
    assert sent[4] == pytest.approx(begun) and sent[9] == pytest.approx(begun / 2)
    assert sent[-1] == 0.0 and sent.count(0.0) == 1, "one command of zero, then nothing more"


def test_lost_tracking_drives_nothing_at_once(session):
    device = devices.Device(devices.force(full_n=1.0), clock=Clock())
    device.feed(session.touch(pose(0.6)))
    assert device.levels().max() > 0.05
    device.feed(session.touch(None))
    assert device.levels().max() == 0.0


def test_a_late_answer_counts_as_none(url):
    clock = Clock()
    device = devices.Device(devices.force(full_n=10.0), clock=clock)
    pressure_pa = np.zeros((224, 224), np.float32)
    pressure_pa[95:115, 105:130] = 8e3
    with papilla.Session(url, tier="half-space", effects=["summary"], map=False) as session:
        felt = session.render(pressure_pa)
        device.feed(felt)
        assert device.levels()[0, 0] == pytest.approx(felt.summary.force_n / 10.0) and felt.summary.force_n > 0.1
        clock.now_s += 0.2
        late = session.render(pressure_pa, deadline_us=1)
    assert late.status == "late"
    device.feed(late)
    assert device.levels().max() == 0.0


def test_no_more_commands_than_the_device_takes(session):
    clock = Clock()
    device = devices.Device(devices.force(full_n=1.0), max_hz=20.0, clock=clock)
    answers = [session.touch(pose(depth_mm)) for depth_mm in (0.2, 0.4, 0.6)]
    at_s = []
    for step in range(1000):
        clock.now_s = 100.0 + 1e-3 * step
        device.feed(answers[step % 3])
        if device.poll():
            at_s.append(clock.now_s)
    assert len(at_s) == 20 and min(np.diff(at_s)) >= 0.05 - 1e-9


def test_an_array_for_a_glove(url):
    with papilla.Session(
        url, input="objects", objects=[BALL], fingers=[{}, {}], map=False, tier="half-space",
        effects=["actuators"], actuators=PAD,
    ) as session:  # fmt: skip
        glove = devices.Device(devices.actuators(), fingers=2, clock=Clock())
        pressed = session.touch(pose(0.8), finger=1)
        glove.feed(session.touch(pose(-5.0), finger=0))
        glove.feed(pressed)
        levels = glove.poll().levels
    assert levels.shape == (2, 3) and not levels[0].any()
    assert levels[1] == pytest.approx(pressed.actuators) and levels[1, 1] == levels[1].max() > 0.05
    with pytest.raises(papilla.BadInput, match="finger"):
        devices.Device(devices.actuators(), clock=Clock()).feed(pressed)


def test_spikes_of_fast_units_drive_at_changes(session):
    clock = Clock()
    device = devices.Device(devices.SpikeRate(session.ready, full_hz=5.0), clock=clock)
    levels = []
    for ms in range(0, 300, 5):
        # Down within 50 ms, then held.
        sent = session.send_poses(pose(min(0.6, 0.012 * ms)), client_time_us=1000 * ms + 1)
        device.feed(sent.result(30))
        levels.append(device.levels().max())
        clock.now_s += 0.005
    moving, held = np.mean(levels[1:11]), np.mean(levels[40:])
    assert moving > 0.02 and held < 0.2 * moving


def test_a_lost_service_leaves_no_device_on():
    command = [os.environ["PAPILLA_SERVER"], "--bind", "127.0.0.1:0", "--json", "--log", "off", "--calibration-ms", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as service:
        try:
            port = json.loads(service.stdout.readline())["port"]
            device = devices.Device(devices.force(full_n=1.0))
            with papilla.Session(
                f"http://127.0.0.1:{port}", input="objects", objects=[BALL], map=False, timeout_s=1.0
            ) as session:
                device.feed(session.touch(pose(0.6)))
                last = device.poll()
                assert last.amplitude > 0.05
                service.kill()
                service.wait(timeout=10)
                try:
                    device.feed(session.touch(pose(0.6)))
                except papilla.PapillaError as error:
                    print(error)
                end = time.monotonic() + 10
                while last.amplitude > 0.0 and time.monotonic() < end:
                    last = device.poll() or last
                    time.sleep(0.005)
        finally:
            service.kill()
    assert last.amplitude == 0.0
    assert device.stop().levels.max() == 0.0


def played(band, ticks):
    """The amplitude of a band at TICKS as a player reads it: straight lines between keyframes, 0 outside of effects."""
    found = np.zeros(len(ticks))
    for effect in band["effects"]:
        at = effect["position"] + np.array([key["relative_position"] for key in effect["keyframes"]])
        assert (np.diff(at) > 0).all()
        inside = (ticks >= at[0]) & (ticks <= at[-1])
        found[inside] = np.interp(ticks[inside], at, [key["amplitude_modulation"] for key in effect["keyframes"]])
    return found


def published():
    """The validator of the published schemas, which name each other by file."""
    files = {file.name: json.loads(file.read_text("utf-8")) for file in Path(PUBLISHED).glob("*.schema.json")}
    registry = Registry().with_resources((name, Resource.from_contents(schema)) for name, schema in files.items())
    return Draft4Validator(files["MPEG_haptics.schema.json"], registry=registry)


def checked(path):
    """The file, held against the schema and what a schema cannot say: numbers of channels are unique."""
    file = json.loads(Path(path).read_text(encoding="utf-8"))
    Draft202012Validator(SCHEMA).validate(file)
    if PUBLISHED:
        published().validate(file)
    for perception in file["perceptions"]:
        numbers = [channel["id"] for channel in perception["channels"]]
        assert len(set(numbers)) == len(numbers)
    return file


def test_a_recorded_touch_as_hjif(url, tmp_path):
    times_s = 0.01 * np.arange(80)
    depth_mm = 0.8 * np.sin(2 * np.pi * times_s / 0.5)
    series = papilla.render(
        [pose(depth) for depth in depth_mm], times_s, url=url, input="objects", objects=[BALL], map=False,
        tier="half-space", effects=["actuators"], actuators=PAD,
    )  # fmt: skip
    force_n = np.linalg.norm(series.force_n, axis=1)
    hjif.write_series(tmp_path / "touch.hjif", series, description="a ball, twice", finger="Index")
    file = checked(tmp_path / "touch.hjif")
    (channel,) = file["perceptions"][0]["channels"]
    assert file["perceptions"][0]["perception_modality"] == "Force" and channel["body_part_target"] == ["Index"]
    (band,) = channel["bands"]
    ticks = np.round(1000 * times_s)
    assert channel["gain"] * played(band, ticks) == pytest.approx(force_n, abs=1e-6 * force_n.max())
    assert force_n.max() > 0.1 and played(band, ticks[-1:] + 20)[0] == 0.0, "it ends at 0"

    hjif.write_series(tmp_path / "glove.hjif", series, frequency_hz=170.0)
    channels = checked(tmp_path / "glove.hjif")["perceptions"][0]["channels"]
    for number, channel in enumerate(channels):
        assert played(channel["bands"][0], ticks) == pytest.approx(series["actuators"][:, number], abs=1e-6)
        assert {key["frequency_modulation"] for key in channel["bands"][0]["effects"][0]["keyframes"]} == {170}


def test_long_records_and_many_channels(tmp_path):
    # Ten minutes, with a pause of two: more than the 16 bits of one effect, and the level that 130 channels need.
    times_s = np.concatenate([np.arange(0, 240, 8.0), np.arange(360, 600, 8.0)])
    levels = 0.5 + 0.5 * np.sin(times_s[:, np.newaxis] + np.arange(130))
    hjif.write(tmp_path / "long.hjif", times_s, levels, unit="intensity", frequency_hz=100)
    file = checked(tmp_path / "long.hjif")
    channels = file["perceptions"][0]["channels"]
    assert file["level"] == 2 and len(channels[0]["bands"][0]["effects"]) > 5
    for number in (0, 129):
        assert played(channels[number]["bands"][0], 1000 * times_s) == pytest.approx(levels[:, number], abs=1e-6)


@pytest.mark.parametrize(
    "times_s, levels, how, why",
    [
        ([0.0, 0.0], [0.1, 0.2], {}, "rise"),
        ([0.0, 1.0], [0.1], {}, "frames are due"),
        ([0.0, 1.0], [0.1, np.nan], {}, "finite"),
        ([0.0, 1.0], [0.1, -1.0], {}, "negative"),
        ([0.0, 1.0], [0.1, 2.0], {"unit": "intensity", "frequency_hz": 100}, "above 1"),
        ([0.0, 1.0], [0.1, 0.2], {"unit": "intensity"}, "Hz"),
        ([0.0, 1.0], [0.1, 0.2], {"unit": "pa"}, "known"),
        ([0.0, 1e6], [0.1, 0.2], {}, "at most"),
    ],
)
def test_what_no_file_can_hold_is_refused(tmp_path, times_s, levels, how, why):
    with pytest.raises(papilla.BadInput, match=why):
        hjif.write(tmp_path / "x.hjif", times_s, levels, **how)
    assert not list(tmp_path.iterdir())


def test_the_schema_refuses_what_the_reference_reader_refuses():
    good = hjif.document([0.0, 0.1], [0.0, 1.0])
    Draft202012Validator(SCHEMA).validate(good)
    for change in (
        {"version": "2021"},
        {"timescale": 48000},
        {"level": 3},
        {"profile": "Other"},
        {"syncs": None},
        {"date": "today"},
        {"date": "2026-11-29"},
        {"perceptions": []},
    ):
        assert list(Draft202012Validator(SCHEMA).iter_errors({**good, **change})), change
