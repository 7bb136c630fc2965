"""What scenes and campaigns are given as, and what they explain of themselves."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadScene

Source = str | os.PathLike[str] | Mapping[str, Any]
"""The path of a TOML file, TOML text, or a dict with the members of such a file."""


class Explanation(dict[str, Any]):
    """What there is to simulate, and what it costs: members of `fe-datagen explain --json`; `print` shows the text."""

    def __init__(self, members: dict[str, Any], text: str) -> None:
        super().__init__(members)
        self.text = text

    def __str__(self) -> str:
        return self.text


def read(source: Source, name: str = "scene.toml") -> tuple[Path, str | None, bool]:
    """Where it stands or would stand, its text if it is given, and whether that is JSON."""
    if isinstance(source, Mapping):
        return Path(name), json.dumps(_plain(source, "")), True
    if isinstance(source, str) and "\n" in source:
        return Path(name), source, False
    return Path(source), None, False


def _plain(value: Any, at: str) -> Any:
    """Numbers, lists and dicts for JSON, of numpy's too; raises BadScene for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(name): _plain(member, f"{at}.{name}" if at else str(name)) for name, member in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist(), at)
    if isinstance(value, list | tuple):
        return [_plain(item, f"{at}[{number}]") for number, item in enumerate(value)]
    if isinstance(value, np.generic):
        return _plain(value.item(), at)
    if isinstance(value, float) and not math.isfinite(value):
        raise BadScene(f"{at}: {value}; a finite number is due", at)
    return os.fspath(value) if isinstance(value, os.PathLike) else value
