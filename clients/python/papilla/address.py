"""Addresses of a service, as every client takes them (docs/reference/clients/README.md), and its token."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

from .errors import BadAddress, Refused

PORT: Final = 7224
"""The service's port, where an address names neither a port nor a scheme."""
_SECURE: Final = {"http": False, "ws": False, "https": True, "wss": True}
_BLANKS: Final = " \t\r\n\f\v"
_ODD: Final = re.compile(r"[^!-~]|[\"<>\\^`{|}]")
_HOST: Final = re.compile(r"[A-Za-z0-9._-]+")
_IPV6: Final = re.compile(r"[0-9A-Fa-f.]*:[0-9A-Fa-f.]*:[0-9A-Fa-f:.]*")
_Bad: TypeAlias = Callable[[str], BadAddress]


class Address(NamedTuple):
    """Where a service is: its host, its port, whether by TLS, and the path in front of its own."""

    secure: bool
    host: str
    port: int
    path: str

    @classmethod
    def parse(cls, text: str) -> Address:
        """Reads `host`, `host:port` or a URL of http, https, ws or wss; raises BadAddress."""

        def bad(why: str) -> BadAddress:
            return BadAddress(text, why)

        rest = text.strip(_BLANKS)
        if not rest:
            raise bad("it is empty")
        if _ODD.search(rest):
            raise bad("it holds a blank or another character that no address has")
        secure, default = False, PORT
        if "://" in rest:
            scheme, _, rest = rest.partition("://")
            if scheme.lower() not in _SECURE:
                raise bad(f"'{scheme}' is none of http, https, ws, wss")
            secure = _SECURE[scheme.lower()]
            default = 443 if secure else 80
        if "?" in rest or "#" in rest:
            raise bad("nothing can follow a '?' or '#'; a token is an argument of its own")
        authority, slash, path = rest.partition("/")
        if "@" in authority:
            raise bad("it holds a user or a password; a token is an argument of its own")
        host, port = cls._split(authority, bad)
        number = default if port is None else int(port) if re.fullmatch("[0-9]{1,5}", port) else 0
        if not 1 <= number <= 65535:
            raise bad("its port is no number from 1 to 65535")
        return cls(secure, host, number, (slash + path).rstrip("/"))

    @staticmethod
    def _split(authority: str, bad: _Bad) -> tuple[str, str | None]:
        """Host, without brackets, and port, if there is one."""
        if authority.startswith("["):
            host, _, after = authority[1:].partition("]")
            if not _IPV6.fullmatch(host) or (after and not after.startswith(":")):
                raise bad("in brackets stands an IPv6 address, as [::1]:7224")
            return host, after[1:] if after else None
        if authority.count(":") > 1:
            raise bad("an IPv6 address stands in brackets, as [::1]:7224")
        host, colon, port = authority.partition(":")
        if not _HOST.fullmatch(host):
            raise bad("its host is missing or has a character that no host has")
        return host, port if colon else None

    def _url(self, scheme: str, path: str) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        default = 443 if self.secure else 80
        port = "" if self.port == default else f":{self.port}"
        return f"{scheme}{'s' if self.secure else ''}://{host}{port}{self.path}{path}"

    def http(self, path: str) -> str:
        """URL of one of the service's paths."""
        return self._url("http", path)

    def session(self) -> str:
        """URL of sessions."""
        return self._url("ws", "/v1/session")


def clean_token(token: str | None) -> str | None:
    """The token without blanks and line ends around it, as files have them; raises Refused for others inside."""
    cleaned = None if token is None else token.strip(_BLANKS)
    if cleaned is not None and re.search(r"[^!-~]", cleaned):
        raise Refused("bad_token", "the token holds a blank, a line end or a character that no token has", "token")
    return cleaned or None
