"""Hostile sessions: hellos and frames that are hard to answer, from hostile-sessions.json.

The service's own tests read the same file (server/tests/service/hard.rs). `repeat` stands for so many
copies of a value, `slivers` for a mesh of so many triangles whose boxes all overlap.
"""

import json
import math
import struct
from pathlib import Path

MAP_LEN = 224 * 224
OBJECTS, GAPS = 4, 5


def slivers(count: int) -> dict:
    """A closed mesh: two tips far apart on the diagonal, and a thin ring in the middle."""
    n, half = count // 2, 5.0
    u, v = (1 / math.sqrt(2), -1 / math.sqrt(2), 0.0), (1 / math.sqrt(6), 1 / math.sqrt(6), -2 / math.sqrt(6))
    ring = []
    for k in range(n):
        c, s = 0.5 * math.cos(2 * math.pi * k / n), 0.5 * math.sin(2 * math.pi * k / n)
        ring.append([round(c * a + s * b, 5) for a, b in zip(u, v)])
    tip = half / math.sqrt(3)
    vertices = [*ring, [tip] * 3, [-tip] * 3]
    triangles = []
    for k in range(n):
        # u, v and the diagonal are right-handed: seen from the upper tip the ring is counter-clockwise.
        triangles += [[k, (k + 1) % n, n], [(k + 1) % n, k, n + 1]]
    return {"shape": "mesh", "vertices_mm": vertices, "triangles": triangles}


def whole(value: object) -> object:
    """The value that the file stands for."""
    if isinstance(value, dict) and set(value) == {"repeat"}:
        count, one = value["repeat"]
        return [whole(one)] * count
    if isinstance(value, dict) and set(value) == {"slivers"}:
        return slivers(value["slivers"])
    if isinstance(value, dict):
        return {name: whole(member) for name, member in value.items()}
    return [whole(one) for one in value] if isinstance(value, list) else value


SESSIONS = whole(json.loads((Path(__file__).parent / "hostile-sessions.json").read_text()))


def hello_of(name: str) -> dict:
    return {"type": "hello", "tier": "nano"} | SESSIONS[name]["hello"]


def payload_of(name: str) -> tuple[int, int, int]:
    """Kind, width and height of its frames."""
    session = SESSIONS[name]
    return (OBJECTS, 7, len(session["rows"])) if "rows" in session else (GAPS, 224, 224)


def _frame(session: dict) -> bytes:
    if "rows" in session:
        return b"".join(struct.pack("<7f", *row) for row in session["rows"])
    return struct.pack("<f", session["gaps_mm"]) * MAP_LEN


# What each frame holds behind its header.
FRAME = {name: _frame(session) for name, session in SESSIONS.items()}
