"""Frames of the protocol (docs/reference/protocol.md)."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import BadFrame, BadInput

VERSION: Final = 3
"""Version of the protocol, in hello and frames."""
SIDE_PX: Final = 224
"""Pixels along one side of every map."""

Map: TypeAlias = NDArray[np.float32]
Message: TypeAlias = bytes | bytearray
"""An answer: as a socket gave it, or as it was made in process."""
Window: TypeAlias = tuple[int, int, int, int]
"""Column, row, width, height, pixels."""
NetForce: TypeAlias = tuple[Sequence[float], float]
"""A unit vector in the finger's frame, and N along it."""

WHOLE: Final[Window] = (0, 0, SIDE_PX, SIDE_PX)
HEADER: Final = struct.Struct("<4sBBBBIHHQIfHHIIHBB")
HEAD: Final = np.dtype(
    [("magic", "S4"), ("version", "u1"), ("kind", "u1"), ("number", "u1"), ("status", "u1"), ("sequence", "<u4"),
     ("width", "<u2"), ("height", "<u2"), ("client_time_us", "<u8"), ("total_us", "<u4"), ("scale", "<f4"),
     ("column", "<u2"), ("row", "<u2"), ("queue_us", "<u4"), ("infer_us", "<u4"), ("tier", "<u2"), ("flags", "u1"),
     ("finger", "u1")]
)  # fmt: skip
"""The same for many answers at once."""
_SAMPLES: Final[dict[str, tuple[int, str, float]]] = {
    # name: number on the wire, numpy's name, greatest unit (0: not scaled)
    "f32": (0, "<f4", 0.0),
    "f16": (1, "<f2", 0.0),
    "u16": (2, "<u2", 65535.0),
    "u8": (3, "u1", 255.0),
}
_F16_MAX: Final = 65504.0
_NAMES: Final = {number: name for name, (number, _, _) in _SAMPLES.items()}
SEALED: Final = b"PPS"
"""What a sealed state begins with, as opposed to a frame."""
STATUSES: Final = ("ok", "superseded", "late", "error", "stale")
_SED: Final = 2
"""Kind of an answer."""
RATES_HEAD: Final = 16
"""Bytes before the samples of the section `rates`: their scale, and zeros."""
NOT_TRACKED: Final = 32
"""Flag of a frame whose client does not know where things are."""


class Header(NamedTuple):
    """The header of an answer."""

    sample_type: str
    status: str
    sequence: int
    window: Window
    client_time_us: int
    total_us: int
    scale: float
    queue_us: int
    infer_us: int
    tier: int
    flags: frozenset[str]
    finger: int


def _head(
    kind: int,
    number: int,
    sequence: int,
    window: Window,
    client_time_us: int,
    deadline_us: int,
    scale: float,
    flags: int = 0,
    finger: int = 0,
) -> bytes:
    """The header of a frame.

    Raises BadFrame for a number that has no room in it.
    """
    column, row, width, height = window
    try:
        return HEADER.pack(
            b"PPL1", VERSION, kind, number, 0, sequence, width, height, client_time_us, deadline_us, scale,
            column, row, 0, 0, 0, flags, finger,
        )  # fmt: skip
    except struct.error:
        _find_bad(window, client_time_us, deadline_us, finger)
        raise


def _find_bad(window: Window, client_time_us: int, deadline_us: int, finger: int) -> None:
    """Raises BadFrame for the first number that has no room in a header."""
    column, row, width, height = window
    side = 2**16 - 1
    for member, value, most in [
        ("finger", finger, 255), ("deadline_us", deadline_us, 2**32 - 1),
        ("client_time_us", client_time_us, 2**64 - 1), ("the window's column", column, side),
        ("the window's row", row, side), ("the window's width", width, side), ("the window's height", height, side),
    ]:  # fmt: skip
        if not isinstance(value, (int, np.integer)) or not 0 <= value <= most:
            raise BadFrame(member, value, most)


def parts(
    pressure_pa: NDArray[Any],
    window: Window,
    sample_type: str,
    sequence: int,
    client_time_us: int,
    deadline_us: int,
) -> tuple[bytes, NDArray[Any]]:
    """Header and samples of one pressure frame; `pressure_pa` has the window's shape."""
    number, dtype, unit_max = _SAMPLES[sample_type]
    scale = 1.0
    if unit_max and pressure_pa.size:
        # The finest scale that clips nothing; in f32, as the header carries it.
        scale = float(np.float32(float(np.max(pressure_pa)) / unit_max)) or 1.0
        with np.errstate(invalid="ignore"):
            samples = np.clip(np.rint(pressure_pa / scale), 0.0, unit_max).astype(dtype)
    elif sample_type == "f16" and pressure_pa.size and (greatest := float(np.max(np.abs(pressure_pa)))) > _F16_MAX:
        cure = "give the hello sample_type='f32'"
        raise BadInput(
            "pressure_pa", f"the frame's greatest value is {greatest:g}, and f16 ends at {_F16_MAX:g}: {cure}"
        )
    else:
        samples = pressure_pa.astype(dtype, copy=False)
    return _head(1, number, sequence, window, client_time_us, deadline_us, scale), samples


def encode(
    pressure_pa: NDArray[Any],
    window: Window,
    sample_type: str,
    sequence: int,
    client_time_us: int,
    deadline_us: int,
) -> bytes:
    """The message of one pressure frame; `pressure_pa` has the window's shape."""
    head, samples = parts(pressure_pa, window, sample_type, sequence, client_time_us, deadline_us)
    return head + samples.tobytes()


def encode_rows(
    kind: str,
    rows: NDArray[Any],
    net: NetForce | None,
    finger: int,
    sequence: int,
    client_time_us: int,
) -> bytes:
    """The message of poses (`rows` of seven) or of gaps (a row of them, or a map), as f32.

    A net force follows as a row of seven.
    """
    height, width = rows.shape
    samples = rows.astype("<f4").tobytes()
    if net is not None:
        samples += np.array(net_row(net), "<f4").tobytes()
        height += kind == "objects"
    window = (0, 0, width, height)
    return _head(INPUTS[kind], 0, sequence, window, client_time_us, 0, 1.0, finger=finger) + samples


def net_row(net: NetForce) -> list[float]:
    """The row of a net force; raises BadInput for what is none."""
    try:
        direction, force_n = net
        row = [*map(float, direction), float(force_n), 0.0, 0.0, 0.0]
    except (TypeError, ValueError):
        row = []
    if len(row) != 7 or isinstance(net, Mapping):
        due = "a unit vector in the finger's frame and N along it are due, as ([0, 0, 1], 1.0)"
        raise BadInput("net", f"{net!r}; {due}")
    return row


def encode_not_tracked(finger: int, sequence: int, client_time_us: int) -> bytes:
    """The message of a frame that says that nobody knows where things are: a header alone."""
    return _head(1, 0, sequence, (0, 0, 0, 0), client_time_us, 0, 1.0, NOT_TRACKED, finger)


INPUTS: Final = {"objects": 4, "gaps": 5}
"""Kinds of frames of poses and gaps."""
FLAGS = {
    1: "out_of_range", 2: "no_contact", 4: "unfamiliar", 8: "unsettled", 16: "cut_off",
    NOT_TRACKED: "not_tracked", 64: "coarse_clock",
}  # fmt: skip
"""Bits of an answer's flags."""
_NO_FLAGS: Final[frozenset[str]] = frozenset()


def hello(terms: Mapping[str, Any]) -> str:
    """The message of a hello; raises BadInput for what no message holds. No blanks: meshes fill what it may have."""
    said = {"type": "hello", "version": VERSION, **terms}
    if "objects" in said:
        said["objects"] = objects(said["objects"])
    try:
        return json.dumps(said, separators=(",", ":"), allow_nan=False)
    except ValueError as error:
        raise BadInput(next(_unsound(said, ""), "hello"), "a finite number is due") from error
    except TypeError as error:
        raise BadInput("hello", f"{error}; numbers, text, lists and dicts are due") from error


def objects(announced: Any) -> list[Any]:
    """The objects of a hello as a list, of a single one too; raises BadInput for a shape in place of an object."""
    found = [announced] if isinstance(announced, Mapping) else list(announced)
    for number, each in enumerate(found):
        if isinstance(each, Mapping) and isinstance(each.get("shape"), str):
            raise BadInput(
                f"objects[{number}]", f"this is a shape, and an object has one: give {{'shape': {dict(each)!r:.200}}}"
            )
    return found


def _unsound(value: Any, at: str) -> Iterator[str]:
    """Where numbers are that are not finite."""
    if isinstance(value, Mapping):
        for name, member in value.items():
            yield from _unsound(member, f"{at}.{name}" if at else str(name))
    elif isinstance(value, list | tuple):
        for number, member in enumerate(value):
            yield from _unsound(member, f"{at}[{number}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


def decode(message: Message) -> Header:
    """Reads an answer's header.

    Raises ValueError if the message is none.
    """
    if len(message) < HEADER.size:
        raise ValueError(f"an answer of {len(message)} bytes; a header has {HEADER.size}")
    (magic, version, kind, number, status, sequence, width, height, client_time_us, total_us,
     scale, column, row, queue_us, infer_us, tier, flags, finger) = HEADER.unpack_from(message)  # fmt: skip
    if magic != b"PPL1" or version != VERSION or kind != _SED or number not in _NAMES:
        raise ValueError(f"not an answer of version {VERSION} of the protocol")
    if status >= len(STATUSES):
        raise ValueError(f"an answer with status {status}")
    names = frozenset(name for bit, name in FLAGS.items() if flags & bit) if flags else _NO_FLAGS
    return Header(
        _NAMES[number], STATUSES[status], sequence, (column, row, width, height),
        client_time_us, total_us, scale, queue_us, infer_us, tier, names, finger,
    )  # fmt: skip


def floats(message: Message, offset: int, size: int) -> Map:
    """`size` bytes of float32 at `offset`."""
    return _values(message, "<f4", size // 4, offset)


def _values(message: Message, dtype: str, count: int, offset: int) -> Map:
    """Values that can be written to: those of a session in process lie where Rust wrote them."""
    values = np.frombuffer(message, dtype, count, offset)
    return values.astype(np.float32, copy=isinstance(message, bytes))


def samples(message: Message, offset: int, header: Header) -> Map:
    """The samples of the window, J/m3: (height, width)."""
    _, _, width, height = header.window
    return scaled(message, offset, width * height, header.sample_type, header.scale).reshape(height, width)


def rates(message: Message, offset: int, size: int, header: Header) -> Map:
    """The section `rates`, Hz: a whole map, or a value a vertex."""
    (scale,) = struct.unpack_from("<f", message, offset)
    count = (size - RATES_HEAD) // np.dtype(_SAMPLES[header.sample_type][1]).itemsize
    values = scaled(message, offset + RATES_HEAD, count, header.sample_type, scale)
    return values.reshape(SIDE_PX, SIDE_PX) if count == SIDE_PX * SIDE_PX else values


def scaled(message: Message, offset: int, count: int, sample_type: str, scale: float) -> Map:
    """`count` samples at `offset`, of which u16 and u8 carry units of `scale`."""
    _, dtype, unit_max = _SAMPLES[sample_type]
    values = _values(message, dtype, count, offset)
    if unit_max:
        values *= np.float32(scale)
    return values


def scaled_rows(rows: NDArray[np.uint8], sample_type: str, scale: NDArray[np.float32]) -> Map:
    """The same of many answers, a row each."""
    _, dtype, unit_max = _SAMPLES[sample_type]
    values = rows.view(dtype).astype(np.float32, copy=False)
    if unit_max:
        values *= scale[:, None]
    return values
