"""Client of Papilla, a service that renders what a fingertip feels.

Pressure on the skin (Pa) in, strain energy density (SED) at the dermis-epidermis interface (J/m3)
out, both as arrays of 224 x 224 float32, row 0 at the fingertip's far end.

- `sed(pressure_pa)`: one map over HTTP
- `Session`, `AsyncSession`: many maps, or where things are, over a WebSocket; the latest frame wins
- `render`: a series of frames in one call, as arrays with units and files (`Series`)
- `SpikeTrains`: when the touch units of a finger fire, as files
- `sensors`: readings of an array of taxels to pressure, SED, rates and spikes
- `meshes`: STL, OBJ, PLY and GLB as objects of a session
- `frames`: poses of engines and robots to the finger's frame, forces back
- `Atlas`: which point of the finger each pixel is; pressure maps from vertices or contact points
"""

from importlib import import_module
from types import ModuleType

from . import frames
from .aio import AsyncSession
from .answer import Answer, Problem, Summary, Touch
from .atlas import Atlas, Contact
from .errors import (
    BadAddress,
    BadFrame,
    BadInput,
    Closed,
    FrameFailed,
    MissingExtra,
    NotCarried,
    NotRendered,
    PapillaError,
    Refused,
    Unreachable,
)
from .http import DEFAULT_URL, Indentation, indentation, post, sed
from .rendering import render, render_chunks
from .series import Series
from .spikes import Spikes, SpikeTrains
from .sync import Session
from .wire import SIDE_PX

__all__ = [
    "DEFAULT_URL",
    "SIDE_PX",
    "Answer",
    "AsyncSession",
    "Atlas",
    "BadAddress",
    "BadFrame",
    "BadInput",
    "Closed",
    "Contact",
    "FrameFailed",
    "Indentation",
    "MissingExtra",
    "NotCarried",
    "NotRendered",
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
    "frames",
    "indentation",
    "post",
    "render",
    "render_chunks",
    "sed",
]


def __getattr__(name: str) -> ModuleType:
    # Loaded when they are first named: a program that touches needs neither.
    if name in ("meshes", "sensors"):
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module 'papilla' has no attribute {name!r}")
