"""A sensor from a description in TOML."""

from __future__ import annotations

import tomllib
from os import PathLike
from pathlib import Path
from typing import Any, Final

from ..atlas import Atlas
from ..errors import BadInput
from ..http import DEFAULT_URL
from .taxels import Taxels

_SENSOR: Final = {"name", "unit", "gain", "offset", "noise", "dead"}
_GRID: Final = {"rows", "columns", "pitch_mm", "taxel_mm", "centre_mm", "quaternion", "wrapped", "yaw_deg"}
_TAXEL: Final = {"mm", "px", "area_mm2", "quaternion", "gain", "offset"}
_RECORD: Final = {"time", "time_unit", "rate_hz", "columns", "topic", "field"}


def _read(path: str | PathLike[str]) -> dict[str, Any]:
    file = Path(path)
    try:
        held = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise BadInput("sensor", f"{file} does not exist") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput("sensor", f"{file.name} is no TOML: {error}") from error
    _known(file.name, held, {"sensor", "grid", "taxel", "record"}, "")
    if not isinstance(held.get("taxel", []), list):
        raise BadInput("taxel", f"{file.name}: taxels are written as [[taxel]], one for each")
    for section, members in (("sensor", _SENSOR), ("grid", _GRID), ("record", _RECORD)):
        if not isinstance(held.get(section, {}), dict):
            raise BadInput(section, f"{file.name}: a table [{section}] is due")
        _known(file.name, held.get(section, {}), members, f"{section}.")
    for number, taxel in enumerate(held.get("taxel", [])):
        _known(file.name, taxel, _TAXEL, f"taxel[{number}].")
    if ("grid" in held) == ("taxel" in held):
        raise BadInput("grid", f"{file.name}: give a table [grid], or a [[taxel]] for each taxel")
    return held


def _known(file: str, table: dict[str, Any], members: set[str], where: str) -> None:
    unknown = sorted(set(table) - members)
    if unknown:
        raise BadInput(where + unknown[0], f"{file}: no such member; there are {', '.join(sorted(members))}")


def describe(
    path: str | PathLike[str], *, atlas: Atlas | None = None, url: str = DEFAULT_URL, token: str | None = None
) -> Taxels:
    """The sensor that a file describes; docs/guides/sensors.md lists the members. Raises BadInput."""
    held = _read(path)
    sensor = dict(held.get("sensor", {}))
    atlas = Atlas.load(url, token) if atlas is None else atlas
    try:
        if "grid" in held:
            missing = [name for name in ("rows", "columns", "pitch_mm") if name not in held["grid"]]
            if missing:
                raise BadInput(f"grid.{missing[0]}", f"{Path(path).name}: it is missing")
            return _grid(Path(path).name, held["grid"], atlas, sensor)
        taxels = held["taxel"]
        for number, taxel in enumerate(taxels):
            missing = [name for name in ("area_mm2",) if name not in taxel]
            if missing or ("mm" in taxel) == ("px" in taxel) or ("mm" in taxel) != ("mm" in taxels[0]):
                raise BadInput(f"taxel[{number}]", "area_mm2 is due, and a place: of all taxels as mm, or of all as px")
        kind = "mm" if "mm" in taxels[0] else "px"
        for member in ("gain", "offset"):
            if any(member in taxel for taxel in taxels):
                default = sensor.get(member, 1.0 if member == "gain" else 0.0)
                sensor[member] = [taxel.get(member, default) for taxel in taxels]
        places: dict[str, Any] = {kind: [taxel[kind] for taxel in taxels]}
        turned = ["quaternion" in taxel for taxel in taxels]
        if any(turned):
            if not all(turned):
                missing_at = turned.index(False)
                raise BadInput(f"taxel[{missing_at}]", "quaternion is missing: give one for every taxel, or for none")
            places["quaternion"] = [taxel["quaternion"] for taxel in taxels]
        return Taxels.at(**places, area_mm2=[taxel["area_mm2"] for taxel in taxels], atlas=atlas, **sensor)
    except TypeError as error:
        raise BadInput("sensor", f"{Path(path).name}: {error}") from error


def _grid(file: str, grid: dict[str, Any], atlas: Atlas, sensor: dict[str, Any]) -> Taxels:
    """A flat array, or one that wraps the finger."""
    of_kind = dict(grid)
    wrapped = of_kind.pop("wrapped", False)
    if not isinstance(wrapped, bool):
        raise BadInput("grid.wrapped", f"{file}: {wrapped!r}; true or false is due")
    wrong = "quaternion" if wrapped else "yaw_deg"
    if wrong in of_kind:
        kind = "a wrapped array lies on the skin: turn it by yaw_deg" if wrapped else "a flat array turns by quaternion"
        raise BadInput(f"grid.{wrong}", f"{file}: {kind}")
    make = Taxels.wrapped if wrapped else Taxels.grid
    return make(**of_kind, atlas=atlas, **sensor)


def describe_record(path: str | PathLike[str]) -> dict[str, Any]:
    """What the description says of records: arguments of `read_record`."""
    return dict(_read(path).get("record", {}))
