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
from papilla_trainer.maps import SIDE_PX


def edited(dataset: Dataset, out: Path, edit: Callable[[dict[str, Any]], None]) -> Path:
    shutil.copytree(dataset.directory, out)
    manifest = json.loads((out / "manifest.json").read_text())
    edit(manifest)
    (out / "manifest.json").write_text(json.dumps(manifest))
    return out


def test_samples_keep_press_and_depth(tiny: Dataset) -> None:
    maps = tiny.load([4, 1])
    assert maps.press_id.tolist() == [4] * 6 + [1] * 6
    assert maps.depth_mm[[0, 5, 6, 11]].tolist() == [0.5, 2.0, 0.5, 2.0]
    assert maps.pressure_pa.shape == maps.sed_j_per_m3.shape == (12, SIDE_PX, SIDE_PX)
    assert maps.sed_j_per_m3.max() > 0
    assert not np.array_equal(maps.pressure_pa[5], maps.pressure_pa[11])
    for name in ("pressure_pa", "sed_j_per_m3"):
        stacked = np.stack([getattr(state, name) for state in tiny.states([4, 1])])
        assert np.array_equal(stacked, getattr(maps, name))


def test_states_are_views_of_what_is_on_disk(tiny: Dataset) -> None:
    state = tiny.states([2])[1]
    assert np.shares_memory(state.pressure_pa, tiny.drawn.pressure_pa)
    assert np.shares_memory(state.sed_j_per_m3, tiny.drawn.sed_j_per_m3)
    assert (state.press_id, state.state, state.depth_mm) == (2, 1, pytest.approx(0.8))


def test_validation_presses_come_from_the_training_split(tiny: Dataset) -> None:
    fit, validation = validation_split(tiny.train_ids, 2, seed=3)
    assert len(validation) == 2
    assert sorted(fit + validation) == sorted(tiny.train_ids)
    assert not set(fit + validation) & set(tiny.test_ids)
    assert validation_split(tiny.train_ids, 2, seed=3) == (fit, validation)


def test_another_format_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    newer = edited(tiny, tmp_path / "d", lambda m: m.update(format=3))
    with pytest.raises(DatasetError, match="format among"):
        Dataset(newer)


def test_shipped_dataset_loads_within_its_scales(shipped: Dataset) -> None:
    maps = shipped.load(shipped.train_ids[:1] + shipped.test_ids[:1])
    for values, scale in (
        (maps.pressure_pa, shipped.pressure_max_pa),
        (maps.sed_j_per_m3, shipped.sed_max_j_per_m3),
    ):
        assert values.min() >= 0
        assert 0 < values.max() <= scale * (1 + 1e-6)
