"""What haptic devices take of a session: intensities from 0 to 1, at the device's own rate, and 0 when frames stop.

`device = Device(force(full_n=2.0))`, then `device.feed(answer)` for every answer and `device.poll()` as often as
you like; each `Command` it gives goes to the device. The guide is docs/guides/devices.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answer import Answer
from .errors import BadInput, NotCarried

Levels = NDArray[np.float64]
Read = Callable[[Answer], ArrayLike | None]
"""Intensities of an answer, from 0 to 1; None: the answer says nothing about them."""


class Command(NamedTuple):
    """What to send to the device now."""

    levels: Levels
    """Intensity of each actuator, 0 to 1: (finger, actuator)."""
    duration_s: float
    """How long the device may hold it: until the last command would have faded if no other follows."""

    @property
    def amplitude(self) -> float:
        """The greatest intensity: for a device with one motor, such as a controller."""
        return float(self.levels.max())


def force(full_n: float, threshold_n: float = 0.0) -> Read:
    """One intensity: the size of the force on the finger, 0 at `threshold_n` and 1 from `full_n` on.

    For sessions with objects or gaps, whose answers carry a touch; of pressure maps the effect `summary` has the force.
    """
    span_n = _above("full_n", full_n, threshold_n)

    def read(answer: Answer) -> ArrayLike | None:
        if answer.touch is not None:
            found = float(np.linalg.norm(answer.touch.force_n))
        elif answer.summary is not None:
            found = answer.summary.force_n
        elif answer.no_contact or answer.not_tracked:
            found = 0.0
        else:
            raise NotCarried("force", "send objects or gaps, or name the effect 'summary' in the hello")
        return (found - threshold_n) / span_n

    return read


def actuators(full: float = 1.0) -> Read:
    """An intensity for each actuator of the effect `actuators`; `full` is its `max`."""
    _above("full", full, 0.0)

    def read(answer: Answer) -> ArrayLike | None:
        if answer.actuators is None:
            raise NotCarried("actuators", "name the effect 'actuators' in the hello")
        return np.asarray(answer.actuators, np.float64) / full

    return read


class SpikeRate:
    """One intensity from the effect `spikes`: mean firing rate of the units of some classes, 1 from `full_hz` on.

    The mean is over all of them, and most lie outside of a contact: a few Hz are much. Rapidly adapting (`ra`) and
    Pacinian (`pc`) units fire at changes, as a motor should. Make one for each finger.
    """

    def __init__(self, ready: dict[str, Any], full_hz: float, classes: Iterable[str] = ("ra", "pc")) -> None:
        if "units" not in ready:
            raise NotCarried("spikes", "name the effect 'spikes' in the hello")
        self._full_hz = _above("full_hz", full_hz, 0.0)
        wanted = set(classes)
        self._mine = np.array([unit["class"] in wanted for unit in ready["units"]], bool)
        if not self._mine.any():
            raise BadInput("classes", f"no unit of the session is of {', '.join(sorted(wanted))}: see ready['units']")
        self._last_us: int | None = None

    def __call__(self, answer: Answer) -> ArrayLike | None:
        if answer.spikes is None:
            raise NotCarried("spikes", "name the effect 'spikes' in the hello")
        before_us, self._last_us = self._last_us, answer.client_time_us
        if before_us is None or answer.client_time_us <= before_us:
            return None
        # The service computes the last 50 ms of a longer pause.
        seconds = 1e-6 * min(answer.client_time_us - before_us, 50_000)
        fired = np.count_nonzero(self._mine[answer.spikes.unit])
        return float(fired / (np.count_nonzero(self._mine) * seconds * self._full_hz))


class Device:
    """A device with the same actuators on each of its fingers.

    It holds what the last answer of each finger said for `hold_s`, and then fades it to 0 within `fade_s`. Answers
    without a value (`late`, `lost`, refused, not tracked) count as none: so it falls silent when frames stop, whatever
    the reason. `clock` gives seconds that only rise.
    """

    def __init__(
        self,
        read: Read | list[Read],
        fingers: int = 1,
        *,
        max_hz: float = 90.0,
        hold_s: float = 0.05,
        fade_s: float = 0.05,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`read`: `force`, `actuators`, a `SpikeRate` or your own; a list has one for each finger.

        `max_hz`: how many commands a second the device takes.
        """
        self._read = list(read) if isinstance(read, list) else [read] * fingers
        if len(self._read) != fingers:
            raise BadInput(
                "read", f"{len(self._read)} readers for {fingers} fingers: give one for each, or one for all"
            )
        self.max_hz = _above("max_hz", max_hz, 0.0)
        self.hold_s = _above("hold_s", hold_s, 0.0)
        self.fade_s = _above("fade_s", fade_s, 0.0)
        self._clock = clock
        self._values: list[Levels] = [np.zeros(1) for _ in range(fingers)]
        self._at_s = [-np.inf] * fingers
        self._next_s = -np.inf
        self._silent = True

    def feed(self, answer: Answer) -> None:
        """Takes the next answer, of any finger."""
        finger = answer.finger
        if not 0 <= finger < len(self._values):
            raise BadInput("finger", f"{finger} is none of the device, which has {len(self._values)}, numbered from 0")
        if answer.status != "ok":
            return
        if answer.not_tracked:
            self._values[finger] = np.zeros_like(self._values[finger])
            return
        found = self._read[finger](answer)
        if found is None:
            return
        levels = np.atleast_1d(np.asarray(found, np.float64))
        # What is no number drives no motor: the finger fades as without an answer.
        if np.isfinite(levels).all():
            self._values[finger] = np.clip(levels, 0.0, 1.0)
            self._at_s[finger] = self._clock()

    def levels(self) -> Levels:
        """The intensities now: (finger, actuator)."""
        now_s = self._clock()
        width = max(value.size for value in self._values)
        found = np.zeros((len(self._values), width))
        for row, value, at_s in zip(found, self._values, self._at_s, strict=True):
            row[: value.size] = value * np.clip(1.0 - (now_s - at_s - self.hold_s) / self.fade_s, 0.0, 1.0)
        return found

    def poll(self) -> Command | None:
        """What is due; None before the device takes another command, or as long as it is silent anyway."""
        now_s = self._clock()
        if now_s < self._next_s:
            return None
        levels = self.levels()
        silent = not levels.any()
        if silent and self._silent:
            return None
        self._silent = silent
        self._next_s = now_s + 1.0 / self.max_hz
        return Command(levels, self.hold_s + self.fade_s)

    def stop(self) -> Command:
        """All at 0, whatever the rate: for the end of a program, or a lost device."""
        self._at_s = [-np.inf] * len(self._at_s)
        self._silent = True
        return Command(np.zeros_like(self.levels()), 0.0)


def _above(name: str, value: float, least: float) -> float:
    """The difference, where it is above 0."""
    if not (np.isfinite(value) and value > least):
        raise BadInput(name, f"{value!r} is no number above {least:g}")
    return value - least
