"""What becomes of a frame."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import wire
from .errors import NotCarried, NotRendered
from .wire import Map, Window


class Summary(NamedTuple):
    """A map in sixteen numbers; formulas in docs/reference/protocol-effects.md."""

    force_n: float
    contact_area_mm2: float
    pressure_max_pa: float
    pressure_u_px: float
    pressure_v_px: float
    sed_max_j_per_m3: float
    sed_max_u_px: float
    sed_max_v_px: float
    sed_integral_uj_per_m: float
    sed_u_px: float
    sed_v_px: float
    sed_uu_px2: float
    sed_uv_px2: float
    sed_vv_px2: float
    sed_mean_j_per_m3: float
    sa1_rate_hz: float


class Touch(NamedTuple):
    """What pushes back on a finger, in its frame."""

    force_n: tuple[float, float, float]
    torque_n_mm: tuple[float, float, float]
    area_mm2: float
    centre_mm: tuple[float, float, float]
    penetration_mm: float
    stiffness_n_per_mm: float
    """0 if it was not asked for."""
    travel_mm: float
    """How far things travelled to meet a net force."""
    pressure_max_pa: float
    share: float
    """Of the second order of finite strain in the displacement."""
    solve_us: float


def read_touch(message: wire.Message, offset: int) -> Touch:
    """The touch at `offset`."""
    v = struct.unpack_from("<16f", message, offset)
    return Touch((v[0], v[1], v[2]), (v[3], v[4], v[5]), v[6], (v[7], v[8], v[9]), *v[10:])


class ErrorEstimate(NamedTuple):
    """How wrong an answer is likely to be, relative to finite elements; what is not stated is infinite."""

    sed_median: float = math.inf
    """Half of such maps of SED err less (relative L2)."""
    sed_p90: float = math.inf
    """Nine of ten such maps err less."""
    force_median: float = math.inf
    """The same of the size of the force that contact found."""
    force_p90: float = math.inf


NOT_STATED = ErrorEstimate()


class Spikes(NamedTuple):
    """Who fired since the answer before, in the order of time."""

    unit: NDArray[np.uint16]
    """Number of the unit in `ready["units"]`."""
    time_us: NDArray[np.int64]
    """When, by the client's clock."""
    total: int
    """Spikes of the finger since the hello, those too that no answer carried; modulo 2^32."""


_SPIKES_HEAD = struct.Struct("<II")
_SPIKE = np.dtype([("unit", "<u2"), ("before_us", "<u2")])


def read_spikes(message: wire.Message, offset: int, client_time_us: int) -> Spikes:
    """The spikes at `offset`."""
    total, count = _SPIKES_HEAD.unpack_from(message, offset)
    found = np.frombuffer(message, _SPIKE, count, offset + _SPIKES_HEAD.size)
    return Spikes(found["unit"].copy(), client_time_us - found["before_us"].astype(np.int64), total)


class Problem(NamedTuple):
    """Why the service refused a frame."""

    code: str
    message: str
    field: str | None


@dataclass(slots=True)
class Answer:
    """The outcome of one frame."""

    sequence: int
    status: str
    """`ok`, `superseded`, `late`, `stale`, `error` or `lost` (the connection broke, or no answer came in time)."""
    client_time_us: int
    by_client: bool = False
    """Superseded here: the frame never left the client."""
    problem: Problem | None = None
    """With status `error`."""
    out_of_range: bool = False
    """A pressure is above what the tier was trained on; the map is an extrapolation."""
    no_contact: bool = False
    """The map is zero; no network was asked."""
    cut_off: bool = False
    """The contact reaches the edge of the atlas; what lies beyond is missing."""
    unfamiliar: bool = False
    """The map is rougher or heavier than any the tier was trained on: it may mean nothing."""
    unsettled: bool = False
    """The contact solve did not settle: the answer is rough."""
    not_tracked: bool = False
    """To a frame that said that nobody knows where things are: all is zero."""
    coarse_clock: bool = False
    """The client's clock ticks so coarsely, stands, or counts ms or ns, so that rates and spikes may be far off."""
    finger: int = 0
    tier: str = ""
    window: Window = wire.WHOLE
    """Column, row, width and height of `values`."""
    total_us: int = 0
    """Time in the server, of which `queue_us` waiting for a thread and `infer_us` in the network."""
    queue_us: int = 0
    infer_us: int = 0
    error_estimate: ErrorEstimate = NOT_STATED
    """How wrong this answer is likely to be, by what it shows."""
    values: Map | None = None
    """SED of the window, J/m3: (height, width)."""
    touch: Touch | None = None
    """Of objects and gaps."""
    pressure_pa: Map | None = None
    """The pressure that was found, if asked for: a map, or a value a vertex."""
    shear_pa: Map | None = None
    """The traction along the skin, if asked for: x y z a vertex, in the finger's frame."""
    displacement_mm: Map | None = None
    """How far the skin has moved, if asked for: x y z a vertex, in the finger's frame."""
    vertices: Map | None = None
    """SED at the vertices, J/m3, if asked for in place of the map."""
    rates: Map | None = None
    """With the effect `afferents`: firing rates, Hz, a whole map or at the vertices; `rates_hz` raises without."""
    summary: Summary | None = None
    points: Map | None = None
    """SED at the points of the hello, J/m3."""
    point_rates_hz: Map | None = None
    """Firing rates there, Hz: with the effects `points` and `afferents`."""
    actuators: Map | None = None
    spikes: Spikes | None = None
    """The effect `spikes`."""

    @property
    def map(self) -> Map:
        """The whole map, 224 x 224, 0 outside of the window.

        Raises NotRendered if the answer carries none.
        """
        if self.values is None:
            reason = self.problem.message if self.problem else "it carries no map"
            raise NotRendered(self.status, reason)
        if self.window == wire.WHOLE:
            return self.values
        whole = np.zeros((wire.SIDE_PX, wire.SIDE_PX), np.float32)
        column, row, width, height = self.window
        whole[row : row + height, column : column + width] = self.values
        return whole

    @property
    def sed(self) -> Map:
        """Strain energy density, J/m3: `map`, or the values at the vertices.

        Raises NotRendered if the answer carries none.
        """
        return self.map if self.vertices is None else self.vertices

    @property
    def rates_hz(self) -> Map:
        """Firing rates of SA1 afferents, Hz: a whole map, or the values at the vertices.

        Raises NotCarried if the session has none, NotRendered if the frame was not rendered.
        """
        if self.rates is None:
            if self.status != "ok":
                raise NotRendered(self.status, self.problem.message if self.problem else "it carries no rates")
            raise NotCarried("rates_hz", "name the effect 'afferents' in the hello, and leave 'map' true")
        return self.rates


def read(message: wire.Message, header: wire.Header, ready: dict[str, Any], tier: str) -> Answer:
    """The answer that a message is, in a session on the terms of `ready`."""
    answer = Answer(
        header.sequence,
        header.status,
        header.client_time_us,
        finger=header.finger,
        tier=tier,
        window=header.window,
        total_us=header.total_us,
        queue_us=header.queue_us,
        infer_us=header.infer_us,
    )
    # Each is a member of the same name.
    for flag in header.flags:
        setattr(answer, flag, True)
    if header.status != "ok":
        return answer
    for section in ready["sections"]:
        name, offset, size = section["name"], section["offset"], section["bytes"]
        if name == "touch":
            answer.touch = read_touch(message, offset)
        elif name == "pressure":
            found = wire.floats(message, offset, size)
            is_map = size == 4 * wire.SIDE_PX**2
            answer.pressure_pa = found.reshape(wire.SIDE_PX, wire.SIDE_PX) if is_map else found
        elif name == "shear":
            answer.shear_pa = wire.floats(message, offset, size).reshape(-1, 3)
        elif name == "displacement":
            answer.displacement_mm = wire.floats(message, offset, size).reshape(-1, 3)
        elif name == "error_estimate":
            answer.error_estimate = ErrorEstimate(*struct.unpack_from("<4f", message, offset))
        elif name == "vertices":
            answer.vertices = wire.scaled(message, offset, ready["vertices"], header.sample_type, header.scale)
        elif name == "summary":
            answer.summary = Summary(*struct.unpack_from("<16f", message, offset))
        elif name == "rates":
            answer.rates = wire.rates(message, offset, size, header)
        elif name == "point_rates":
            answer.point_rates_hz = wire.floats(message, offset, size)
        elif name == "points":
            answer.points = wire.floats(message, offset, size)
        elif name == "actuators":
            answer.actuators = wire.floats(message, offset, size)
        elif name == "spikes":
            answer.spikes = read_spikes(message, offset, header.client_time_us)
        elif name == "map":
            answer.values = wire.samples(message, offset, header)
    return answer
