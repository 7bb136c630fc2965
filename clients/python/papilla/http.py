"""One map over HTTP, and the rest of the HTTP surface that a client needs."""

from __future__ import annotations

import io
import json
import urllib.error
import urllib.parse
import urllib.request
from importlib.util import find_spec
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import check
from .address import Address, clean_token
from .errors import BadInput, Refused, Unreachable
from .model import shared
from .wire import SIDE_PX, WHOLE, Map

DEFAULT_URL: Final = "http://127.0.0.1:7224"
LOCAL: Final = "local"
"""In place of an address: no service, this process computes."""
_NPY: Final = "application/x-npy"
# No proxy of the environment between a VR engine and the service beside it.
_OPENER: Final = urllib.request.build_opener(urllib.request.ProxyHandler({}))


class HttpAnswer(NamedTuple):
    """A map over HTTP: SED, J/m3, the tier that rendered it, and times in the server, us."""

    sed: Map
    tier: str
    queue_us: int
    infer_us: int
    total_us: int


class Indentation(NamedTuple):
    """An indentation that the FE solver computed: its pressure, Pa, and its SED, J/m3."""

    name: str
    pressure_pa: Map
    sed_j_per_m3: Map


def request(
    url: str,
    path: str,
    body: bytes | None = None,
    accept: str = "*/*",
    token: str | None = None,
    timeout_s: float = 30.0,
) -> tuple[bytes, dict[str, str]]:
    """Body and headers of an answer; raises BadAddress, Refused or Unreachable."""
    if url == LOCAL:
        raise BadInput("url", f"{LOCAL!r} is this process, which has no {path}: give the address of a service")
    headers = {"accept": accept}
    if body is not None:
        headers["content-type"] = _NPY
    if token := clean_token(token):
        headers["authorization"] = f"Bearer {token}"
    asked = urllib.request.Request(Address.parse(url).http(path), body, headers)
    try:
        with _OPENER.open(asked, timeout=timeout_s) as answer:
            return answer.read(), dict(answer.headers)
    except urllib.error.HTTPError as error:
        raise refusal(error.read(), f"status {error.code}") from None
    except OSError as error:
        raise Unreachable(f"{url}: {error}; is papilla-server running there?{without_service()}") from error


def without_service() -> str:
    """What to do without a service, where this installation can compute."""
    if find_spec("papilla._native") is None:
        return ""
    return (
        " Here it can be done without: with url='local' in papilla.sed, render, Atlas.load and sensors, --url local of "
        "python -m papilla, or papilla.local() in place of Session this process computes"
    )


def refusal(body: bytes, otherwise: str) -> Refused:
    """The error that the body of an answer holds."""
    try:
        problem = json.loads(body)["error"]
        message = problem["message"]
        if problem["code"] == "unauthorized":
            message += '; here as token="...", one of the tokens that the service was started with'
        return Refused(problem["code"], message, problem.get("field"))
    except (ValueError, KeyError, TypeError):
        return Refused("internal", otherwise)


def get_json(url: str, path: str, token: str | None = None) -> Any:
    """What a path answers, as JSON."""
    return json.loads(request(url, path, token=token)[0])


def _array(body: bytes) -> Map:
    return np.asarray(np.load(io.BytesIO(body), allow_pickle=False), np.float32)


def post(
    pressure_pa: ArrayLike,
    *,
    url: str = DEFAULT_URL,
    finger: str | None = None,
    tier: str | None = None,
    budget_us: int | None = None,
    token: str | None = None,
) -> HttpAnswer:
    """SED of one pressure map (224 x 224, Pa), with what is known about it.

    Raises BadInput, Refused (with the code of docs/reference/protocol-errors.md) or Unreachable.
    """
    body = io.BytesIO()
    np.save(body, check.samples(pressure_pa, WHOLE).astype("<f4", copy=False))
    asked = {"finger": finger, "tier": tier, "budget_us": budget_us}
    query = urllib.parse.urlencode({k: v for k, v in asked.items() if v is not None})
    path = "/v1/sed" + (f"?{query}" if query else "")
    answer, headers = request(url, path, body.getvalue(), _NPY, token)
    told = {name.lower(): value for name, value in headers.items()}
    times = [int(told.get(f"x-papilla-{name}-us", 0)) for name in ("queue", "infer", "total")]
    return HttpAnswer(_array(answer), told.get("x-papilla-tier", ""), *times)


def sed(
    pressure_pa: ArrayLike,
    *,
    url: str = DEFAULT_URL,
    finger: str | None = None,
    tier: str | None = None,
    budget_us: int | None = None,
    unit: str | None = None,
    token: str | None = None,
) -> Map:
    """SED (J/m3) of one pressure map (Pa), both 224 x 224.

    `finger` by name, or the service's default. `tier` by name, or the most accurate that meets `budget_us`, or the
    default of the finger. `unit` is Pa, kPa or MPa; without it a map that is weak for Pa is asked about, by BadInput.
    `url="local"` needs no service: this process computes (see `Model`), and takes neither `finger` nor `budget_us`.
    Raises BadInput, Refused or Unreachable, in this process BadModels and NativeMissing.
    """
    pressure_pa, said = check.given(pressure_pa, "pressure_pa", "pressure", unit)
    pressure_pa = check.samples(pressure_pa, WHOLE)
    if not said:
        check.ask_unit(check.size_of(pressure_pa, "pressure"), "pressure")
    if url == LOCAL:
        for member, value in (("finger", finger), ("budget_us", budget_us)):
            if value is not None:
                raise BadInput(member, "a service has it; this process does not: give the address of a service")
        return shared(tier).sed(pressure_pa, unit="Pa")
    return post(pressure_pa, url=url, finger=finger, tier=tier, budget_us=budget_us, token=token).sed


def indentation(
    number: int = 0, *, url: str = DEFAULT_URL, finger: str | None = None, token: str | None = None
) -> Indentation:
    """One of the FE indentations that the service ships: input and truth. `finger` by name, or the default one.

    They are the service's: `url="local"` is refused by BadInput.
    """
    query = "" if finger is None else "?" + urllib.parse.urlencode({"finger": finger})
    name = get_json(url, "/v1/presses" + query, token)["presses"][number]["name"]
    paths = [f"/v1/presses/{number}/{what}{query}" for what in ("pressure", "sed")]
    maps = [_array(request(url, path, None, _NPY, token)[0]) for path in paths]
    assert all(map_.shape == (SIDE_PX, SIDE_PX) for map_ in maps)
    return Indentation(name, *maps)
