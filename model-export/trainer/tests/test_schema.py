"""The reader of datasets and the tests' own dataset against docs/reference/dataset.schema.json."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from papilla_trainer import dataset as reader
from papilla_trainer.dataset import Dataset

REFERENCE = Path(__file__).parents[3] / "docs" / "reference"
SCHEMA = json.loads((REFERENCE / "dataset.schema.json").read_text(encoding="utf-8"))
DTYPES = {"f32": np.float32, "f64": np.float64, "u32": np.uint32}


class Named(dict[str, Any]):
    """A dictionary that notes the names asked of it."""

    def __init__(self, of: dict[str, Any], asked: set[str]) -> None:
        super().__init__(of)
        self.asked = asked

    def __getitem__(self, key: str) -> Any:
        self.asked.add(key)
        return super().__getitem__(key)

    def get(self, key: str, default: Any = None) -> Any:
        self.asked.add(key)
        return super().get(key, default)


def test_the_reader_asks_for_nothing_that_the_format_lacks(
    tiny: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest: set[str] = set()
    press: set[str] = set()
    read_manifest = reader._read_manifest

    def noted_manifest(path: Path) -> dict[str, Any]:
        found = read_manifest(path)
        found["presses"] = [Named(p, press) for p in found["presses"]]
        return Named(found, manifest)

    monkeypatch.setattr(reader, "_read_manifest", noted_manifest)
    again = Dataset(tiny.directory)
    again.load(again.train_ids)
    entry = SCHEMA["manifest"]["$defs"]["IndentationEntry"]
    assert len(manifest) > 5
    assert manifest <= set(SCHEMA["manifest"]["required"])
    assert len(press) == 2
    assert press <= set(entry["required"])
    assert SCHEMA["format"] == reader.FORMATS[-1]


def test_the_tests_own_dataset_is_of_the_format(tiny: Dataset) -> None:
    manifest = json.loads((tiny.directory / "manifest.json").read_text(encoding="utf-8"))
    assert set(manifest) <= set(SCHEMA["manifest"]["properties"])
    declared = {a["name"]: a for a in SCHEMA["shard"]}
    for press in manifest["presses"]:
        bytes_ = (tiny.directory / press["file"]).read_bytes()
        assert zipfile.is_zipfile(io.BytesIO(bytes_))
        with np.load(io.BytesIO(bytes_)) as arrays:
            for name in arrays.files:
                array, due = arrays[name], declared[name]
                assert array.dtype == DTYPES[due["dtype"]], name
                assert array.ndim == len(due["shape"]), name
