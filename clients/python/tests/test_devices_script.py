"""The script of devices, clients/conformance/devices.json, as every client runs it: on its own clock, no service."""

import json
from pathlib import Path

import numpy as np
import pytest

import papilla
from papilla import devices
from papilla.answer import Answer, Spikes, Summary, Touch

SCRIPT = json.loads((Path(__file__).resolve().parents[2] / "conformance" / "devices.json").read_text())
OPTIONS = ("fingers", "max_hz", "hold_s", "fade_s")


def number(said):
    return float(said) if isinstance(said, str) else said


def device_of(said, clock):
    options = {name: said[name] for name in OPTIONS if name in said}
    if "force" in said:
        read = devices.force(**{name: number(value) for name, value in said["force"].items()})
    elif "actuators" in said:
        read = devices.actuators(**said["actuators"])
    else:
        rate = said["spike_rate"]
        read = devices.SpikeRate({"units": [{"class": name} for name in rate["units"]]}, full_hz=rate["full_hz"])
    return devices.Device(read, clock=clock, **options)


def answer_of(said):
    answer = Answer(sequence=1, status=said.get("status", "ok"), client_time_us=said.get("client_time_us", 0))
    answer.finger = said.get("finger", 0)
    answer.no_contact, answer.not_tracked = said.get("no_contact", False), said.get("not_tracked", False)
    if "force_n" in said:
        force_n = tuple(number(value) for value in said["force_n"])
        answer.touch = Touch(force_n, (0, 0, 0), 0.0, (0, 0, 0), *(0.0,) * 6)
    if "summary_force_n" in said:
        answer.summary = Summary(said["summary_force_n"], *(0.0,) * 15)
    if "actuators" in said:
        answer.actuators = np.array(said["actuators"], np.float32)
    if "spikes" in said:
        units = np.array(said["spikes"], np.uint16)
        answer.spikes = Spikes(units, np.zeros(len(units), np.int64), len(units))
    return answer


def compare(command, due):
    if due is None:
        assert command is None
        return
    assert command.levels == pytest.approx(np.array(due["levels"]), abs=SCRIPT["tolerance"])
    assert command.amplitude == pytest.approx(due["amplitude"], abs=SCRIPT["tolerance"])
    assert command.duration_s == pytest.approx(due["duration_s"], abs=SCRIPT["tolerance"])


@pytest.mark.parametrize("case", SCRIPT["cases"], ids=[case["name"] for case in SCRIPT["cases"]])
def test_a_case_of_the_script(case):
    now_s = [0.0]
    if case.get("refused"):
        with pytest.raises(papilla.BadInput):
            device_of(case["device"], lambda: now_s[0])
        return
    device = device_of(case["device"], lambda: now_s[0])
    for step in case["steps"]:
        now_s[0] = step["at_s"]
        if "poll" in step:
            compare(device.poll(), step["poll"])
        elif "stop" in step:
            compare(device.stop(), step["stop"])
        elif "refused" in step or "not_carried" in step:
            with pytest.raises(papilla.BadInput if "refused" in step else papilla.NotCarried):
                device.feed(answer_of(step["feed"]))
        else:
            device.feed(answer_of(step["feed"]))
