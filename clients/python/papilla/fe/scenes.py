"""Scenes as `fe-datagen` takes them, explained and solved state by state."""

from __future__ import annotations

import json
import logging
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import check
from ..errors import BadInput, BadScene, PapillaError
from ..model import native
from ..wire import SIDE_PX, WHOLE, Map
from .files import Files
from .source import Explanation, Source, read

if TYPE_CHECKING:
    from .. import _native

Field = NDArray[np.float64]
Progress = bool | Callable[[int, int, str], None] | None
"""True draws a line on stderr; a function gets the states found, all states, and a word for people."""

_LOG: Final = logging.getLogger("papilla")

COMPONENTS: Final = ("xx", "yy", "zz", "xy", "yz", "xz")
"""Order of the components of stress and strain."""


class State:
    """One equilibrium of a scene."""

    def __init__(self, number: int, found: _native.State) -> None:
        self.number = number
        """From 0. One that comes again takes the place of the state before: see `Scene.solve`."""
        self._found = found
        self.summary: dict[str, Any] = json.loads(found.summary())
        """What `summary.json` of `fe-datagen solve` says of the state: checks, effort and more."""
        self.maps: dict[str, Map] = {}
        """Maps by name, as in `maps.npz`: `pressure_pa`, `sed_dermis_j_per_m3`, `sed_epidermis_j_per_m3`, and with
        friction `shear_pa`; empty of a body without an atlas."""
        for name, pixels in found.maps().items():
            maps = np.frombuffer(pixels, "<f4").reshape(-1, SIDE_PX, SIDE_PX)
            self.maps[name] = maps[0] if len(maps) == 1 else maps

    @property
    def depth_mm(self) -> float:
        """Depth from first touch, mm."""
        return float(self.summary["depth_mm"])

    @property
    def force_n(self) -> Field:
        """Force on the body, x y z, N."""
        return np.array(self.summary["force_n"])

    @property
    def pressure_pa(self) -> Map:
        """Pressure on the skin as a map, Pa. Raises BadInput for a body without an atlas."""
        return self._map("pressure_pa")

    @property
    def sed_j_per_m3(self) -> Map:
        """SED on the dermis side of the interface as a map, J/m3. Raises BadInput for a body without an atlas."""
        return self._map("sed_dermis_j_per_m3")

    def _map(self, name: str) -> Map:
        if name not in self.maps:
            raise BadInput(
                name, "the scene's body has no atlas, so that there are no maps: geometry.kind 'fingertip' has"
            )
        return self.maps[name]

    @property
    def iterations(self) -> int:
        """Newton iterations that the state took."""
        return int(self.summary["checks"]["newton_iterations"])

    @property
    def seconds(self) -> float:
        """Wall time that the state took."""
        return float(self.summary["seconds"])

    @property
    def flags(self) -> tuple[str, ...]:
        """What to know before the state is used: `fault` (a check failed; `summary["fault"]` says which),
        `outside_calibration` (a part of the tissue is beyond the stretches that its law was fitted to),
        `contact_within_faces` (the indenter is too narrow for contact at nodes)."""
        flags = []
        if self.summary.get("fault") is not None:
            flags.append("fault")
        if self.summary["outside_calibration"] > 0.0:
            flags.append("outside_calibration")
        if self.summary["contact"] != "nodes":
            flags.append("contact_within_faces")
        return tuple(flags)

    @property
    def nodes(self) -> dict[str, Field]:
        """Fields at the nodes by name: `places_mm` (of the undeformed body), `displacement_mm`, `pressure_pa`, of
        biphasic tissue `fluid_pressure_pa`, `stress_pa` and `strain` (components in the order of `COMPONENTS`)."""
        return {name: _array(name, values) for name, values in self._found.nodes().items()}

    @property
    def cells(self) -> dict[str, NDArray[Any]]:
        """Fields of the elements by name: `sed_j_per_m3`, `volume_ratio`, `layer` (0 epidermis, 1 dermis,
        2 subcutaneous, 3 nail, 4 bone), `stress_pa`, `strain`; and their nodes: `connectivity`, where those of
        each end (`offsets`), and VTK's `types`."""
        types: dict[str, str] = {"connectivity": "<i8", "offsets": "<i8", "types": "u1", "layer": "<i4"}
        return {name: _array(name, values, types.get(name, "<f8")) for name, values in self._found.cells().items()}

    def write_vtu(self, path: str | os.PathLike[str]) -> None:
        """Writes the whole body as a `.vtu` for ParaView, as `fe-datagen solve` does."""
        self._found.write_vtu(Path(path))

    def __repr__(self) -> str:
        force = float(np.linalg.norm(self.force_n))
        flags = f", {', '.join(self.flags)}" if self.flags else ""
        return f"<State {self.number}: {self.depth_mm:.3f} mm, {force:.4f} N, {self.seconds:.1f} s{flags}>"


def _array(name: str, values: bytes, dtype: str = "<f8") -> NDArray[Any]:
    found = np.frombuffer(values, dtype)
    if name in ("places_mm", "displacement_mm"):
        return found.reshape(-1, 3)
    return found.reshape(-1, len(COMPONENTS)) if name in ("stress_pa", "strain") else found


class Solve(Iterator[State]):
    """States of a scene as they are found. `with` ends the solve when the block is left."""

    def __init__(self, run: _native.Run, progress: Progress) -> None:
        self._run = run
        self._progress = progress
        self.states = 0
        """How many states are going to be stored; known once the first is found."""
        self.mended: list[str] = []
        """What was done to meshes: holes closed, triangles left out; known once the first state is found."""
        self.doubts: list[str] = []
        """What may be a mistake in the scene, likewise."""

    def __next__(self) -> State:
        while True:
            try:
                found = self._run.next()
            except BaseException:
                self._tell("stopped")
                self.close()
                raise
            if found is None:
                self.close()
                raise StopIteration
            number, state = found
            if state is None:
                self.states = number
                self.mended, self.doubts = self._run.remarks()
                for said in (*self.mended, *self.doubts):
                    _LOG.warning("%s", said)
                self._tell("set up", 0)
                continue
            made = State(number, state)
            self._tell(f"{made.depth_mm:.3f} mm deep", number + 1)
            return made

    def close(self) -> None:
        """Ends the solve within an iteration; states that were given stay good."""
        self._run.close()

    def __enter__(self) -> Solve:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _tell(self, words: str, done: int | None = None) -> None:
        if self._progress is True:
            if done is None:
                sys.stderr.write("\n")
                return
            end = "\n" if done == self.states else ""
            sys.stderr.write(f"\r{done} of {self.states} states, {words}\x1b[K{end}")
            sys.stderr.flush()
        elif callable(self._progress) and done is not None:
            self._progress(done, self.states, words)


class Effect(NamedTuple):
    """What one effect of a scene costs and changes."""

    name: str
    seconds_with: float
    """Expected with all effects of the scene, on one core."""
    seconds_without: float
    """Expected without this one."""
    sed_change: float | None
    """Relative L2 change of the SED map of the last state where the effect is left out, against the scene as it is;
    None if it was not solved, or has no atlas."""
    force_change: float | None
    """The same of the force."""
    why_not: str | None
    """Why the scene cannot be without it."""


class Scene:
    """A scene: what is pressed by what, how, and with which effects.

    `source` is the path of a TOML file, TOML text, or a dict with the members of such a file
    (docs/reference/scenes.md). Raises BadScene, whose `field` and `line` say where.
    """

    def __init__(self, source: Source, *, pressure: ArrayLike | None = None) -> None:
        """`pressure` is a map (224, 224) on the finger's atlas, Pa, which presses in place of an indenter; it stands
        for `pressure.file` of the scene."""
        scene = native().Scene
        map_pa = None
        if pressure is not None:
            map_pa = np.ascontiguousarray(check.samples(pressure, WHOLE))
        self._pressure = map_pa
        self._native: _native.Scene = scene(*read(source), map_pa)

    def as_dict(self) -> dict[str, Any]:
        """All members of the scene, those too that were not given."""
        members: dict[str, Any] = json.loads(self._native.json())
        return members

    def explain(self) -> Explanation:
        """What the scene is going to simulate, what it leaves out and why, and what it will cost; nothing is solved.

        Raises BadScene.
        """
        members, text = self._native.explain()
        return Explanation(json.loads(members), text)

    def solve(self, *, fields: bool = True, progress: Progress = None) -> Solve:
        """Solves the scene on a thread of its own, and gives each state as it is found.

        `fields=False` leaves the fields of the whole body out of the states. Where energy and work part, the solver
        takes the press again in smaller steps, and the numbers begin anew: the state of a number that came last
        counts (`run` keeps those). Ctrl-C ends the solve within an iteration. Raises BadScene, and NotSolved if
        there is no equilibrium.
        """
        return Solve(self._native.solve(fields), progress)

    def run(
        self, *, fields: bool = True, out: str | os.PathLike[str] | None = None, progress: Progress = None
    ) -> list[State]:
        """All states of `solve` that count, in their order.

        With `out`, a folder, what the scene's `outputs` name is written there as `fe-datagen solve` does:
        `state-000.vtu` and so on with `series.pvd` (not with `fields=False`), `maps.npz`, and `summary.json` with
        scene, states, and what was mended or is in doubt; no pictures. Where the solve ends early, by an error too,
        the states before are written.
        """
        states: dict[int, State] = {}
        files = None
        if out is not None:
            members = self.as_dict()
            named = members.get("outputs")
            outputs = ["fields", "maps"] if named is None else named
            files = Files(out, members, [name for name in outputs if fields or name != "fields"])
        reason: str | None = "stopped"
        mended: list[str] = []
        doubts: list[str] = []
        try:
            with self.solve(fields=fields, progress=progress) as solve:
                for state in solve:
                    mended, doubts = solve.mended, solve.doubts
                    if state.number == 0:
                        states.clear()
                    states[state.number] = state
                    if files is not None:
                        files.take(state)
            reason = None
        except PapillaError as error:
            reason = str(error)
            raise
        finally:
            found = [states[number] for number in sorted(states)]
            if files is not None:
                files.finish(found, reason, mended, doubts)
        return found

    def effects(self, *, solve: bool = False, progress: Progress = None) -> list[Effect]:
        """What each effect that the scene names costs, and, with `solve`, what it changes.

        Each effect is left out by itself, so that `solve` solves the scene once more for each of them.
        """
        members = self.as_dict()
        whole = self.explain()["forecast"]["seconds"]["total"]
        last = self.run(fields=False, progress=progress)[-1] if solve else None
        found = []
        for name in members["effects"]:
            try:
                others = [other for other in members["effects"] if other != name]
                less = Scene({**members, "effects": others}, pressure=self._pressure)
                seconds = less.explain()["forecast"]["seconds"]["total"]
            except BadScene as error:
                found.append(Effect(name, whole, float("nan"), None, None, str(error)))
                continue
            sed = force = None
            if last is not None:
                without = less.run(fields=False, progress=progress)[-1]
                force = _change(without.force_n, last.force_n)
                if "sed_dermis_j_per_m3" in last.maps:
                    sed = _change(without.sed_j_per_m3, last.sed_j_per_m3)
            found.append(Effect(name, whole, seconds, sed, force, None))
        return found


def _change(other: NDArray[Any], reference: NDArray[Any]) -> float:
    return float(np.linalg.norm(other - reference) / np.linalg.norm(reference))
