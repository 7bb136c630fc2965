"""Sends the frames of a series over sessions that are open, every one of them, and collects the answers."""

from __future__ import annotations

import itertools
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import check, wire
from .answer import Answer, Problem
from .errors import BadInput, FrameFailed
from .rows import Rooms, Rows
from .series import Columns, Series, joined
from .wire import SIDE_PX, Window

Progress: TypeAlias = bool | Callable[[int, int | None], None] | None
"""True draws a line on stderr; a function gets the frames done, and all frames where their number is known."""
LANES_MAX: Final = 4
"""Sessions side by side, unless it is said how many."""
_TOGETHER_MAX: Final = 8
"""Frames that a session in process takes together, so that its threads wait little for Python and end together."""
_PATIENCE_S: Final = 60.0
_TRIES: Final = 3
_LOG: Final = logging.getLogger("papilla")
# Effects of a session that do nothing sensible without times.
_TIMED: Final = ("relaxation", "spikes")


class Session(Protocol):
    """A session that is open, as far as a series needs it: `papilla.Session`."""

    timeout_s: float

    @property
    def hello(self) -> dict[str, Any]: ...

    @property
    def ready(self) -> dict[str, Any]: ...

    @property
    def warnings(self) -> list[str]: ...

    def send(self, pressure_pa: ArrayLike, *, window: Window | None, client_time_us: int | None) -> Future[Answer]: ...

    def send_poses(self, poses: ArrayLike, *, client_time_us: int | None) -> Future[Answer]: ...

    def send_gaps(self, depth_mm: ArrayLike, *, client_time_us: int | None) -> Future[Answer]: ...

    def unit_is_known(self) -> None: ...


@runtime_checkable
class InProcess(Protocol):
    """What only a session in process has: `papilla.LocalSession`."""

    def render_rows(
        self,
        kind: str,
        frames: Sequence[NDArray[np.float32]],
        times_us: Sequence[int],
        rooms: Sequence[Rooms],
    ) -> tuple[int, Problem] | None: ...

    def warn_beyond(self) -> None: ...
    def warn_clock(self) -> None: ...


class Terms(NamedTuple):
    """What a session's hello says of its frames."""

    kind: str
    shape: tuple[int, ...]
    """Of one frame."""
    timed: tuple[str, ...]
    """Names of what needs times."""
    remembers: bool
    """Whether the answer to a frame depends on the frames before, given times."""
    remembers_stills: bool
    """The same without times."""

    @classmethod
    def of(cls, hello: dict[str, Any], ready: dict[str, Any]) -> Terms:
        kind = hello.get("input", "pressure")
        effects = set(hello.get("effects", ()))
        vertices = hello.get("input_layout", "map") == "vertices"
        wide = 4 if hello.get("traction") or hello.get("velocity") else 1
        if hello.get("force_target"):
            raise BadInput("force_target", "frames of a series carry no net force; send them one by one, by touch")
        if hello.get("budget_us"):
            raise BadInput("budget_us", "a series waits for every frame: name a tier in place of a budget")
        shape: tuple[int, ...] = (SIDE_PX, SIDE_PX)
        if kind == "objects":
            shape = (len(wire.objects(hello["objects"])), 7)
        elif vertices:
            shape = (wide * int(ready["vertices"]),)
        timed = tuple(name for name in _TIMED if name in effects) + (("velocity",) if hello.get("velocity") else ())
        still = kind != "pressure" or bool(timed)
        return cls(kind, shape, timed, still or "afferents" in effects, still)


class Frame(NamedTuple):
    """A frame of a series on its way."""

    number: int
    time_us: int
    values: NDArray[Any]
    """As they came."""
    factor: float
    """To the protocol's unit; 1 where they are in it."""


class Source:
    """The frames of a series, looked at before they leave."""

    def __init__(self, frames: Any, times: ArrayLike | None, unit: str | None, terms: Terms) -> None:
        self.terms = terms
        self._unit = unit
        said = check.unit_of(frames, "frames", terms.kind, unit)
        self._factor = check.unit_factor(said, terms.kind)
        self._ask = said is None
        self.count: int | None = len(frames) if hasattr(frames, "__len__") else None
        if hasattr(frames, "__array__") or isinstance(frames, (list, tuple)):
            frames = check.numbers(frames, "frames")
            if terms.kind == "objects" and terms.shape[0] == 1 and frames.ndim == 2 and frames.shape[-1] == 7:
                frames = frames[:, None, :]
            check.shape_of_frames(frames.shape, terms.shape, terms.kind)
            self.count = len(frames)
        self.times_s = None if times is None else check.times(times, self.count)
        if times is None and terms.timed:
            raise BadInput("times", f"'{terms.timed[0]}' depends on time: give the time of each frame, in s")
        if self.count == 0:
            raise BadInput("frames", "there are none")
        self.notes: list[str] = []
        """Questions about what is right as it stands, and yet odd."""
        doubt = None if self.times_s is None else check.times_doubt(self.times_s)
        if doubt is not None:
            self.notes.append(doubt)
            _LOG.warning("%s", doubt)
        self._looked_at = isinstance(frames, np.ndarray)
        if isinstance(frames, np.ndarray):
            # All of it before the first frame leaves, and not once more when it does.
            threads = min(LANES_MAX, os.cpu_count() or 1)
            greatest = check.every_frame(frames, terms.shape, terms.kind, self._factor, threads)
            if self._ask:
                check.ask_unit(greatest, terms.kind)
                self._ask = False
        self._frames = iter(frames)
        self._next = 0

    @property
    def remembers(self) -> bool:
        return self.terms.remembers if self.times_s is not None else self.terms.remembers_stills

    def take(self, most: int) -> list[Frame]:
        """The next frames, `most` at most."""
        taken = []
        for values in itertools.islice(self._frames, most):
            number = self._next
            self._next += 1
            if self.times_s is not None and number >= len(self.times_s):
                raise BadInput("times", f"there are {len(self.times_s)}, and more frames than that")
            factor = self._factor
            if not self._looked_at:
                said = check.unit_of(values, "frames", self.terms.kind, self._unit)
                factor, self._ask = check.unit_factor(said, self.terms.kind), self._ask and said is None
                values, factor = check.frame(values, self.terms.shape, self.terms.kind, number, factor), 1.0
            # Stills all have the same time, so that nothing counts as motion.
            time_us = 0
            if self.times_s is not None:
                time_us = round(1e6 * (self.times_s[number] - self.times_s[0]))
            taken.append(Frame(number, time_us, values, factor))
        if self._ask and taken:
            greatest = max(check.size_of(frame.values, self.terms.kind) for frame in taken)
            check.ask_unit(greatest, self.terms.kind)
            self._ask = greatest == 0.0
        return taken


class _Meter:
    """Counts frames, and tells."""

    def __init__(self, progress: Progress, total: int | None) -> None:
        self._tell = progress if callable(progress) else line if progress else None
        self._total = total
        self._done = 0
        self._lock = threading.Lock()

    def step(self, frames: int) -> None:
        if self._tell is None:
            return
        with self._lock:
            for _ in range(frames):
                self._done += 1
                self._tell(self._done, self._total)


def line(done: int, total: int | None) -> None:
    """Draws how far it is."""
    if total is None or done == total or done % max(1, total // 200) == 0:
        end = "\n" if done == total else ""
        print(f"\r{done} of {total or '?'} frames", end=end, file=sys.stderr, flush=True)


def _send(session: Session, frame: Frame, terms: Terms) -> Answer:
    """One frame, and its outcome."""
    values = check.in_unit(frame.values, terms.kind, frame.factor)
    if terms.kind == "objects":
        return session.send_poses(values, client_time_us=frame.time_us).result()
    if terms.kind == "gaps":
        return session.send_gaps(values, client_time_us=frame.time_us).result()
    rows = np.atleast_2d(values)
    window = (0, 0, rows.shape[1], rows.shape[0])
    return session.send(rows, window=window, client_time_us=frame.time_us).result()


def _outcome(session: Session, frame: Frame, terms: Terms, remembers: bool) -> Answer:
    """The answer of a frame; raises FrameFailed if there is none."""
    for left in range(_TRIES - 1, -1, -1):
        answer = _send(session, frame, terms)
        if answer.status == "ok":
            return answer
        if answer.status != "lost" or remembers or not left:
            break
    reason = answer.problem.message if answer.problem else "the service did not say why"
    if answer.status == "superseded":
        reason = "another thread sent a frame by this session meanwhile; give the series a session of its own"
    elif answer.status == "lost":
        kept = "; what the service remembered is lost with it, so begin the series again" if remembers else ""
        reason = f"the connection broke, or no answer came within {session.timeout_s:g} s{kept}"
    raise FrameFailed(frame.number, answer.status, reason)


class _Answers:
    """Frames of a service's sessions: one by one."""

    together = 1

    def __init__(self, sessions: Sequence[Session], frames: list[Frame], source: Source) -> None:
        self._source = source
        self._columns = Columns(len(frames), sessions[0].ready, source.remembers)

    def take(self, session: Session, first: int, frames: list[Frame]) -> None:
        for place, frame in enumerate(frames, first):
            self._columns.put(place, _outcome(session, frame, self._source.terms, self._source.remembers))

    def series(self, times_s: NDArray[np.float64] | None, warnings: Sequence[str], seconds: float) -> Series:
        return self._columns.series(times_s, warnings, seconds)


class _InProcess:
    """Frames of sessions in process: some at a time, whose answers Rust writes where they stay."""

    def __init__(self, sessions: Sequence[Session], frames: list[Frame], source: Source) -> None:
        self._kind = source.terms.kind
        self._rows = Rows(len(frames), sessions[0].ready)
        self._tier = sessions[0].ready["tier"]
        self.together = max(1, min(_TOGETHER_MAX, len(frames) // (4 * len(sessions))))

    @staticmethod
    def can(session: Session) -> bool:
        return isinstance(session, InProcess) and Rows.fit(session.ready)

    def take(self, session: Session, first: int, frames: list[Frame]) -> None:
        assert isinstance(session, InProcess)
        values = [check.in_unit(frame.values, self._kind, frame.factor) for frame in frames]
        times_us = [frame.time_us for frame in frames]
        failed = session.render_rows(self._kind, values, times_us, self._rows.rooms(first, len(frames)))
        if failed is not None:
            number, problem = failed
            raise FrameFailed(frames[number].number, "error", problem.message)
        if self._rows.has_flag("out_of_range", first, len(frames)):
            session.warn_beyond()
        if self._rows.has_flag("coarse_clock", first, len(frames)):
            session.warn_clock()

    def series(self, times_s: NDArray[np.float64] | None, warnings: Sequence[str], seconds: float) -> Series:
        return self._rows.series(self._tier, times_s, warnings, seconds)


def _work(sessions: Sequence[Session], frames: list[Frame], source: Source, meter: _Meter) -> Series:
    """Renders frames by sessions side by side; each has one frame under way, so none supersedes another."""
    begin = time.perf_counter()
    kind = _InProcess if all(_InProcess.can(session) for session in sessions) else _Answers
    collected = kind(sessions, frames, source)
    starts = iter(range(0, len(frames), collected.together))
    lock, stop = threading.Lock(), threading.Event()

    def lane(session: Session) -> None:
        while not stop.is_set():
            with lock:
                first = next(starts, None)
            if first is None:
                return
            some = frames[first : first + collected.together]
            try:
                collected.take(session, first, some)
            except BaseException:
                stop.set()
                raise
            meter.step(len(some))

    if len(sessions) == 1:
        lane(sessions[0])
    else:
        with ThreadPoolExecutor(len(sessions), "papilla-series") as pool:
            lanes = [pool.submit(lane, session) for session in sessions]
            try:
                for done in lanes:
                    done.result()
            finally:
                # Ctrl-C comes here: each lane ends with the frames that it has under way.
                stop.set()
    first = frames[0].number
    times_s = None if source.times_s is None else source.times_s[first : first + len(frames)].copy()
    warnings = sorted({*source.notes, *(words for session in sessions for words in session.warnings)})
    return collected.series(times_s, warnings, time.perf_counter() - begin)


def parts(sessions: Sequence[Session], source: Source, chunk: int, progress: Progress) -> Iterator[Series]:
    if chunk < 1:
        raise BadInput("chunk", f"{chunk} frames; 1 or more are due")
    meter = _Meter(progress, source.count)
    old = [session.timeout_s for session in sessions]
    try:
        for session in sessions:
            session.timeout_s = max(session.timeout_s, _PATIENCE_S)
            session.unit_is_known()
        while frames := source.take(chunk):
            yield _work(sessions, frames, source, meter)
    finally:
        for session, timeout_s in zip(sessions, old, strict=True):
            session.timeout_s = timeout_s


def on_session(
    session: Session, frames: Any, times: ArrayLike | None, *, unit: str | None, progress: Progress
) -> Series:
    """`papilla.Session.series`."""
    source = Source(frames, times, unit, Terms.of(session.hello, session.ready))
    return joined(list(parts([session], source, source.count or 256, progress)))


def chunks_on_session(
    session: Session, frames: Any, times: ArrayLike | None, *, chunk: int, unit: str | None, progress: Progress
) -> Iterator[Series]:
    """`papilla.Session.series_chunks`."""
    source = Source(frames, times, unit, Terms.of(session.hello, session.ready))
    return parts([session], source, chunk, progress)
