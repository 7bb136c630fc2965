from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from papilla_trainer.dataset import Dataset, validation_split
from papilla_trainer.errors import DatasetError
from papilla_trainer.raster import SIDE_PX


def edited(dataset: Dataset, out: Path, edit: Callable[[dict[str, Any]], None]) -> Path:
    shutil.copytree(dataset.directory, out)
    manifest = json.loads((out / "manifest.json").read_text())
    edit(manifest)
    (out / "manifest.json").write_text(json.dumps(manifest))
    return out


def test_constant_becomes_the_mask(tiny: Dataset) -> None:
    ones = np.ones((1, tiny.vertex_count), dtype=np.float32)
    np.testing.assert_allclose(tiny.skin.rasterise(ones)[0], tiny.skin.mask(), atol=1e-6)


def test_linear_field_is_reproduced_at_pixel_centres(tiny: Dataset) -> None:
    # On the tiny grid vertex u runs linearly from 16 to 208 px over 9 columns.
    u = np.tile(np.linspace(16.0, 208.0, 9, dtype=np.float32), 12)[None]
    centres = np.broadcast_to(np.arange(SIDE_PX, dtype=np.float32) + 0.5, (SIDE_PX, SIDE_PX))
    inside = tiny.skin.mask() > 0
    np.testing.assert_allclose(tiny.skin.rasterise(u)[0][inside], centres[inside], atol=1e-3)


def test_samples_keep_press_and_depth(tiny: Dataset) -> None:
    maps = tiny.load([4, 1])
    assert maps.press_id.tolist() == [4] * 6 + [1] * 6
    assert maps.depth_mm[[0, 5, 6, 11]].tolist() == [0.5, 2.0, 0.5, 2.0]
    assert maps.pressure_pa.shape == maps.sed_j_per_m3.shape == (12, SIDE_PX, SIDE_PX)
    assert maps.sed_j_per_m3.max() > 0
    assert not np.array_equal(maps.pressure_pa[5], maps.pressure_pa[11])


def test_validation_presses_come_from_the_training_split(tiny: Dataset) -> None:
    fit, validation = validation_split(tiny.train_ids, 2, seed=3)
    assert len(validation) == 2
    assert sorted(fit + validation) == sorted(tiny.train_ids)
    assert not set(fit + validation) & set(tiny.test_ids)
    assert validation_split(tiny.train_ids, 2, seed=3) == (fit, validation)


def test_a_press_in_both_splits_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    leaking = edited(tiny, tmp_path / "d", lambda m: m["splits"]["train"].append(tiny.test_ids[0]))
    with pytest.raises(DatasetError, match="both splits"):
        Dataset(leaking)


def test_a_label_that_contradicts_the_list_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    wrong = edited(tiny, tmp_path / "d", lambda m: m["presses"][2].update(split="train"))
    with pytest.raises(DatasetError, match="another split"):
        Dataset(wrong)


def test_a_manifest_that_does_not_match_its_shards_is_refused(
    tiny: Dataset, tmp_path: Path
) -> None:
    cut = edited(tiny, tmp_path / "d", lambda m: m.update(presses=m["presses"][:-1]))
    with pytest.raises(DatasetError, match="dataset_sha256"):
        Dataset(cut)


def test_another_format_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    newer = edited(tiny, tmp_path / "d", lambda m: m.update(format=3))
    with pytest.raises(DatasetError, match="format among"):
        Dataset(newer)


def test_a_damaged_shard_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    copy = edited(tiny, tmp_path / "d", lambda m: None)
    shard = copy / "shards" / "press-00001.npz"
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(bytes(data))
    with pytest.raises(DatasetError, match="damaged"):
        Dataset(copy).load([1])


def test_shipped_dataset_loads_within_its_scales(shipped: Dataset) -> None:
    maps = shipped.load(shipped.train_ids[:1] + shipped.test_ids[:1])
    for values, scale in (
        (maps.pressure_pa, shipped.pressure_max_pa),
        (maps.sed_j_per_m3, shipped.sed_max_j_per_m3),
    ):
        assert values.min() >= 0
        assert 0 < values.max() <= scale * (1 + 1e-6)
