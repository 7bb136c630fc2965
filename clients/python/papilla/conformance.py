"""Runs the conformance script with this client (docs/reference/conformance.md): `python -m papilla.conformance`.

Sessions are driven through `Session`, which drives `AsyncSession`.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
import urllib.request
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import frames
from .address import Address, clean_token
from .answer import Answer
from .atlas import Atlas, Contact
from .errors import BadAddress, NotCarried, Refused
from .http import get_json, post
from .sync import Session
from .wire import SIDE_PX, Map

Step = dict[str, Any]


class Nonconformity(Exception):
    """What a step found otherwise than expected."""


def must(good: bool, what: str) -> None:
    if not good:
        raise Nonconformity(what)


def pressure(pattern: Step, share: float = 1.0) -> Map:
    v, u = np.mgrid[:SIDE_PX, :SIDE_PX] + 0.5
    map_pa = np.zeros((SIDE_PX, SIDE_PX))
    for u0, v0, sigma, peak in pattern.get("gaussians", []):
        map_pa += peak * np.exp(-((u - u0) ** 2 + (v - v0) ** 2) / (2 * sigma**2))
    if "disc" in pattern:
        u0, v0, radius, value = pattern["disc"]
        map_pa += value * ((u - u0) ** 2 + (v - v0) ** 2 <= radius**2)
    map_pa = np.where(map_pa < 1.0, 0.0, share * map_pa)
    drawn = map_pa.astype(np.float32)
    if "bad" in pattern:
        row, column, value = pattern["bad"]
        drawn[row, column] = float(value)
    return drawn


def near(what: str, found: float, due: list[float]) -> None:
    must(abs(found - due[0]) <= due[1], f"{what} is {found}, {due[0]} +- {due[1]} is due")


def check_list(what: str, found: Any, due: list[list[float]]) -> None:
    must(found is not None and len(found) == len(due), f"{what}: {len(due)} values are due")
    for number, (value, pair) in enumerate(zip(found, due, strict=True)):
        near(f"{what}[{number}]", float(value), pair)


def check_errors(expect: Step, answer: Answer) -> None:
    """How wrong the answer says that it may be: what is `null` is infinite."""
    estimate = answer.error_estimate
    for name, found, due in zip(estimate._fields, estimate, expect["error_estimate"], strict=True):
        if due is None:
            must(found == math.inf, f"{name} is {found}, infinity is due")
        else:
            near(name, found, due)


def check_map(expect: Step, map_: Map) -> None:
    for row, column, value, tolerance in expect.get("pixels", []):
        near(f"pixel {row}, {column}", float(map_[row, column]), [value, tolerance])
    if "sum" in expect:
        near("sum", float(map_.sum(dtype=np.float64)), expect["sum"])
    if "max" in expect:
        near("max", float(map_.max()), expect["max"])


def check_problem(expect: Step, code: str, field: str | None) -> None:
    must(code == expect["code"], f"the code is {code}, {expect['code']} is due")
    if "field" in expect:
        must(field == expect["field"], f"the field is {field}, {expect['field']} is due")


_FLAGS = ("out_of_range", "no_contact", "unfamiliar", "cut_off", "not_tracked", "coarse_clock")


def check_answer(expect: Step, answer: Answer) -> None:
    status = expect.get("status", "ok")
    said = f" ({answer.problem.message})" if answer.problem else ""
    must(answer.status == status, f"the status is {answer.status}{said}, {status} is due")
    if answer.problem:
        check_problem(expect, answer.problem.code, answer.problem.field)
    if status != "ok":
        return
    if "tier" in expect:
        must(answer.tier == expect["tier"], f"the tier is {answer.tier}")
    if "flags" in expect:
        flags = {name for name in _FLAGS if getattr(answer, name)}
        must(set(expect["flags"]) == flags, f"flags are {flags}")
    must(answer.queue_us + answer.infer_us <= answer.total_us, "parts take longer than the whole")
    if expect.get("map") is False:
        must(answer.values is None, "the answer carries a map")
    else:
        check_map(expect, answer.map)
    if "window" in expect:
        must(list(answer.window) == expect["window"], f"the window is {answer.window}")
    for name in ("summary", "points", "actuators"):
        if name in expect:
            check_list(name, getattr(answer, name), expect[name])
    if "point_rates" in expect:
        check_list("point_rates", answer.point_rates_hz, expect["point_rates"])
    if "rates" in expect:
        check_map(expect["rates"], answer.rates_hz)
    else:
        try:
            must(answer.rates_hz is None, "the answer carries rates")
        except NotCarried as error:
            must(error.member == "rates_hz", f"{error}")
    if "error_estimate" in expect:
        check_errors(expect, answer)


def check_touch(step: Step, answer: Answer) -> None:
    expect = step["expect"]
    if answer.problem:
        must(expect.get("status") == "error", f"refused: {answer.problem.message}")
        return check_problem(expect, answer.problem.code, answer.problem.field)
    must(expect.get("status") != "error", "the frame is not refused")
    must(answer.status == "ok" and answer.finger == step.get("finger", 0), f"{answer}")
    assert answer.touch is not None
    touch = answer.touch
    numbers = [*touch.force_n, *touch.torque_n_mm, touch.area_mm2, *touch.centre_mm, *touch[4:-1]]
    check_list("touch", numbers, expect["touch"])
    if "pressure_sum" in expect:
        assert answer.pressure_pa is not None
        near("pressure", float(answer.pressure_pa.sum(dtype=np.float64)), expect["pressure_sum"])
    for name in ("no_contact", "not_tracked"):
        must(getattr(answer, name) == (name in expect["flags"]), name)
    must(not answer.out_of_range and not answer.unsettled, f"{answer}")
    if "error_estimate" in expect:
        check_errors(expect, answer)


CONVENTIONS = {
    "right_handed": frames.METRES,
    "openxr": frames.OPENXR,
    "godot": frames.GODOT,
    "unity": frames.UNITY,
    "unreal": frames.UNREAL,
}


def check_poses(what: str, found: NDArray[np.float32], due: NDArray[np.float32]) -> None:
    """Places within a micrometre, quaternions up to their sign."""
    for place, pose in zip(found, due, strict=True):
        must(np.allclose(place[:3], pose[:3], atol=2e-3), f"{what}: the object is at {place[:3]}, not {pose[:3]}")
        must(abs(place[3:] @ pose[3:]) > 1 - 1e-6, f"{what}: the object's turn is {place[3:]}, not {pose[3:]}")


class Run:
    """One case."""

    def __init__(self, file: Step) -> None:
        self.url = os.environ["PAPILLA_URL"]
        self.timeout_s = float(file["timeout_s"])
        self.session: Session | None = None
        self.atlas: Atlas | None = None
        self.moved = 1
        self.note = ""

    def open_session(self) -> Session:
        must(self.session is not None, "no session is open")
        assert self.session is not None
        return self.session

    def address(self, step: Step) -> None:
        text, expect = step["address"], step["expect"]
        if expect.get("status") != "error":
            address = Address.parse(text)
            found = (address.session(), address.http("/v1/atlas"))
            return must(found == (expect["session"], expect["http"]), f"{text}: {found}")
        for use in (Session, lambda url: get_json(url, "/v1/atlas")):
            try:
                use(text)
                must(False, f"{text} is taken")
            except BadAddress as error:
                must(expect["code"] == "bad_address" and expect["says"] in str(error), str(error))

    def token(self, step: Step) -> None:
        expect = step["expect"]
        if expect.get("status") != "error":
            return must(clean_token(step["token"]) == expect["token"], f"{clean_token(step['token'])!r}")
        try:
            Session(self.url, step["token"])
            must(False, "the token is taken")
        except Refused as error:
            check_problem(expect, error.code, None)

    def hello(self, step: Step) -> None:
        expect = step["expect"]
        try:
            if self.session is None:
                self.session = Session(self.url, timeout_s=self.timeout_s, **step["hello"])
            else:
                self.session.renew(**step["hello"])
        except Refused as error:
            must(expect.get("status") == "error", f"the hello is refused: {error}")
            return check_problem(expect, error.code, error.field)
        must(expect.get("status") != "error", "the hello is not refused")
        for words in expect.get("warnings", []):
            must(any(words in told for told in self.session.warnings), f"{words}: {self.session.warnings}")
        for name, value in expect.get("ready", {}).items():
            found = self.session.ready.get(name)
            must(found == value, f"ready.{name} is {found}, {value} is due")

    def frame(self, step: Step) -> None:
        session, map_pa = self.open_session(), pressure(step["pressure"])
        more: dict[str, Any] = {"deadline_us": step.get("deadline_us", 0)}
        if "client_time_us" in step:
            more["client_time_us"] = step["client_time_us"]
        samples: NDArray[np.float32] = map_pa
        if "window" in step:
            column, row, width, height = more["window"] = tuple(step["window"])
            canvas = np.zeros((row + height, column + width), np.float32)
            kept = map_pa[: row + height, : column + width]
            canvas[: kept.shape[0], : kept.shape[1]] = kept
            samples = canvas[row:, column:]
        for _ in range(step.get("attempts", 1)):
            before = session.send(samples, **more)
            answer = before.result(self.timeout_s)
            if answer.status != "lost":
                break
        if "client_time_us" in step:
            must(answer.client_time_us == step["client_time_us"], "another client time comes back")
        check_answer(step["expect"], answer)

    def burst(self, step: Step) -> None:
        session, expect, count = self.open_session(), step["expect"], step["count"]
        maps = [pressure(step["pressure"], (k + 1) / count) for k in range(count)]
        counted_before = session.superseded_by_client
        if step.get("paused"):
            control("pause")
        finished: list[int] = []
        outcomes = []
        for number, map_pa in enumerate(maps):

            def done(sent: Future[Answer], number: int = number) -> None:
                if sent.result().status == "ok":
                    finished.append(number)

            sent = session.send(map_pa)
            sent.add_done_callback(done)
            outcomes.append(sent)
            time.sleep(step.get("gap_ms", 0) * 1e-3)
        if step.get("paused"):
            control("resume")
        answers = [sent.result(self.timeout_s) for sent in outcomes]
        superseded = sum(answer.status == "superseded" for answer in answers)
        good = sum(answer.status == "ok" for answer in answers)
        must(superseded + good == count, f"statuses {sorted({a.status for a in answers})}")
        must(len({answer.sequence for answer in answers}) == count, "two outcomes of one frame")
        must(finished == sorted(finished), f"answers came in the order {finished}")
        must(superseded >= expect.get("superseded", 0), f"only {superseded} frames were superseded")
        here = session.superseded_by_client - counted_before
        must(here == sum(a.by_client for a in answers), "the client miscounts what it superseded")
        must(here >= expect.get("superseded_by_client", 0), f"the client superseded {here} frames")
        check_answer(expect["newest"], answers[-1])
        self.note = f"({good} ok, {here} superseded here, {superseded - here} by the service)"

    def touch(self, step: Step) -> None:
        if step["poses"] is None:
            answer = self.open_session().touch(None, finger=step.get("finger", 0), timeout_s=self.timeout_s)
            return check_touch(step, answer)
        poses = np.array(step["poses"], np.float32)
        if "engines" not in step:
            return check_touch(step, self.open_session().send_poses(poses, **self.of_hand(step)).result(self.timeout_s))
        for name, said in step["engines"].items():
            convention = CONVENTIONS[name]
            placed = frames.from_poses(said["finger"], said["objects"], convention)
            check_poses(name, placed, poses)
            if "joints" in said:
                up = {"godot": (0.0, 0.0, -1.0)}.get(name)
                finger = frames.finger_of_joints(**said["joints"], convention=convention, up=up)
                check_poses(f"{name}, of joints", frames.from_poses(finger, said["objects"], convention), poses)
            answer = self.open_session().send_poses(placed, **self.of_hand(step)).result(self.timeout_s)
            check_touch(step, answer)
            assert answer.touch is not None
            felt, due = frames.felt(said["finger"], answer.touch, convention), step["expect"]["engines"][name]
            for member in due:
                check_list(f"{name}: {member}", getattr(felt, member), due[member])

    def gaps(self, step: Step) -> None:
        *centre, radius = step["sphere"]
        off = np.sqrt(((self.finger().positions_mm.astype(np.float64) - centre) ** 2).sum(axis=1))
        rows = np.concatenate([radius - off, np.tile(step.get("velocity", []), len(off))])
        sent = self.open_session().send_gaps(rows.astype(np.float32), **self.of_hand(step))
        check_touch(step, sent.result(self.timeout_s))

    @staticmethod
    def of_hand(step: Step) -> dict[str, Any]:
        net = step.get("net")
        return {"finger": step.get("finger", 0), "net": net and (net[:3], net[3])}

    def reconnect(self, step: Step) -> None:
        session = self.open_session()
        before = session.connections
        control("restart")
        begin = time.monotonic()
        while session.connections == before:
            must(time.monotonic() < begin + step["within_s"], "no new session in time")
            time.sleep(0.005)
        self.note = f"(connected {time.monotonic() - begin:.2f} s after the server was back)"

    def silence(self, step: Step) -> None:
        """The service stops, or dies, while frames wait for it."""
        session, before = self.open_session(), self.open_session().connections
        usual_s, session.timeout_s = session.timeout_s, step["timeout_ms"] * 1e-3
        sent = [session.send(pressure(step["pressure"]))]
        sent[0].result(self.timeout_s)
        control(step["how"])
        for _ in range(step["count"]):
            sent.append(session.send(pressure(step["pressure"])))
            time.sleep(0.05)
        answers = [each.result(self.timeout_s) for each in sent[1:]]
        statuses = [answer.status for answer in answers]
        must(statuses[-1] == "lost" and {*statuses} <= {"lost", "superseded"}, f"{statuses}")
        must(any("no answer within" in words for words in session.warnings), f"{session.warnings}")
        control({"pause": "resume", "kill": "start"}[step["how"]])
        session.timeout_s = usual_s
        begin = time.monotonic()
        while session.connections == before or not session.connected:
            must(time.monotonic() < begin + step["within_s"], "no new session in time")
            time.sleep(0.005)

    def move(self, step: Step) -> None:
        session, before = self.open_session(), self.moved
        begin = time.monotonic()
        # It may have moved between the steps.
        while session.connections == before:
            must(time.monotonic() < begin + step["within_s"], "it did not move in time")
            time.sleep(0.005)
        self.moved = session.connections

    def stay(self, step: Step) -> None:
        """It was asked to move and could not, and says why."""
        session, begin = self.open_session(), time.monotonic()
        while not any(step["says"] in words for words in session.warnings):
            must(time.monotonic() < begin + step["within_s"], f"it does not say {step['says']}: {session.warnings}")
            time.sleep(0.005)
        must(session.connections == self.moved, "it has moved")

    def http(self, step: Step) -> None:
        expect = step["expect"]
        try:
            answer = post(pressure(step["pressure"]), url=self.url, tier=step["tier"])
        except Refused as error:
            must(expect["status"] == "error", f"refused: {error}")
            return check_problem(expect, error.code, error.field)
        must(expect["status"] == "ok", "the request is not refused")
        must(answer.tier == expect.get("tier", answer.tier), f"the tier is {answer.tier}")
        check_map(expect, answer.sed)

    def finger(self) -> Atlas:
        self.atlas = self.atlas or Atlas.load(self.url)
        return self.atlas

    def rasterise(self, step: Step) -> None:
        *centre, sigma, peak = step["vertices"]["gaussian_mm"]
        off = ((self.finger().positions_mm - centre) ** 2).sum(axis=1)
        values = (peak * np.exp(-off / (2 * sigma**2))).astype(np.float32)
        check_map(step["expect"], self.finger().rasterise(values))

    def contacts(self, step: Step) -> None:
        contacts = [Contact(**contact) for contact in step["contacts"]]
        map_pa = self.finger().contacts(contacts)
        check_map(step["expect"], map_pa)
        if "force_n" in step["expect"]:
            near("force_n", self.finger().force_n(map_pa), step["expect"]["force_n"])


def control(action: str) -> None:
    request = urllib.request.Request(f"{os.environ['PAPILLA_CONTROL']}/{action}", b"", method="POST")
    with urllib.request.urlopen(request, timeout=120):
        pass


def main() -> int:
    file = json.loads(Path(os.environ["PAPILLA_CONFORMANCE"]).read_text())
    failed = 0
    for case in file["cases"]:
        run = Run(file)
        try:
            for number, step in enumerate(case["steps"]):
                try:
                    getattr(run, step["do"])(step)
                except Nonconformity as error:
                    raise Nonconformity(f"step {number}: {error}") from None
            print(f"ok {case['name']} {run.note}".rstrip(), flush=True)
        except Exception as error:  # any failure of a case is a finding, and the next case follows
            failed += 1
            print(f"FAIL {case['name']}: {type(error).__name__}: {error}", flush=True)
        finally:
            if run.session is not None:
                run.session.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
