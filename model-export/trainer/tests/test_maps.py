"""Maps that fe-datagen draws, and where they are kept."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from tiny_dataset import write_tiny_dataset

from papilla_trainer.cli import main
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError
from papilla_trainer.maps import Store


def test_maps_are_drawn_once_and_found_again(
    shipped: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = Store(tmp_path / "kept").maps_of(shipped.directory)
    count = sum(press.samples for press in shipped.presses.values())
    assert drawn.pressure_pa.shape == (count, 224, 224)
    assert set(drawn.press.tolist()) == set(shipped.presses)
    assert not drawn.sed_j_per_m3[:, ~drawn.interface].any()
    # No program is needed any more: the folder's hash says whose maps they are.
    monkeypatch.setenv("FE_DATAGEN", "/no/such/program")
    again = Store(tmp_path / "kept").maps_of(shipped.directory)
    assert np.array_equal(again.pressure_pa, drawn.pressure_pa)
    (folder,) = (tmp_path / "kept").iterdir()
    copy = shutil.copytree(folder, tmp_path / "named otherwise")
    assert Store(copy).maps_of(shipped.directory).press.tolist() == drawn.press.tolist()


def test_a_program_that_is_not_there_is_said_with_its_cure(
    shipped: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["train", "--dataset", str(shipped.directory), "--out", str(tmp_path / "run")]
    absent = ["--maps", str(tmp_path / "none"), "--fe-datagen", "/no/such/program"]
    assert main([*command, *absent]) == 3
    said = capsys.readouterr().err
    assert "cargo build --release -p papilla-fe-datagen" in said
    assert "--fe-datagen" in said
    assert not (tmp_path / "run").exists()


def test_what_fe_datagen_refuses_is_an_error(shipped: Dataset, tmp_path: Path) -> None:
    """A dataset with a press in both splits, and one with a damaged shard."""
    leaking = shutil.copytree(shipped.directory, tmp_path / "leaking")
    manifest = json.loads((leaking / "manifest.json").read_text())
    manifest["splits"]["train"].append(manifest["splits"]["test"][0])
    (leaking / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(DatasetError, match="list of splits"):
        Dataset(leaking).load([0])
    damaged = shutil.copytree(shipped.directory, tmp_path / "damaged")
    shard = sorted((damaged / "shards").iterdir())[0]
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(bytes(data))
    with pytest.raises(DatasetError, match="sha256"):
        Dataset(damaged, Store(tmp_path / "kept")).load([0])
    assert not list((tmp_path / "kept").iterdir())


def test_maps_that_are_cut_off_or_of_another_program_are_refused(tmp_path: Path) -> None:
    dataset = write_tiny_dataset(tmp_path / "tiny", seed=21)
    sha256 = hashlib.sha256((dataset / "manifest.json").read_bytes()).hexdigest()
    kept = Path(os.environ["PAPILLA_MAPS"])
    folder = next(
        about.parent
        for about in kept.glob("*/maps.json")
        if json.loads(about.read_text())["manifest_sha256"] == sha256
    )
    copy = shutil.copytree(folder, tmp_path / "maps")
    store = Store(copy)
    assert len(store.maps_of(dataset).press) == 36
    whole = (copy / "pressure_pa.npy").read_bytes()
    (copy / "pressure_pa.npy").write_bytes(whole[:-4096])
    with pytest.raises(DatasetError, match=r"pressure_pa\.npy.*drawn anew"):
        store.maps_of(dataset)
    np.save(copy / "pressure_pa.npy", np.zeros((36, 224, 224)))
    with pytest.raises(DatasetError, match="float64 of shape"):
        store.maps_of(dataset)
    about = json.loads((copy / "maps.json").read_text())
    (copy / "maps.json").write_text(json.dumps({**about, "format": 2}))
    drawer = tmp_path / "drawer"
    drawer.write_text(f'#!/bin/sh\nmkdir -p "$5"; cp {copy}/maps.json "$5"\n')
    drawer.chmod(0o755)
    with pytest.raises(DatasetError, match="another format than 1"):
        Store(tmp_path / "empty", str(drawer)).maps_of(dataset)
