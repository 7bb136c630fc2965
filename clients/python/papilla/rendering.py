"""A series of frames as one call: `papilla.render`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from .errors import BadInput
from .http import DEFAULT_URL, LOCAL
from .model import shared
from .send_series import LANES_MAX, Progress, Source, Terms, parts
from .series import Series, joined
from .sync import Session

if TYPE_CHECKING:
    from .inprocess import LocalSession


def render_chunks(
    frames: ArrayLike | Iterable[ArrayLike],
    times: ArrayLike | None = None,
    *,
    chunk: int = 256,
    unit: str | None = None,
    url: str = DEFAULT_URL,
    token: str | None = None,
    lanes: int | None = None,
    progress: Progress = None,
    **hello: Any,
) -> Iterator[Series]:
    """`render` for what does not fit in memory: a result for each `chunk` frames, in their order."""
    return _rendered(frames, times, chunk, unit, url, token, lanes, progress, hello)


def _rendered(
    frames: Any,
    times: ArrayLike | None,
    chunk: int | None,
    unit: str | None,
    url: str,
    token: str | None,
    lanes: int | None,
    progress: Progress,
    hello: dict[str, Any],
) -> Iterator[Series]:
    hello = {"error_estimate": True, **hello}
    with _opened(url, token, hello) as first:
        source = Source(frames, times, unit, Terms.of(hello, first.ready))
        if lanes is None:
            lanes = 1 if source.remembers else max(1, min(LANES_MAX, os.cpu_count() or 1, source.count or LANES_MAX))
        elif lanes < 1 or (lanes > 1 and source.remembers):
            raise BadInput("lanes", f"{lanes}; a series whose frames depend on those before goes over one")
        others = [_opened(url, token, hello) for _ in range(lanes - 1)]
        try:
            yield from parts([first, *others], source, source.count or 256 if chunk is None else chunk, progress)
        finally:
            for session in others:
                session.close()


def _opened(url: str, token: str | None, hello: dict[str, Any]) -> Session | LocalSession:
    """A session with a service, or, at the address `local`, in this process, with the network of all calls there."""
    if url != LOCAL:
        return Session(url, token, **hello)
    from .inprocess import LocalSession, solves

    return LocalSession(shared(hello.get("tier"), contact=solves(hello)), **hello)


def render(
    frames: ArrayLike | Iterable[ArrayLike],
    times: ArrayLike | None = None,
    *,
    unit: str | None = None,
    url: str = DEFAULT_URL,
    token: str | None = None,
    lanes: int | None = None,
    progress: Progress = None,
    **hello: Any,
) -> Series:
    """Renders a series of frames, every one of them, and gives the answers as one `Series`.

    `frames` are maps of pressure (frame, 224, 224), Pa; with `input="objects"` and `objects=[...]` poses
    (frame, object, 7); with `input="gaps"` depths (frame, 224, 224), mm. An iterable of frames will do.
    `times` in s, one for each frame and rising; without them each frame stands for itself, so that firing
    rates have no part of motion, and relaxation and spikes are refused. `unit` is that of `frames`.

    Frames of pressure that do not depend on those before go over several connections at once (`lanes`);
    all others go over one, in order, one at a time. `url="local"` needs no service: this process computes, with
    `lanes` threads. The rest are members of the hello, as for `Session`;
    answers say how wrong they are likely to be, unless it is `error_estimate=False`.

    Raises BadInput before anything is sent, and FrameFailed for a frame without an answer.
    """
    return joined(list(_rendered(frames, times, None, unit, url, token, lanes, progress, hello)))
