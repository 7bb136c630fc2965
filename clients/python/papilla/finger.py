"""Contact in this process: where things are in, what pushes back out; no network, no session."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import check, wire
from .errors import BadInput
from .link import Warned
from .model import folder, native
from .wire import FLAGS, SIDE_PX, Map, NetForce

if TYPE_CHECKING:
    from . import _native
    from .atlas import Atlas

Objects = Mapping[str, Any] | Sequence[Mapping[str, Any]]
"""An object as a hello announces it, such as {"shape": {"shape": "sphere", "radius_mm": 10}}, or several."""

_TOUCH: Final = {
    # name: numbers, in the order of the section `touch`
    "force_n": 3, "torque_n_mm": 3, "area_mm2": 1, "centre_mm": 3, "penetration_mm": 1, "stiffness_n_per_mm": 1,
    "travel_mm": 1, "pressure_max_pa": 1, "share": 1, "solve_us": 1,
}  # fmt: skip


@dataclass(slots=True)
class FingerContact:
    """What pushes back on a finger, in its frame; of a batch each array has the frame as its first axis."""

    force_n: Map
    """x y z, N."""
    torque_n_mm: Map
    """About the origin of the finger's frame."""
    area_mm2: Map
    centre_mm: Map
    """Where the force acts: the centre of pressure, on the deformed skin."""
    penetration_mm: Map
    """How deep a point of the skin is left inside an object."""
    stiffness_n_per_mm: Map
    """0 if it was not asked for."""
    travel_mm: Map
    """How far things travelled to meet a net force."""
    pressure_max_pa: Map
    share: Map
    """Of the second order of finite strain in the displacement."""
    solve_us: Map
    rounds: NDArray[np.uint32]
    """Linearisations of the contact that the solve took."""
    flag_bits: NDArray[np.uint8]
    pressure_pa: Map | None = None
    """A map (224, 224) or a value a vertex, as the finger was asked for."""
    shear_pa: Map | None = None
    """Traction along the skin, x y z a vertex, if the finger was asked for it."""
    displacement_mm: Map | None = None
    """How far the skin has moved, x y z a vertex, if the finger was asked for it."""

    @property
    def flags(self) -> tuple[str, ...] | list[tuple[str, ...]]:
        """The flags as words, such as `unsettled`; of a batch a tuple for each frame."""
        if self.flag_bits.ndim:
            return [_words(int(bits)) for bits in self.flag_bits]
        return _words(int(self.flag_bits))

    def flagged(self, name: str) -> NDArray[np.bool_]:
        """Whether a frame has a flag, such as `out_of_range`; of a batch for each frame."""
        bits = [bit for bit, known in FLAGS.items() if known == name]
        if not bits:
            raise BadInput("name", f"no flag {name!r}; there are {', '.join(FLAGS.values())}")
        flagged: NDArray[np.bool_] = (self.flag_bits & bits[0]) != 0
        return flagged


def _words(bits: int) -> tuple[str, ...]:
    return tuple(name for bit, name in FLAGS.items() if bits & bit)


_ANY: Final = {"input": "objects", "objects": [{"shape": {"shape": "sphere"}}]}


class Finger:
    """One finger that is touched in this process, with its warm start.

    `papilla.Finger().touch({"shape": {"shape": "sphere", "radius_mm": 10}}, [11.25, 0, -16.2, 0, 0, 0, 1]).force_n`
    """

    def __init__(self, bundle: str | os.PathLike[str] | Finger | None = None, **terms: Any) -> None:
        """Reads a finger's folder, by default that of the wheel's finger; of another Finger nothing is read again.

        `terms` are members of a session's hello: `method` (such as "pixels" or "second_order"; the most accurate
        that can serve without), `pressure` ("map", the default, "vertices", or None), `shear`, `displacement`,
        `stiffness`; and `finger`, a member of the hello's `fingers` ({"width": 1.1}). Raises BadInput, Refused,
        BadModels and NativeMissing.
        """
        known = ("method", "pressure", "shear", "displacement", "stiffness", "finger")
        for name in terms:
            if name not in known:
                raise BadInput(name, f"no such term of a finger; there are {', '.join(known)}")
        self.folder: Path
        self._native: _native.Finger
        if isinstance(bundle, Finger):
            self.folder, self._native = bundle.folder, bundle._native
        else:
            self.folder = folder(bundle)
            self._native = native().Finger(self.folder)
        finger = terms.pop("finger", None)
        self._terms = {"pressure": "map"} | terms
        if finger is not None:
            self._terms["fingers"] = [finger]
        self._terms = {name: value for name, value in self._terms.items() if value is not None}
        self._solved: _native.Contact | None = None
        self._hello = ""
        self._told: dict[str, Any] = {}
        self._warned = Warned()
        if terms or finger is not None:
            # What cannot be is said now, not at the first touch.
            self._native.contact(wire.hello({"map": False, **self._terms, **_ANY, "force_target": True}))

    @property
    def atlas_hash(self) -> str:
        """Hash of the atlas that maps are drawn by."""
        return self._native.atlas_hash

    @property
    def vertices(self) -> int:
        """Vertices of the skin."""
        return self._native.vertices

    def atlas(self) -> Atlas:
        """Which point of the finger each pixel and each vertex is."""
        from .atlas import Atlas

        return Atlas(json.loads((self.folder / "atlas.json").read_text()))

    @property
    def method(self) -> str | None:
        """How pressure was found in the last call; None before the first."""
        return self._told.get("method")

    @property
    def expected_error(self) -> dict[str, Any] | None:
        """What this method errs against finite elements, as in a session's ready; None where nobody measured it."""
        return self._told.get("expected_error")

    @property
    def warnings(self) -> list[str]:
        """What was logged for people to read, each once."""
        return self._warned.words

    def reset(self) -> None:
        """Forgets the frames before: the next solve starts cold."""
        self._solved, self._hello = None, ""

    def halt(self) -> None:
        """Ends a batch that another thread solves, after the frame at hand; that thread gets FrameFailed."""
        solved = self._solved
        if solved is not None:
            solved.halt()

    def touch(
        self,
        objects: Objects,
        poses: ArrayLike | None,
        *,
        net: NetForce | None = None,
        times_s: ArrayLike | None = None,
    ) -> FingerContact:
        """What objects at these poses press: a pose (7,) of a single object, (objects, 7), or a batch
        (frames, objects, 7), of a single object also (frames, 7), mm and a unit quaternion x y z w.

        A solve starts from the one before, as long as the objects are the same; others start cold. `net` is a
        force that the objects are to press with: a unit vector and N, as ([0, 0, 1], 1.0). Poses None: tracking is
        lost. Other threads of Python go on meanwhile, and Ctrl-C ends a batch. Raises BadInput, Refused, and
        FrameFailed for a frame of a batch.
        """
        announced = wire.objects(objects)
        contact = self._on({"input": "objects", "objects": announced, "force_target": True})
        if poses is None:
            return self._read(*contact.lost(), many=False)
        rows, said = check.given(poses, "poses", "objects")
        due = (len(announced), 7)
        if len(announced) == 1 and rows.shape[-1:] == (7,) and rows.ndim in (1, 2) and rows.shape != due:
            # One object: its pose, or a batch of them.
            rows = rows[..., None, :]
        many = rows.ndim == 3
        if rows.shape[-2:] != due or rows.ndim not in (2, 3):
            raise BadInput("poses", f"shape {rows.shape}; {due}, or a batch {('frames', *due)} is due")
        if not said:
            self._warned.ask_unit(rows, "objects")
        frames = rows if many else rows[None]
        force = np.broadcast_to(_net(net), (len(frames), 1, 7))
        return self._solve(contact, np.concatenate([frames, force], axis=1), times_s, many)

    def gaps(
        self,
        depth_mm: ArrayLike,
        *,
        friction: float | None = None,
        velocity_mm_per_s: ArrayLike | None = None,
        net: NetForce | None = None,
        times_s: ArrayLike | None = None,
    ) -> FingerContact:
        """What presses where points of the skin lie this deep in something, negative outside: a map (224, 224),
        a value a vertex (vertices,), or a batch of either.

        `velocity_mm_per_s` (vertices, 3) goes with depths at vertices, and needs `friction` and `times_s`: skin rubs
        by how far it slides from one frame to the next. The rest as `touch`.
        """
        depths, said = check.given(depth_mm, "depth_mm", "gaps")
        is_map = depths.shape[-2:] == check.SIDE
        due = check.SIDE if is_map else (self.vertices,)
        many = depths.ndim == len(due) + 1
        if depths.shape[depths.ndim - len(due) :] != due or depths.ndim - len(due) not in (0, 1):
            both = f"({SIDE_PX}, {SIDE_PX}) or ({self.vertices},)"
            raise BadInput("depth_mm", f"shape {depths.shape}; {both} is due, or a batch of it")
        terms: dict[str, Any] = {
            "input": "gaps",
            "input_layout": "map" if is_map else "vertices",
            "force_target": True,
        }
        if not said:
            self._warned.ask_unit(depths, "gaps")
        frames = depths.reshape(len(depths) if many else 1, -1)
        parts = [frames]
        if velocity_mm_per_s is not None and times_s is None:
            raise BadInput("times_s", "friction goes by how far the skin slides between frames: give their times, in s")
        if friction is not None:
            if velocity_mm_per_s is None:
                raise BadInput("friction", "it goes by the sliding of the skin: give velocity_mm_per_s and times_s too")
            terms["friction"] = friction
        if velocity_mm_per_s is not None:
            velocities = check.numbers(velocity_mm_per_s, "velocity_mm_per_s")
            if velocities.shape != (*frames.shape[:many], self.vertices, 3):
                raise BadInput(
                    "velocity_mm_per_s", f"shape {velocities.shape}; x y z for each depth at a vertex is due"
                )
            terms["velocity"] = True
            parts.append(velocities.reshape(len(frames), -1))
        parts.append(np.broadcast_to(_net(net), (len(frames), 7)))
        return self._solve(self._on(terms), np.concatenate(parts, axis=1), times_s, many)

    def _on(self, terms: dict[str, Any]) -> _native.Contact:
        """Contact on these terms: that of the call before, if they are the same."""
        # No network runs here, so no SED is asked for.
        hello = wire.hello({"map": False, **self._terms, **terms})
        if self._solved is None or hello != self._hello:
            contact = self._native.contact(hello)
            self._told = json.loads(contact.told())
            self._solved, self._hello = contact, hello
            for warning in self._told["warnings"]:
                words = f"{warning['member']}: {warning['question']}"
                self._warned.once(words, words)
        return self._solved

    def _solve(
        self, contact: _native.Contact, frames: NDArray[Any], times_s: ArrayLike | None, many: bool
    ) -> FingerContact:
        count = len(frames)
        if times_s is None:
            times_us = [0] * count
        else:
            times = check.times(times_s, count)
            if times[0] < 0.0 if count else False:
                raise BadInput("times_s", f"{times[0]} s; times count from 0")
            doubt = check.times_doubt(times)
            if doubt is not None:
                self._warned.once("times", doubt)
            times_us = [round(1e6 * float(time)) for time in times]
        samples = np.ascontiguousarray(frames, "<f4")
        # An empty batch has no bytes to lend.
        lent = samples.data.cast("B") if samples.size else memoryview(b"")
        return self._read(*contact.frames(lent, times_us), many=many)

    def _read(self, found: bytearray, flags: bytes, rounds: list[int], many: bool) -> FingerContact:
        """Makes arrays of the sections, which stay where Rust wrote them."""
        frames = np.frombuffer(found, np.uint8).reshape(len(rounds), self._told["sections_len"])
        values: dict[str, Any] = {
            "rounds": np.array(rounds, np.uint32),
            "flag_bits": np.frombuffer(bytes(flags), np.uint8),
        }
        for section in self._told["sections"]:
            name, offset, size = section["name"], section["offset"], section["bytes"]
            numbers = frames[:, offset : offset + size].view("<f4")
            if name == "touch":
                at = 0
                for member, count in _TOUCH.items():
                    values[member] = numbers[:, at] if count == 1 else numbers[:, at : at + count]
                    at += count
            elif name == "pressure":
                is_map = size == 4 * SIDE_PX**2
                values["pressure_pa"] = numbers.reshape(-1, SIDE_PX, SIDE_PX) if is_map else numbers
            elif name == "shear":
                values["shear_pa"] = numbers.reshape(len(frames), -1, 3)
            elif name == "displacement":
                values["displacement_mm"] = numbers.reshape(len(frames), -1, 3)
        if not many:
            values = {name: array[0] for name, array in values.items()}
        return FingerContact(**values)


def _net(net: NetForce | None) -> NDArray[np.float64]:
    """The row of a net force: of no force, none."""
    return np.zeros(7) if net is None else np.array(wire.net_row(net))


class Hand:
    """Fingers that are touched at the same time, each on a thread of its own."""

    def __init__(self, fingers: Iterable[Finger]) -> None:
        self.fingers = list(fingers)
        if not self.fingers:
            raise BadInput("fingers", "none; give one Finger at least")
        if len({id(finger) for finger in self.fingers}) < len(self.fingers):
            raise BadInput("fingers", "one Finger stands twice: each remembers its own frames, so make one for each")

    def reset(self) -> None:
        """Forgets the frames before, of all fingers."""
        for finger in self.fingers:
            finger.reset()

    def touch(
        self,
        objects: Objects,
        poses: Sequence[ArrayLike | None] | NDArray[Any],
        *,
        net: NetForce | None = None,
        times_s: ArrayLike | None = None,
    ) -> list[FingerContact]:
        """`Finger.touch` of each finger with its own poses, which are in the frame of that finger."""
        if len(poses) != len(self.fingers):
            raise BadInput("poses", f"{len(poses)} for {len(self.fingers)} fingers; one entry for each is due")
        with ThreadPoolExecutor(len(self.fingers)) as threads:
            each = zip(self.fingers, poses, strict=True)
            solved = [threads.submit(finger.touch, objects, of, net=net, times_s=times_s) for finger, of in each]
            try:
                return [one.result() for one in solved]
            except BaseException:
                # Ctrl-C comes to this thread alone.
                for finger in self.fingers:
                    finger.halt()
                raise
