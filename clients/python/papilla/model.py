"""A network in this process: SED of one map or of many."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import check, wire
from .errors import BadInput, BadModels, NativeMissing
from .wire import FLAGS, SIDE_PX, Map

if TYPE_CHECKING:
    from . import _native

MODELS_VARIABLE: Final = "PAPILLA_MODELS"
"""Environment variable that names the folder of models."""


def native() -> Any:
    """The native module; raises NativeMissing."""
    try:
        return import_module("papilla._native")
    except ImportError as error:
        raise NativeMissing(str(error)) from error


def folder(models: str | os.PathLike[str] | None) -> Path:
    """The folder of models: the one that is named, $PAPILLA_MODELS, or that of the wheel."""
    named = models if models is not None else os.environ.get(MODELS_VARIABLE)
    if named is not None:
        return Path(named)
    beside = Path(__file__).with_name("models")
    if not beside.is_dir():
        raise BadModels(
            f"{beside} is not there: this installation carries no models. Name a folder with index.json: "
            f"models=..., or the environment variable {MODELS_VARIABLE}"
        )
    return beside


class Rendered(NamedTuple):
    """What became of maps of pressure."""

    sed: Map
    """Strain energy density, J/m3: as many maps as came."""
    flags: NDArray[np.uint8]
    """Bits for each map, by name in `papilla.wire.FLAGS`; a single number for a single map."""

    def flagged(self, name: str) -> NDArray[np.bool_]:
        """Which maps have a flag, such as `out_of_range` or `unfamiliar`."""
        bits = [bit for bit, known in FLAGS.items() if known == name]
        if not bits:
            raise BadInput("name", f"no flag {name!r}; there are {', '.join(FLAGS.values())}")
        flagged: NDArray[np.bool_] = (self.flags & bits[0]) != 0
        return flagged


class Model:
    """A network of a folder of models, read once and used in this process.

    `papilla.Model().sed(pressure_pa)`
    """

    def __init__(
        self, tier: str | None = None, *, models: str | os.PathLike[str] | None = None, contact: bool = False
    ) -> None:
        """Reads a network, and the contact model if `contact` says so.

        Without a name these are the networks that a service takes for a client who names none: one for
        pressure, which `sed` and `render` use, and one for poses and gaps, which sessions use.

        `models` is a folder with index.json; without it $PAPILLA_MODELS, or the models of the wheel.
        Raises BadModels and NativeMissing.
        """
        self.folder = folder(models)
        of_contact = self.folder / "finger.contact" if contact else None
        self._native: _native.Models = native().Models(self.folder, tier, of_contact)

    @property
    def tier(self) -> str:
        """Name of the network for maps of pressure."""
        return self._native.name

    @property
    def tiers(self) -> list[str]:
        """Names of the networks that were read: for poses and gaps, and for pressure."""
        return self._native.names

    @property
    def atlas_hash(self) -> str:
        """Hash of the atlas that its maps are drawn by."""
        return self._native.atlas_hash

    @property
    def pressure_max_pa(self) -> float:
        """Greatest pressure that the network was trained on, Pa."""
        return self._native.pressure_max_pa

    @property
    def card(self) -> dict[str, Any]:
        """What is known of the network: training, errors, speed."""
        known: dict[str, Any] = json.loads(self._native.card())
        return known

    @property
    def has_contact(self) -> bool:
        """Whether it can find pressure from poses and gaps."""
        return self._native.has_contact

    def sed(self, pressure_pa: ArrayLike, *, unit: str | None = None, threads: int | None = None) -> Map:
        """SED of a map (224, 224) or of a batch (n, 224, 224), J/m3; see `render`."""
        return self.render(pressure_pa, unit=unit, threads=threads).sed

    def render(self, pressure_pa: ArrayLike, *, unit: str | None = None, threads: int | None = None) -> Rendered:
        """SED of a map (224, 224) or of a batch (n, 224, 224), Pa, with flags.

        `unit` is Pa, kPa or MPa; without it maps that are weak for Pa are asked about, by BadInput.
        A batch is rendered on `threads` threads, by default one for each core; other threads of Python go
        on meanwhile, and Ctrl-C ends it. Raises BadInput with the place of a map that cannot be.
        """
        array, said = check.given(pressure_pa, "pressure_pa", "pressure", unit)
        is_batch = array.ndim == 3
        if array.shape[-2:] != check.SIDE or array.ndim not in (2, 3):
            if is_batch:
                raise BadInput("pressure_pa", f"it has shape {array.shape}; (n, {SIDE_PX}, {SIDE_PX}) is due")
            check.samples(array, (0, 0, SIDE_PX, SIDE_PX))
        if threads is None:
            threads = os.cpu_count() or 1
        elif threads < 1:
            raise BadInput("threads", f"{threads}; one or more")
        maps = np.ascontiguousarray(array, np.float32)
        if not said:
            check.ask_unit(check.size_of(maps, "pressure"), "pressure")
        sed = np.empty_like(maps)
        # Views of one map each, which the threads read and write by themselves.
        batch, room = (maps, sed) if is_batch else (maps[None], sed[None])
        flags = np.frombuffer(self._native.sed(list(batch), list(room), threads), np.uint8)
        return Rendered(sed, flags if is_batch else flags[0])

    def session(self, hello: dict[str, Any], fingers: Mapping[str, Model] | None = None) -> _native.Session:
        """A session of the native module; `papilla.local` makes a session for people of it.

        `fingers` are the models of the fingers that the hello may name.
        """
        return self._native.session(wire.hello(hello), [(name, of._native) for name, of in (fingers or {}).items()])


def shared(tier: str | None = None, *, contact: bool = False) -> Model:
    """The network for calls with `url="local"`, read by the first of them.

    It is read anew where the folder of models is another one, or its index has changed. Raises as `Model`.
    """
    models = folder(None).absolute()
    try:
        changed = (models / "index.json").stat().st_mtime_ns
    except OSError:
        changed = 0  # The native module says what is wrong.
    return _read(tier, models, changed, contact)


@lru_cache(maxsize=4)
def _read(tier: str | None, models: Path, changed: int, contact: bool) -> Model:
    return Model(tier, models=models, contact=contact)
