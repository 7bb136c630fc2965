"""A session for asyncio."""

from __future__ import annotations

import asyncio
import json
import time
from concurrent.futures import Future
from types import TracebackType
from typing import Any, Final

from numpy.typing import ArrayLike
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus, WebSocketException

from . import answer as answers
from . import check, wire
from .address import Address, clean_token
from .answer import Answer, Problem
from .calls import Sends
from .errors import BadInput, Closed, Refused, Unreachable
from .http import DEFAULT_URL, LOCAL, refusal, without_service
from .link import TOLD_CLOCK, Frame, StaysError, Warned, dial, questions, told_beyond, told_refused, told_stays
from .wire import NetForce, Window

_PATIENCE_S: Final = 30.0
_RETRY_S: Final = 0.15
_MOVE_PATIENCE_S: Final = 5.0
TIMEOUT_S: Final = 5.0
"""After so long a frame without an answer is `lost`."""


class AsyncSession(Sends):
    """A session: pressure maps in, SED maps out, the latest frame wins.

    `async with AsyncSession() as session: (await session.render(pressure_pa)).sed`

    The arguments after `url` and `token` are the members of the protocol's hello
    (docs/reference/protocol-hello.md): `tier`, `budget_us`, `sample_type`, `effects` and their parameters, and
    so on. When the connection breaks, or the service asks for it, the session opens another by itself;
    where the service asked, no frame is lost and what it remembers goes along.

    A frame that has no answer `timeout_s` after it was handed over is `lost`, whether it waits for a connection
    or for the service; in the second case the session gives the connection up and opens another.
    """

    def __init__(
        self, url: str = DEFAULT_URL, token: str | None = None, *, timeout_s: float = TIMEOUT_S, **hello: Any
    ) -> None:
        if not timeout_s > 0:
            raise ValueError(f"timeout_s is {timeout_s}; a time above 0 is due, float('inf') for any")
        if url == LOCAL:
            raise BadInput("url", f"{LOCAL!r} is this process: papilla.local(...) makes a session in it")
        self._address = Address.parse(url)
        self.url = self._address.http("")
        self.ready: dict[str, Any] = {}
        """What the service agreed to: tier, ranges, sections, ..."""
        self.superseded_by_client = 0
        """Frames that a newer one replaced before they left."""
        self.connections = 0
        """Times that a session was opened; more than 1 after a reconnect."""
        self._warned = Warned()
        self.warnings = self._warned.words
        """What was logged for people to read: each question of the service's, and each odd answer, once."""
        self.timeout_s = timeout_s
        """Time within which a frame has an outcome, s; may be changed."""
        self._token = clean_token(token)
        self._hello = hello
        self._socket: ClientConnection | None = None
        self._tiers: dict[int, str] = {}
        self._sequence = 0
        self._waiting: dict[int, Frame] = {}
        self._sent: dict[int, Frame] = {}
        self._wake = asyncio.Event()
        self._connected = asyncio.Event()
        self._renewal: asyncio.Future[dict[str, Any]] | None = None
        self._writing = asyncio.Lock()
        self._tasks: list[asyncio.Task[None]] = []
        self._reading: asyncio.Task[None] | None = None
        self._following: asyncio.Task[None] | None = None
        self._sealed: asyncio.Future[bytes] | None = None
        self._seals_due = 0
        """Sealed states that were asked for and have not come: a late one is not that of the last move."""
        self._closed = False
        self._fault: Refused | None = None

    async def __aenter__(self) -> AsyncSession:
        await self.open()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        await self.close()

    async def open(self) -> None:
        """Connects and says hello; raises Refused or Unreachable."""
        await self._connect()
        self._tasks = [asyncio.create_task(task) for task in (self._write(), self._live(), self._watch())]

    async def close(self) -> None:
        """Ends the session; frames without an outcome are `lost`."""
        self._closed = True
        tasks = [task for task in [*self._tasks, self._reading, self._following] if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._socket is not None:
            await self._socket.close()
        for frame in [*self._sent.values(), *self._waiting.values()]:
            self._lose(frame)
        self._sent.clear()
        self._waiting.clear()

    @property
    def hello(self) -> dict[str, Any]:
        """The terms that this session asked for last."""
        return dict(self._hello)

    @property
    def connected(self) -> bool:
        """Whether there is a session with the service just now."""
        return self._connected.is_set()

    def send(
        self,
        pressure_pa: ArrayLike | None = None,
        *,
        window: Window | None = None,
        client_time_us: int | None = None,
        deadline_us: int = 0,
    ) -> Future[Answer]:
        """Hands over one frame and returns at once; its outcome comes in the future.

        `pressure_pa` is the whole map (224 x 224), or the samples of `window` (column, row, width,
        height; all other pixels are 0); None is no contact. `deadline_us` counts from receipt, 0:
        the session's budget. A frame that has not left yet is replaced. From other threads than
        the loop's use `Session`.
        """
        frame = self.encode(pressure_pa, window, client_time_us, deadline_us)
        self.hand_over(frame)
        return frame.outcome

    async def render(self, pressure_pa: ArrayLike | None = None, **more: Any) -> Answer:
        """`send`, and waits for the outcome."""
        return await asyncio.wrap_future(self.send(pressure_pa, **more))

    async def renew(self, **hello: Any) -> dict[str, Any]:
        """Says hello again, in the open session; raises Refused, and the old terms stand."""
        async with self._writing:
            if self._socket is None:
                raise Unreachable(f"{self.url} is not connected")
            self._renewal = asyncio.get_running_loop().create_future()
            try:
                await self._socket.send(self._words(hello))
                ready = await asyncio.wait_for(self._renewal, _PATIENCE_S)
            except (OSError, WebSocketException, TimeoutError) as error:
                raise Unreachable(f"{self.url}: no answer to the new hello: {error}") from error
            finally:
                self._renewal = None
            await self._agree(ready)
            self._hello = hello
            return ready

    def encode(
        self,
        pressure_pa: ArrayLike | None,
        window: Window | None,
        client_time_us: int | None,
        deadline_us: int,
    ) -> Frame:
        self._check_open()
        samples, window = check.pressure(pressure_pa, window)
        self._warned.ask_unit(samples, "pressure")
        self._sequence = (self._sequence + 1) % 2**32
        time_us = time.monotonic_ns() // 1000 if client_time_us is None else client_time_us
        kind = self.ready["sample_type"]
        message = wire.encode(samples, window, kind, self._sequence, time_us, deadline_us)
        return Frame(self._sequence, time_us, message)

    def _hand_over(
        self, kind: str, values: ArrayLike, finger: int, net: NetForce | None, client_time_us: int | None
    ) -> Future[Answer]:
        frame = self.encode_rows(kind, values, finger, net, client_time_us)
        self.hand_over(frame)
        return frame.outcome

    def send_not_tracked(self, *, finger: int = 0) -> Future[Answer]:
        """Hands over that tracking of the finger is lost, and returns at once.

        Better than an old pose, or one of zeros: the answer is zero, no unit fires, and nothing bursts
        when tracking comes back. What the service remembers of the finger waits for the next frame.
        """
        frame = self.encode_not_tracked(finger)
        self.hand_over(frame)
        return frame.outcome

    async def not_tracked(self, *, finger: int = 0) -> Answer:
        """`send_not_tracked`, and waits for the outcome."""
        return await asyncio.wrap_future(self.send_not_tracked(finger=finger))

    async def touch(self, poses: ArrayLike | None, *, finger: int = 0, net: NetForce | None = None) -> Answer:
        """`send_poses`, and waits for the outcome; `.touch` holds the force. None: tracking is lost."""
        if poses is None:
            return await self.not_tracked(finger=finger)
        return await asyncio.wrap_future(self.send_poses(poses, finger=finger, net=net))

    def encode_rows(
        self, kind: str, values: ArrayLike, finger: int, net: NetForce | None, client_time_us: int | None = None
    ) -> Frame:
        self._check_open()
        rows = check.rows(kind, values)
        self._warned.ask_unit(rows, kind)
        self._sequence = (self._sequence + 1) % 2**32
        time_us = time.monotonic_ns() // 1000 if client_time_us is None else client_time_us
        message = wire.encode_rows(kind, rows, net, finger, self._sequence, time_us)
        return Frame(self._sequence, time_us, message, finger)

    def encode_not_tracked(self, finger: int) -> Frame:
        self._check_open()
        self._sequence = (self._sequence + 1) % 2**32
        time_us = time.monotonic_ns() // 1000
        message = wire.encode_not_tracked(finger, self._sequence, time_us)
        return Frame(self._sequence, time_us, message, finger)

    def unit_is_known(self) -> None:
        """Asks no more whether frames are in another unit than Pa or mm."""
        self._warned.unit_is_known()

    def _check_open(self) -> None:
        if self._closed:
            raise Closed("the session is closed")
        if self._fault is not None:
            raise self._fault

    def hand_over(self, frame: Frame) -> None:
        if self._closed or self._fault is not None:
            return self._lose(frame)
        # At the end: fingers take turns.
        old = self._waiting.pop(frame.finger, None)
        self._waiting[frame.finger] = frame
        if old is not None:
            self.superseded_by_client += 1
            old.end("superseded", by_client=True)
        self._wake.set()

    def _words(self, hello: dict[str, Any]) -> str:
        return wire.hello({"reconnect": True, **hello})

    async def _connect(self) -> None:
        socket = await self._dial()
        await self._begin(socket, await self._say(socket, self._hello))
        self._connected.set()

    async def _dial(self) -> ClientConnection:
        """A connection on which nothing was said."""
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        try:
            raw = await dial(self._address.host, self._address.port)
            ws = self._address.session()
            options: dict[str, Any] = {"compression": None, "max_size": 2**20, "proxy": None, "close_timeout": 1.0}
            return await connect(ws, sock=raw, additional_headers=headers, **options)
        except InvalidStatus as error:
            raise refusal(bytes(error.response.body or b""), str(error)) from None
        except (OSError, WebSocketException) as error:
            raise Unreachable(f"{self.url}: {error}; is papilla-server running there?{without_service()}") from error

    async def _say(
        self, socket: ClientConnection, hello: dict[str, Any], sealed: bytes | None = None
    ) -> dict[str, Any]:
        """Says hello, with the state that it announces; what the service agreed to."""
        try:
            await socket.send(self._words(hello))
            if sealed is not None:
                await socket.send(sealed)
            message = json.loads(await asyncio.wait_for(socket.recv(), _PATIENCE_S))
        except (OSError, WebSocketException, TimeoutError) as error:
            raise Unreachable(f"{self.url}: {error}; is papilla-server running there?{without_service()}") from error
        if message["type"] != "ready":
            await socket.close()
            raise Refused(message["code"], message["message"], message.get("field"))
        ready: dict[str, Any] = message
        return ready

    async def _begin(self, socket: ClientConnection, ready: dict[str, Any]) -> None:
        self._socket = socket
        self._seals_due = 0
        await self._agree(ready)
        self.connections += 1

    async def _follow(self) -> None:
        """Goes on over another connection, with what the service remembers.

        Frames go on over the old one until the new one is there; then they wait for what was sent to
        be answered, and for ready. If the service does not say what it remembers, the session stays
        until it is asked again.
        """
        while True:
            new = None
            try:
                new = await self._dial()
                async with self._writing:
                    old = self._socket
                    assert old is not None
                    sealed = await self._seal(old)
                    saying = self._say(new, {**self._hello, "resume": True}, sealed)
                    ready = await asyncio.wait_for(saying, _MOVE_PATIENCE_S)
                    await self._begin(new, ready)
            except StaysError as why:
                self._following = None
                words = told_stays(str(why))
                self._warned.once(words, words)
                if new is not None:
                    await new.close()
                return
            except (OSError, WebSocketException, Unreachable, Refused):
                # The old connection goes on for as long as it is there.
                if new is not None:
                    await new.close()
                await asyncio.sleep(_RETRY_S)
                continue
            self._following = None
            if self._reading is not None:
                self._reading.cancel()
            await old.close()
            return

    async def _seal(self, socket: ClientConnection) -> bytes:
        """What the service remembers, once it has answered what was sent; StaysError: it does not say."""
        self._sealed = asyncio.get_running_loop().create_future()
        self._seals_due += 1
        try:
            await socket.send(json.dumps({"type": "seal"}))
            return await asyncio.wait_for(self._sealed, _MOVE_PATIENCE_S)
        except TimeoutError:
            raise StaysError(f"nothing came within {_MOVE_PATIENCE_S:g} s") from None
        finally:
            self._sealed = None

    def _seal_came(self) -> asyncio.Future[bytes] | None:
        """Who waits for what came as a sealed state, or in place of one; None: nobody any more."""
        self._seals_due = max(0, self._seals_due - 1)
        is_awaited = self._seals_due == 0 and self._sealed is not None and not self._sealed.done()
        return self._sealed if is_awaited else None

    async def _agree(self, ready: dict[str, Any]) -> None:
        self.ready = ready
        self._tiers.update(enumerate(ready.get("tier_names", [])))
        self._tiers.setdefault(ready["tier_number"], ready["tier"])
        for words in questions(ready):
            self._warned.once(words, words)

    async def _live(self) -> None:
        """Reads until the connection breaks, and then opens another."""
        while True:
            socket = self._socket
            assert socket is not None
            self._reading = asyncio.create_task(self._read(socket))
            await asyncio.wait([self._reading])
            if self._socket is not socket:
                # It has moved.
                continue
            self._connected.clear()
            if self._following is not None:
                self._following.cancel()
                self._following = None
            self._wake.set()
            if self._renewal is not None and not self._renewal.done():
                self._renewal.set_exception(Unreachable("the connection broke"))
            self._lose_sent()
            while not self._connected.is_set():
                await asyncio.sleep(_RETRY_S)
                try:
                    async with self._writing:
                        await self._connect()
                except Unreachable:
                    continue
                except Refused as error:
                    if error.code in ("overloaded", "shutting_down", "rate_limited", "timeout"):
                        continue
                    # The service is another one now: the program has to know.
                    self._fault = error
                    for frame in self._waiting.values():
                        self._lose(frame)
                    self._waiting.clear()
                    return
            self._wake.set()

    async def _watch(self) -> None:
        """Ends frames whose time is over."""
        while True:
            await asyncio.sleep(min(max(0.05 * self.timeout_s, 0.005), 0.1))
            born_s = time.monotonic() - self.timeout_s
            for finger, frame in list(self._waiting.items()):
                if frame.born_s < born_s:
                    del self._waiting[finger]
                    self._time_out(frame)
            late = [frame for frame in self._sent.values() if frame.born_s < born_s]
            for frame in late:
                del self._sent[frame.sequence]
                self._time_out(frame)
            if late and self._socket is not None:
                # A service that stopped, or a network that is gone: nothing more will come of this connection.
                self._socket.transport.abort()

    def _time_out(self, frame: Frame) -> None:
        self._warned.once("timeout", f"no answer within {self.timeout_s:g} s; such frames are lost")
        self._lose(frame)

    def _lose_sent(self) -> None:
        for frame in list(self._sent.values()):
            self._lose(frame)
        self._sent.clear()

    async def _read(self, socket: ClientConnection) -> None:
        try:
            async for message in socket:
                if isinstance(message, bytes):
                    self._answered(message)
                else:
                    self._told(json.loads(message))
        except (OSError, WebSocketException, ValueError):
            # Broken, or no longer the protocol: either way this connection is over.
            await socket.close()

    def _answered(self, message: bytes) -> None:
        if message.startswith(wire.SEALED):
            sealed = self._seal_came()
            if sealed is not None:
                sealed.set_result(message)
            return
        header = wire.decode(message)
        frame = self._sent.pop(header.sequence, None)
        if frame is not None:
            tier = self._tiers.get(header.tier, "")
            if "out_of_range" in header.flags:
                self._warned.once("out_of_range", told_beyond(tier))
            if "coarse_clock" in header.flags:
                self._warned.once("coarse_clock", TOLD_CLOCK)
            frame.give(answers.read(message, header, frame.ready, tier))

    def _told(self, message: dict[str, Any]) -> None:
        if message["type"] == "reconnect":
            if self._following is None:
                self._following = asyncio.create_task(self._follow())
            return
        sequence: int | None = message.get("sequence")
        frame = None if sequence is None else self._sent.pop(sequence, None)
        if frame is not None:
            problem = Problem(message["code"], message["message"], message.get("field"))
            self._warned.once(problem.code, told_refused(problem))
            frame.end("error", problem=problem)
        elif sequence is not None:
            # Of a frame whose time is over.
            return
        elif self._renewal is not None and not self._renewal.done():
            if message["type"] == "ready":
                self._renewal.set_result(message)
            else:
                refused = Refused(message["code"], message["message"], message.get("field"))
                self._renewal.set_exception(refused)
        elif self._seals_due > 0 and message["type"] == "error":
            sealed = self._seal_came()
            if sealed is not None:
                sealed.set_exception(StaysError(message["message"]))

    async def _write(self) -> None:
        """Sends what waits, one frame at a time."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            await self._connected.wait()
            async with self._writing:
                if not self._waiting or self._socket is None:
                    continue
                frame = self._waiting.pop(next(iter(self._waiting)))
                if self._waiting:
                    self._wake.set()
                frame.ready = self.ready
                self._sent[frame.sequence] = frame
                try:
                    await self._socket.send(frame.message)
                except (OSError, WebSocketException):
                    if self._sent.pop(frame.sequence, None):
                        self._lose(frame)

    @staticmethod
    def _lose(frame: Frame | None) -> None:
        if frame is not None:
            frame.end("lost")
