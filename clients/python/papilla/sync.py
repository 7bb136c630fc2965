"""A session for programs without asyncio."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine
from concurrent.futures import Future
from types import TracebackType
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from .aio import TIMEOUT_S, AsyncSession
from .answer import Answer
from .calls import Calls
from .http import DEFAULT_URL
from .wire import NetForce, Window

_T = TypeVar("_T")


class Session(Calls):
    """As `AsyncSession`, on a thread of its own; can be used from several threads.

    `with Session() as session: session.render(pressure_pa).sed`
    """

    def __init__(
        self, url: str = DEFAULT_URL, token: str | None = None, *, timeout_s: float = TIMEOUT_S, **hello: Any
    ) -> None:
        """Connects and says hello; raises BadAddress, Refused or Unreachable."""
        self._loop = asyncio.new_event_loop()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True, name="papilla")
        self._thread.start()
        try:
            self._session = self._call(self._make(url, token, timeout_s, hello))
        except BaseException:
            self._stop()
            raise

    @staticmethod
    async def _make(url: str, token: str | None, timeout_s: float, hello: dict[str, Any]) -> AsyncSession:
        session = AsyncSession(url, token, timeout_s=timeout_s, **hello)
        await session.open()
        return session

    def __enter__(self) -> Session:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the session; frames without an outcome are `lost`."""
        if self._thread.is_alive():
            self._call(self._session.close())
            self._stop()

    def _stop(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _call(self, work: Coroutine[Any, Any, _T]) -> _T:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    @property
    def ready(self) -> dict[str, Any]:
        """What the service agreed to: tier, ranges, sections, ..."""
        return self._session.ready

    @property
    def connected(self) -> bool:
        """Whether there is a session with the service just now."""
        return self._session.connected

    @property
    def superseded_by_client(self) -> int:
        """Frames that a newer one replaced before they left."""
        return self._session.superseded_by_client

    @property
    def connections(self) -> int:
        """Times that a session was opened; more than 1 after a reconnect."""
        return self._session.connections

    @property
    def warnings(self) -> list[str]:
        """What was logged for people to read; see `AsyncSession.warnings`."""
        return self._session.warnings

    @property
    def timeout_s(self) -> float:
        """Time within which a frame has an outcome, s; after it the frame is `lost`. May be changed."""
        return self._session.timeout_s

    @timeout_s.setter
    def timeout_s(self, value: float) -> None:
        self._session.timeout_s = value

    def send(
        self,
        pressure_pa: ArrayLike | None = None,
        *,
        window: Window | None = None,
        client_time_us: int | None = None,
        deadline_us: int = 0,
    ) -> Future[Answer]:
        """Hands over one frame and returns at once; see `AsyncSession.send`."""
        with self._lock:
            frame = self._session.encode(pressure_pa, window, client_time_us, deadline_us)
            self._loop.call_soon_threadsafe(self._session.hand_over, frame)
        return frame.outcome

    def send_not_tracked(self, *, finger: int = 0) -> Future[Answer]:
        """Hands over that tracking is lost and returns at once; see `AsyncSession.send_not_tracked`."""
        with self._lock:
            frame = self._session.encode_not_tracked(finger)
            self._loop.call_soon_threadsafe(self._session.hand_over, frame)
        return frame.outcome

    def unit_is_known(self) -> None:
        """Asks no more whether frames are in another unit than Pa or mm."""
        self._session.unit_is_known()

    @property
    def hello(self) -> dict[str, Any]:
        """The terms that this session asked for last."""
        return self._session.hello

    def _hand_over(
        self, kind: str, values: ArrayLike, finger: int, net: NetForce | None, client_time_us: int | None
    ) -> Future[Answer]:
        with self._lock:
            frame = self._session.encode_rows(kind, values, finger, net, client_time_us)
            self._loop.call_soon_threadsafe(self._session.hand_over, frame)
        return frame.outcome

    def renew(self, **hello: Any) -> dict[str, Any]:
        """Says hello again, in the open session; raises Refused, and the old terms stand."""
        return self._call(self._session.renew(**hello))
