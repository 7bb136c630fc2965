"""Frames of versions 2 and 3 of the protocol (docs/reference/protocol.md)."""

from __future__ import annotations

import struct
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

SIDE_PX: Final = 224
"""Pixels along one side of every map."""

Map: TypeAlias = NDArray[np.float32]
Window: TypeAlias = tuple[int, int, int, int]
"""Column, row, width, height, pixels."""

WHOLE: Final[Window] = (0, 0, SIDE_PX, SIDE_PX)
HEADER: Final = struct.Struct("<4sBBBBIHHQIfHHIIHBB")
_SAMPLES: Final[dict[str, tuple[int, str, float]]] = {
    # name: number on the wire, numpy's name, greatest unit (0: not scaled)
    "f32": (0, "<f4", 0.0),
    "f16": (1, "<f2", 0.0),
    "u16": (2, "<u2", 65535.0),
    "u8": (3, "u1", 255.0),
}
_NAMES: Final = {number: name for name, (number, _, _) in _SAMPLES.items()}
SEALED: Final = b"PPS"
"""What a sealed state begins with, as opposed to a frame."""
STATUSES: Final = ("ok", "superseded", "late", "error", "stale")
KINDS: Final = {2: "sed", 3: "sa1_rate"}


class Header(NamedTuple):
    """The header of an answer."""

    kind: str
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


def encode(
    pressure_pa: NDArray[Any],
    window: Window,
    sample_type: str,
    sequence: int,
    client_time_us: int,
    deadline_us: int,
    version: int = 2,
) -> bytes:
    """The message of one pressure frame; `pressure_pa` has the window's shape."""
    number, dtype, unit_max = _SAMPLES[sample_type]
    scale = 1.0
    if unit_max and pressure_pa.size:
        # The finest scale that clips nothing; in f32, as the header carries it.
        scale = float(np.float32(float(np.max(pressure_pa)) / unit_max)) or 1.0
        with np.errstate(invalid="ignore"):
            units = np.clip(np.rint(pressure_pa / scale), 0.0, unit_max)
            samples = units.astype(dtype).tobytes()
    elif sample_type == "f16":
        samples = np.clip(pressure_pa, -65504.0, 65504.0).astype(dtype).tobytes()
    else:
        samples = pressure_pa.astype(dtype, copy=False).tobytes()
    column, row, width, height = window
    head = HEADER.pack(
        b"PPL1", version, 1, number, 0, sequence, width, height, client_time_us, deadline_us, scale,
        column, row, 0, 0, 0, 0, 0,
    )  # fmt: skip
    return head + samples


def encode_rows(
    kind: str,
    rows: NDArray[Any],
    net: NDArray[Any] | None,
    finger: int,
    sequence: int,
    client_time_us: int,
) -> bytes:
    """The message of poses (`rows` of seven) or of gaps (a row of them, or a map), as f32.

    `net` is the row of seven of a net force, or None.
    """
    height, width = rows.shape
    samples = rows.astype("<f4").tobytes()
    if net is not None:
        samples += net.astype("<f4").tobytes()
        height += kind == "objects"
    head = HEADER.pack(
        b"PPL1", 3, INPUTS[kind], 0, 0, sequence, width, height, client_time_us, 0, 1.0,
        0, 0, 0, 0, 0, 0, finger,
    )  # fmt: skip
    return head + samples


INPUTS: Final = {"objects": 4, "gaps": 5}
"""Kinds of frames of version 3."""
FLAGS = {1: "out_of_range", 2: "no_contact", 4: "unfamiliar", 8: "unsettled", 16: "cut_off"}
"""Bits of an answer's flags."""


def decode(message: bytes) -> Header:
    """Reads an answer's header.

    Raises ValueError if the message is none.
    """
    if len(message) < HEADER.size:
        raise ValueError(f"an answer of {len(message)} bytes; a header has {HEADER.size}")
    (magic, version, kind, number, status, sequence, width, height, client_time_us, total_us,
     scale, column, row, queue_us, infer_us, tier, flags, finger) = HEADER.unpack_from(message)  # fmt: skip
    if magic != b"PPL1" or version not in (2, 3) or kind not in KINDS or number not in _NAMES:
        raise ValueError("not an answer of version 2 or 3 of the protocol")
    if status >= len(STATUSES):
        raise ValueError(f"an answer with status {status}")
    names = {name for bit, name in FLAGS.items() if flags & bit}
    return Header(
        KINDS[kind], _NAMES[number], STATUSES[status], sequence, (column, row, width, height),
        client_time_us, total_us, scale, queue_us, infer_us, tier, frozenset(names),
        finger if version == 3 else 0,
    )  # fmt: skip


def floats(message: bytes, offset: int, size: int) -> Map:
    """`size` bytes of float32 at `offset`."""
    return np.frombuffer(message, "<f4", size // 4, offset).astype(np.float32)


def samples(message: bytes, offset: int, header: Header) -> Map:
    """The samples of the window, in J/m3 or Hz: (height, width)."""
    _, _, width, height = header.window
    return scaled(message, offset, width * height, header).reshape(height, width)


def scaled(message: bytes, offset: int, count: int, header: Header) -> Map:
    """`count` samples at `offset`, in J/m3 or Hz."""
    _, dtype, unit_max = _SAMPLES[header.sample_type]
    values = np.frombuffer(message, dtype, count, offset).astype(np.float32)
    if unit_max:
        values *= np.float32(header.scale)
    return values
