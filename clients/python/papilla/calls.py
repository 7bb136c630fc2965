"""What can be called on a session, whether it has a service or is in process."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from .answer import Answer
from .wire import NetForce, Window

if TYPE_CHECKING:
    from .send_series import Progress
    from .series import Series


class Sends(ABC):
    """Calls that hand over rows of the hello's `input`, with or without asyncio."""

    @abstractmethod
    def _hand_over(
        self, kind: str, values: ArrayLike, finger: int, net: NetForce | None, client_time_us: int | None
    ) -> Future[Answer]:
        """Hands over rows of the hello's `input`: `objects` or `gaps`."""

    def send_poses(
        self,
        poses: ArrayLike,
        *,
        finger: int = 0,
        net: NetForce | None = None,
        client_time_us: int | None = None,
    ) -> Future[Answer]:
        """Hands over where the objects of the hello are, and returns at once.

        `poses` has a row of seven for each: its origin in the finger's frame, mm, and its turn as a
        unit quaternion x y z w. `net` is a net force to be met: a unit vector and N.
        """
        return self._hand_over("objects", poses, finger, net, client_time_us)

    def send_gaps(
        self,
        depth_mm: ArrayLike,
        *,
        finger: int = 0,
        net: NetForce | None = None,
        client_time_us: int | None = None,
    ) -> Future[Answer]:
        """Hands over how deep the undeformed skin lies in things, mm; negative in air.

        With `velocity` in the hello, x y z mm/s of each vertex follow the depths.
        """
        return self._hand_over("gaps", depth_mm, finger, net, client_time_us)


class Calls(Sends):
    """Calls that wait, on top of those that hand over."""

    timeout_s: float
    """Time within which a frame has an outcome, s."""

    @property
    @abstractmethod
    def warnings(self) -> list[str]: ...

    @property
    @abstractmethod
    def ready(self) -> dict[str, Any]: ...

    @property
    @abstractmethod
    def hello(self) -> dict[str, Any]: ...

    @abstractmethod
    def send(
        self,
        pressure_pa: ArrayLike | None = None,
        *,
        window: Window | None = None,
        client_time_us: int | None = None,
        deadline_us: int = 0,
    ) -> Future[Answer]: ...

    @abstractmethod
    def unit_is_known(self) -> None: ...

    @abstractmethod
    def send_not_tracked(self, *, finger: int = 0) -> Future[Answer]: ...

    def render(
        self,
        pressure_pa: ArrayLike | None = None,
        *,
        window: Window | None = None,
        client_time_us: int | None = None,
        deadline_us: int = 0,
        timeout_s: float | None = None,
    ) -> Answer:
        """`send`, and waits for the outcome; raises TimeoutError after `timeout_s`."""
        sent = self.send(pressure_pa, window=window, client_time_us=client_time_us, deadline_us=deadline_us)
        return sent.result(timeout_s)

    def not_tracked(self, *, finger: int = 0, timeout_s: float | None = None) -> Answer:
        """`send_not_tracked`, and waits for the outcome."""
        return self.send_not_tracked(finger=finger).result(timeout_s)

    def touch(
        self, poses: ArrayLike | None, *, finger: int = 0, net: NetForce | None = None, timeout_s: float | None = None
    ) -> Answer:
        """`send_poses`, and waits for the outcome; `.touch` holds the force. None: tracking is lost."""
        if poses is None:
            return self.not_tracked(finger=finger, timeout_s=timeout_s)
        return self.send_poses(poses, finger=finger, net=net).result(timeout_s)

    def series(
        self,
        frames: ArrayLike | Iterable[ArrayLike],
        times: ArrayLike | None = None,
        *,
        unit: str | None = None,
        progress: Progress = None,
    ) -> Series:
        """Renders many frames in their order, none of which supersedes another; as `papilla.render`.

        What the session remembers goes on from what it was. No other thread may send meanwhile.
        """
        # Whoever sends frame by frame does not pay for it.
        from .send_series import on_session

        return on_session(self, frames, times, unit=unit, progress=progress)

    def series_chunks(
        self,
        frames: ArrayLike | Iterable[ArrayLike],
        times: ArrayLike | None = None,
        *,
        chunk: int = 256,
        unit: str | None = None,
        progress: Progress = None,
    ) -> Iterator[Series]:
        """`series` for what does not fit in memory: a result for each `chunk` frames."""
        from .send_series import chunks_on_session

        return chunks_on_session(self, frames, times, chunk=chunk, unit=unit, progress=progress)
