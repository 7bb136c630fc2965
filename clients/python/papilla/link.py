"""Parts of a session: its connection, and a frame on its way."""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from concurrent.futures import Future
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from . import check
from .answer import Answer, Problem

_SOCKET_BYTES: Final = 512 * 1024
_LOG: Final = logging.getLogger("papilla")


class StaysError(Exception):
    """The service asked the session to move, and does not say what it remembers; the text says why."""


class Frame:
    """A frame on its way, and who waits for its outcome."""

    __slots__ = ("born_s", "client_time_us", "finger", "message", "outcome", "ready", "sequence")

    def __init__(self, sequence: int, client_time_us: int, message: bytes, finger: int = 0) -> None:
        self.born_s = time.monotonic()
        self.sequence = sequence
        self.client_time_us = client_time_us
        self.message = message
        self.finger = finger
        self.outcome: Future[Answer] = Future()
        self.ready: dict[str, Any] = {}

    def end(self, status: str, by_client: bool = False, problem: Problem | None = None) -> None:
        self.give(Answer(self.sequence, status, self.client_time_us, by_client, problem, finger=self.finger))

    def give(self, answer: Answer) -> None:
        if not self.outcome.done():
            self.outcome.set_result(answer)


async def dial(host: str, port: int) -> socket.socket:
    """A connection with buffers for a whole frame each way, which must be asked for before connecting."""
    loop = asyncio.get_running_loop()
    last: OSError = OSError(f"{host} has no address")
    for family, kind, proto, _, address in await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM):
        raw = socket.socket(family, kind, proto)
        try:
            raw.setblocking(False)
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SOCKET_BYTES)
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SOCKET_BYTES)
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            await loop.sock_connect(raw, address)
            return raw
        except OSError as error:
            raw.close()
            last = error
    raise last


class Warned:
    """What was logged for people to read, each once."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self._codes: set[str] = set()
        self._asks = True

    def once(self, code: str, words: str) -> None:
        """Logs `words`, unless something with this code was told before."""
        if code not in self._codes:
            self._codes.add(code)
            self.words.append(words)
            _LOG.warning("%s", words)

    def unit_is_known(self) -> None:
        """Asks no more about the unit of frames."""
        self._asks = False

    def ask_unit(self, values: NDArray[np.float32], kind: str) -> None:
        """Asks once, of the first frame that is not zero, whether its small values are in another unit."""
        if not self._asks:
            return
        greatest = check.size_of(values, kind)
        if greatest != 0.0:
            self._asks = False
            doubt = check.unit_doubt(greatest, kind)
            if doubt is not None:
                self.once("unit", f"{doubt}: was {' or '.join(list(check.UNITS[kind])[1:])} meant?")


def questions(ready: dict[str, Any]) -> list[str]:
    """What a person should know of a ready: what the service asks, and a budget that it cannot meet."""
    asked = [f"{each['member']}: {each['question']}" for each in ready.get("warnings", [])]
    if ready.get("meets_budget") is False:
        budget_us = ready["budget_us"]
        needs = f"a frame of tier {ready['tier']} takes some {ready['predicted_latency_us']} us"
        meant = f"; it counts microseconds: were {budget_us} ms meant?" if budget_us < 100 else ""
        asked.append(f"{needs}, and budget_us is {budget_us}, so that frames may be late{meant}")
    return asked


def told_stays(why: str) -> str:
    """Said of a move that the service did not make possible."""
    return (
        f"the service asked the session to move, and did not say what it remembers ({why}): "
        "it goes on over its old connection, and starts anew when that ends"
    )


def told_beyond(tier: str) -> str:
    """Said once of pressure beyond a tier's training."""
    return f"pressure is beyond what tier {tier} knows; such answers are flagged"


TOLD_CLOCK: Final = (
    "the times of the frames have steps above 20 ms, stand still, or are in ms or ns in place of us; "
    "rates, spikes and creep in such answers are wrong, and flagged coarse_clock"
)
"""Said once of times that effects cannot go by."""


def told_refused(problem: Problem) -> str:
    """Said once of frames that were refused."""
    return f"a frame was refused: {problem.message}"
