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
