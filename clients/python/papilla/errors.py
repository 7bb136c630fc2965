"""What can go wrong."""

from __future__ import annotations


class PapillaError(Exception):
    """Any error of this package."""


class Unreachable(PapillaError):
    """The service does not answer."""


class Closed(PapillaError):
    """The session was closed by this program."""


class Refused(PapillaError):
    """The service refused a request or a hello; `code` is one of docs/reference/protocol-errors.md's."""

    def __init__(self, code: str, message: str, field: str | None = None) -> None:
        super().__init__(f"{code}: {message}" + (f" (in '{field}')" if field else ""))
        self.code = code
        self.message = message
        self.field = field


class BadAddress(PapillaError, ValueError):
    """What was given as the service's address is none that a client takes."""

    def __init__(self, address: str, why: str) -> None:
        ways = "write host, host:port, [IPv6]:port or http(s)://host:port/path"
        super().__init__(f"{address!r} is no address of a papilla-server: {why}; {ways}")


class NotRendered(PapillaError):
    """An answer without a map was asked for its map; `status` says why it has none."""

    def __init__(self, status: str, reason: str) -> None:
        super().__init__(f"the frame is {status}: {reason}")
        self.status = status


class NotCarried(PapillaError):
    """An answer was asked for what its session does not carry; `member` is what, the message how to get it."""

    def __init__(self, member: str, advice: str) -> None:
        super().__init__(f"the answer carries no {member}: {advice}")
        self.member = member


class BadFrame(PapillaError, ValueError):
    """A number of a frame is none that a frame can hold; `member` is which."""

    def __init__(self, member: str, value: object, most: int) -> None:
        super().__init__(f"{member} is {value!r}; a frame holds a whole number from 0 to {most}")
        self.member = member


class BadInput(PapillaError, ValueError):
    """An argument is not what it has to be; nothing was sent or written. `member` names it, `frame` counts from 0."""

    def __init__(self, member: str, message: str, frame: int | None = None) -> None:
        super().__init__(f"{member}" + ("" if frame is None else f", frame {frame}") + f": {message}")
        self.member = member
        self.frame = frame


class FrameFailed(PapillaError):
    """A frame of a series came to no answer; `frame` counts from 0, `status` is its outcome."""

    def __init__(self, frame: int, status: str, reason: str) -> None:
        super().__init__(f"frame {frame} is {status}: {reason}")
        self.frame = frame
        self.status = status


class MissingExtra(PapillaError, ImportError):
    """A function needs packages that are not installed; `extra` is the extra of papilla that brings them."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs packages that are missing here: pip install 'papilla[{extra}]'")
        self.extra = extra


class NativeMissing(PapillaError, ImportError):
    """What computes in process needs the module `papilla._native`, which this installation lacks."""

    def __init__(self, why: str) -> None:
        super().__init__(
            f"papilla._native cannot be loaded ({why}). It is in Papilla's wheels: install one, or build it with "
            "clients/python/wheel. papilla.Session(url) needs no native module"
        )


class NativeFault(PapillaError):
    """A fault of Papilla's own native code; the interpreter goes on."""

    def __init__(self, message: str) -> None:
        super().__init__(f"a fault of papilla._native, which is worth a report: {message}")


class BadModels(PapillaError):
    """A folder of models cannot be used; the message names the file, what is wrong and what to do."""


class BadDataset(PapillaError):
    """A folder holds no dataset, a damaged one, or that of another campaign; the message says which, and of what."""


class BadScene(PapillaError, ValueError):
    """A scene or a campaign of finite elements cannot be.

    `field` is the member that is to blame, dotted, and `line` its line.
    """

    def __init__(self, message: str, field: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.field = field
        self.line = line


class NotSolved(PapillaError):
    """A scene of finite elements found no equilibrium.

    `kind` is `no_equilibrium`, `too_many_steps`, `slipped`, `force_not_reached`, `inverted`, `free_part`,
    `too_large`, `stopped`, or, of a campaign, `nothing_solved`; `states` is how many states were found before.
    `depth_mm` is the depth that was aimed at, and `reached` the part of the whole load in equilibrium, both None
    where there is none.
    """

    def __init__(
        self, message: str, kind: str, depth_mm: float | None = None, reached: float | None = None, states: int = 0
    ) -> None:
        super().__init__(message)
        self.kind = kind
        self.depth_mm = depth_mm
        self.reached = reached
        self.states = states
