"""Client of Papilla, a service that renders what a fingertip feels.

Pressure on the skin (Pa) in, strain energy density (SED) at the dermis-epidermis interface (J/m3)
out, both as arrays of 224 x 224 float32, row 0 at the fingertip's far end.

- `sed(pressure_pa)`: one map over HTTP
- `Session`, `AsyncSession`: many maps, or where things are, over a WebSocket; the latest frame wins
- `render`: a series of frames in one call, as arrays with units and files (`Series`)
- `local`: a session as `Session`, computed in this process
- `Model`: SED of a map or many, computed in this process
- `Finger`, `Hand`: what pushes back on one finger or several, computed in this process
- `fe`: finite elements in this process: scenes solved, states with maps and fields, campaigns, datasets
- `afferents`, `actuators`: firing rates, spikes and intensities of SED that is known
- `SpikeTrains`: when the touch units of a finger fire, as files
- `sensors`: readings of an array of taxels to pressure, SED, rates and spikes
- `devices`, `hjif`: what controllers and gloves take, and recorded touches as HJIF files
- `meshes`: STL, OBJ, PLY and GLB as objects of a session
- `frames`: poses of engines and robots to the finger's frame, forces back
- `Atlas`: which point of the finger each pixel is; pressure maps from vertices or contact points
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import actuators, afferents, devices, fe, frames, hjif, meshes, sensors
    from .aio import AsyncSession
    from .answer import Answer, ErrorEstimate, Problem, Spikes, Summary, Touch
    from .atlas import Atlas, Contact
    from .errors import (
        BadAddress,
        BadDataset,
        BadFrame,
        BadInput,
        BadModels,
        BadScene,
        Closed,
        FrameFailed,
        MissingExtra,
        NativeFault,
        NativeMissing,
        NotCarried,
        NotRendered,
        NotSolved,
        PapillaError,
        Refused,
        Unreachable,
    )
    from .finger import Finger, FingerContact, Hand
    from .http import DEFAULT_URL, Indentation, indentation, post, sed
    from .inprocess import LocalSession, local
    from .model import Model
    from .rendering import render, render_chunks
    from .series import Series
    from .spikes import SpikeTrains
    from .sync import Session
    from .wire import SIDE_PX

__all__ = [
    "DEFAULT_URL",
    "SIDE_PX",
    "Answer",
    "AsyncSession",
    "Atlas",
    "BadAddress",
    "BadDataset",
    "BadFrame",
    "BadInput",
    "BadModels",
    "BadScene",
    "Closed",
    "Contact",
    "ErrorEstimate",
    "Finger",
    "FingerContact",
    "FrameFailed",
    "Hand",
    "Indentation",
    "LocalSession",
    "MissingExtra",
    "Model",
    "NativeFault",
    "NativeMissing",
    "NotCarried",
    "NotRendered",
    "NotSolved",
    "PapillaError",
    "Problem",
    "Refused",
    "Series",
    "Session",
    "SpikeTrains",
    "Spikes",
    "Summary",
    "Touch",
    "Unreachable",
    "actuators",
    "afferents",
    "devices",
    "fe",
    "frames",
    "hjif",
    "indentation",
    "local",
    "meshes",
    "post",
    "render",
    "render_chunks",
    "sed",
    "sensors",
]


# Each module is loaded when one of its names is first used: a program that sends one map over HTTP
# does not wait for WebSockets, and one that opens a session not for files.
_NAMES = {
    "aio": ("AsyncSession",),
    "answer": ("Answer", "ErrorEstimate", "Problem", "Spikes", "Summary", "Touch"),
    "atlas": ("Atlas", "Contact"),
    "errors": (
        "BadAddress",
        "BadDataset",
        "BadFrame",
        "BadInput",
        "BadModels",
        "BadScene",
        "Closed",
        "FrameFailed",
        "MissingExtra",
        "NativeFault",
        "NativeMissing",
        "NotCarried",
        "NotRendered",
        "NotSolved",
        "PapillaError",
        "Refused",
        "Unreachable",
    ),
    "finger": ("Finger", "FingerContact", "Hand"),
    "http": ("DEFAULT_URL", "Indentation", "indentation", "post", "sed"),
    "inprocess": ("LocalSession", "local"),
    "model": ("Model",),
    "rendering": ("render", "render_chunks"),
    "series": ("Series",),
    "spikes": ("SpikeTrains",),
    "sync": ("Session",),
    "wire": ("SIDE_PX",),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}
_MODULES = (*_NAMES, "actuators", "afferents", "devices", "fe", "frames", "hjif", "meshes", "sensors")

if not TYPE_CHECKING:  # type checkers see the imports above, and refuse other names

    def __getattr__(name: str) -> object:
        if name in _MODULES:
            return import_module(f".{name}", __name__)
        if name not in _HOME:
            raise AttributeError(f"module 'papilla' has no attribute {name!r}")
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__, *_MODULES})
