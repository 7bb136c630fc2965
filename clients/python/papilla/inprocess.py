"""A session that is computed in this process."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import answer as answers
from . import check, wire
from .answer import Answer, Problem
from .calls import Calls
from .errors import Closed, Refused
from .link import TOLD_CLOCK, Warned, questions, told_beyond, told_refused
from .model import Model
from .rows import Rooms
from .wire import NetForce, Window

# No service reads them, so they mean nothing here: what a session does when its connection breaks.
_OF_CONNECTIONS: Final = ("reconnect",)


def solves(hello: dict[str, Any]) -> bool:
    """Whether a hello needs the contact model."""
    return hello.get("input", "pressure") != "pressure" or "shear_energy" in hello.get("effects", ())


def _suits(model: Model, asked: str | None, tier: str | None, contact: bool) -> bool:
    """Whether a model that was read for `asked` has the network that a hello gets at a service."""
    has_network = asked is None if tier is None else tier in model.tiers
    return has_network and (model.has_contact or not contact)


def _named(hello: dict[str, Any]) -> set[str]:
    """Names of the fingers that a hello announces, but for the default one."""
    fingers = hello.get("fingers")
    announced = fingers if isinstance(fingers, list | tuple) else []
    names = {finger.get("name") for finger in announced if isinstance(finger, dict)}
    return {name for name in names if isinstance(name, str) and name != "default"}


class LocalSession(Calls):
    """As `Session`, without a service: frames are rendered on the thread that sends them.

    Nothing waits, so no frame is superseded, late or lost, and each future is done when it is given.
    """

    def __init__(
        self,
        model: Model | None = None,
        *,
        models: str | os.PathLike[str] | None = None,
        bundles: str | os.PathLike[str] | None = None,
        **hello: Any,
    ) -> None:
        self.url = "local"
        self._bundles = None if bundles is None else Path(bundles)
        # By the names of their fingers, with the tier that they were read for.
        self._named: dict[str, tuple[str | None, Model]] = {}
        self._asked: str | None = None
        self.timeout_s = float("inf")
        self._models = models if model is None else model.folder
        self._model = model
        self._lock = threading.Lock()
        self._sequence = 0
        self._closed = False
        self._warned = Warned()
        self._agree(hello)

    def __enter__(self) -> LocalSession:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the session."""
        with self._lock:
            self._closed = True
            self._native.close()

    @property
    def ready(self) -> dict[str, Any]:
        """What was agreed to: tier, ranges, sections, ..."""
        return self._ready

    @property
    def hello(self) -> dict[str, Any]:
        """The terms that this session asked for last."""
        return dict(self._hello)

    @property
    def connected(self) -> bool:
        """True until the session is closed."""
        return not self._closed

    @property
    def connections(self) -> int:
        """1: there is none that could break."""
        return 1

    @property
    def superseded_by_client(self) -> int:
        """0: each frame is rendered before the next can come."""
        return 0

    @property
    def warnings(self) -> list[str]:
        """What was logged for people to read, each once."""
        return self._warned.words

    @property
    def model(self) -> Model:
        """The network, to be shared with other sessions."""
        assert self._model is not None
        return self._model

    def renew(self, **hello: Any) -> dict[str, Any]:
        """Says hello again; raises Refused, and the old terms stand."""
        with self._lock:
            if self._closed:
                raise Closed("the session is closed")
            self._agree(hello)
            return self._ready

    def _agree(self, hello: dict[str, Any]) -> None:
        model, asked, tier, contact = self._model, self._asked, hello.get("tier"), solves(hello)
        if model is None or not _suits(model, asked, tier, contact):
            model, asked = Model(tier, models=self._models, contact=contact), tier
        said = {name: value for name, value in hello.items() if name not in _OF_CONNECTIONS}
        named = self._load(_named(hello), tier, contact)
        native = model.session(said, {name: of for name, (_, of) in named.items()})
        self._native, self._model, self._asked, self._named, self._hello = native, model, asked, named, hello
        self._ready: dict[str, Any] = json.loads(native.ready())
        self._tiers = dict(enumerate(self._ready.get("tier_names") or [self._ready["tier"]]))
        for words in questions(self._ready):
            self._warned.once(words, words)

    def _load(self, names: set[str], tier: str | None, contact: bool) -> dict[str, tuple[str | None, Model]]:
        """The models of fingers by name, as far as they have a folder; the rest is refused with the hello."""
        loaded = {}
        for name in sorted(names):
            at = self._bundles / name if self._bundles is not None and Path(name).name == name else None
            if at is None or not at.is_dir():
                continue
            known = self._named.get(name)
            if known is None or not _suits(known[1], known[0], tier, contact):
                known = tier, Model(tier, models=at, contact=contact)
            loaded[name] = known
        return loaded

    def send(
        self,
        pressure_pa: ArrayLike | None = None,
        *,
        window: Window | None = None,
        client_time_us: int | None = None,
        deadline_us: int = 0,
    ) -> Future[Answer]:
        """Renders one frame; see `AsyncSession.send`. No deadline is missed here."""
        return _done(self._press(pressure_pa, window, client_time_us, deadline_us))

    def render(
        self,
        pressure_pa: ArrayLike | None = None,
        *,
        window: Window | None = None,
        client_time_us: int | None = None,
        deadline_us: int = 0,
        timeout_s: float | None = None,
    ) -> Answer:
        """`send`, and its outcome. Nothing is waited for, and so no future made."""
        return self._press(pressure_pa, window, client_time_us, deadline_us)

    def _press(
        self, pressure_pa: ArrayLike | None, window: Window | None, client_time_us: int | None, deadline_us: int
    ) -> Answer:
        samples, window = check.pressure(pressure_pa, window)
        self._warned.ask_unit(samples, "pressure")
        with self._lock:
            sequence, time_us = self._next(client_time_us)
            sample_type = self._ready["sample_type"]
            head, samples = wire.parts(samples, window, sample_type, sequence, time_us, deadline_us)
            return self._frame(head, _bytes(samples), sequence, time_us, 0)

    def send_not_tracked(self, *, finger: int = 0) -> Future[Answer]:
        """Tells that tracking is lost; see `AsyncSession.send_not_tracked`."""
        with self._lock:
            sequence, time_us = self._next(None)
            head = wire.encode_not_tracked(finger, sequence, time_us)
            return _done(self._frame(head, b"", sequence, time_us, finger))

    def touch(
        self, poses: ArrayLike | None, *, finger: int = 0, net: NetForce | None = None, timeout_s: float | None = None
    ) -> Answer:
        """`send_poses`, and its outcome; see `Session.touch`."""
        if poses is None:
            return self.not_tracked(finger=finger)
        return self._rows("objects", poses, finger, net, None)

    def _hand_over(
        self, kind: str, values: ArrayLike, finger: int, net: NetForce | None, client_time_us: int | None
    ) -> Future[Answer]:
        return _done(self._rows(kind, values, finger, net, client_time_us))

    def _rows(
        self, kind: str, values: ArrayLike, finger: int, net: NetForce | None, client_time_us: int | None
    ) -> Answer:
        rows = check.rows(kind, values)
        self._warned.ask_unit(rows, kind)
        with self._lock:
            sequence, time_us = self._next(client_time_us)
            message = wire.encode_rows(kind, rows, net, finger, sequence, time_us)
            head, samples = message[: wire.HEADER.size], memoryview(message)[wire.HEADER.size :]
            return self._frame(head, samples, sequence, time_us, finger)

    def render_rows(
        self,
        kind: str,
        frames: Sequence[NDArray[np.float32]],
        times_us: Sequence[int],
        rooms: Sequence[Rooms],
    ) -> tuple[int, Problem] | None:
        """Renders frames of the hello's `input`, one after the other, and writes parts of their answers.

        `rooms` has for each frame places in the message of its answer, and a room of as many bytes as go there.
        Frames are not looked at. Gives the number of the frame that is refused, which ends it, and why.
        """
        sent: list[tuple[bytes, bytes | memoryview, Rooms]] = []
        with self._lock:
            for values, at_us, own in zip(frames, times_us, rooms, strict=True):
                rows = np.atleast_2d(values)
                sequence, time_us = self._next(at_us)
                if kind == "pressure":
                    window = (0, 0, rows.shape[1], rows.shape[0])
                    head, body = wire.parts(rows, window, self._ready["sample_type"], sequence, time_us, 0)
                    sent.append((head, _bytes(body), own))
                else:
                    message = wire.encode_rows(kind, rows, None, 0, sequence, time_us)
                    sent.append((message[: wire.HEADER.size], memoryview(message)[wire.HEADER.size :], own))
            failed = self._native.frames(sent)
        if failed is not None:
            number, code, words, field = failed
            problem = Problem(code, words, field)
            self._warned.once(problem.code, told_refused(problem))
            return number, problem
        return None

    def unit_is_known(self) -> None:
        """Asks no more whether frames are in another unit than Pa or mm."""
        self._warned.unit_is_known()

    def warn_beyond(self) -> None:
        """Logs once that an answer had the flag `out_of_range`."""
        self._warned.once("out_of_range", told_beyond(self._ready["tier"]))

    def warn_clock(self) -> None:
        """Logs once that an answer had the flag `coarse_clock`."""
        self._warned.once("coarse_clock", TOLD_CLOCK)

    def _next(self, client_time_us: int | None) -> tuple[int, int]:
        if self._closed:
            raise Closed("the session is closed")
        self._sequence = (self._sequence + 1) % 2**32
        return self._sequence, time.monotonic_ns() // 1000 if client_time_us is None else client_time_us

    def _frame(self, head: bytes, samples: bytes | memoryview, sequence: int, time_us: int, finger: int) -> Answer:
        try:
            message = self._native.frame(head, samples)
        except Refused as refused:
            problem = Problem(refused.code, refused.message, refused.field)
            self._warned.once(problem.code, told_refused(problem))
            return Answer(sequence, "error", time_us, problem=problem, finger=finger)
        header = wire.decode(message)
        if "out_of_range" in header.flags:
            self.warn_beyond()
        if "coarse_clock" in header.flags:
            self.warn_clock()
        return answers.read(message, header, self._ready, self._tiers[header.tier])


def _done(answer: Answer) -> Future[Answer]:
    """A future that has its outcome."""
    outcome: Future[Answer] = Future()
    outcome.set_result(answer)
    return outcome


def _bytes(samples: NDArray[Any]) -> bytes | memoryview:
    """Samples as the bytes that they lie in, copied only where they are apart."""
    return np.ascontiguousarray(samples).data.cast("B") if samples.size else b""


def local(
    model: Model | None = None,
    *,
    models: str | os.PathLike[str] | None = None,
    bundles: str | os.PathLike[str] | None = None,
    **hello: Any,
) -> LocalSession:
    """A session in this process, with the methods and the answers of `Session(url)`.

    `with papilla.local() as session: session.render(pressure_pa).sed`

    `models` is a folder of models, by default that of the wheel; `model` is one that is loaded already.
    `bundles` has a folder for each further finger that the hello may name, as that of `papilla-server --fingers`;
    each needs networks of its own. The rest are members of the hello, as for `Session`; `budget_us`,
    `stale_after_us` and `resume` are refused, because nothing waits or travels here. Raises Refused, BadModels and
    NativeMissing.
    """
    return LocalSession(model, models=models, bundles=bundles, **hello)
