"""Pairs of maps that another network labelled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.draw import draw, drawn
from papilla_trainer.errors import DatasetError, UsageError
from papilla_trainer.export import training_record
from papilla_trainer.pseudo_labels import pseudo_states
from papilla_trainer.tasks import PSEUDO
from papilla_trainer.training import Trainer


def write(path: Path, atlas_hash: str, pairs: int) -> str:
    """Pressure of 1 Pa, 2 Pa, ... all over, and SED of as many hundredths of a J/m3."""
    pressure = np.ones((pairs, 224, 224), np.float32)
    pressure *= np.arange(1, pairs + 1, dtype=np.float32)[:, None, None]
    np.savez(
        path,
        atlas_hash=np.frombuffer(atlas_hash.encode(), dtype=np.uint8),
        network=np.frombuffer(b"other", dtype=np.uint8),
        pressure_pa=pressure,
        sed_j_per_m3=pressure / 100.0,
    )
    return str(path)


def test_pairs_are_read_as_they_are(tiny: Dataset, tmp_path: Path) -> None:
    files = [write(tmp_path / f"{k}.npz", tiny.atlas_hash, k) for k in (2, 1)]
    states = pseudo_states(files, tiny)
    assert [float(state.pressure_pa[5, 7]) for state in states] == [1.0, 2.0, 1.0]
    assert all(np.allclose(s.sed_j_per_m3, s.pressure_pa / 100.0) for s in states)


def test_what_does_not_fit_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="another atlas"):
        pseudo_states([write(tmp_path / "a.npz", "0" * 64, 1)], tiny)
    np.savez(tmp_path / "b.npz", pressure_pa=np.zeros((1, 224, 224), np.float32))
    with pytest.raises(DatasetError, match="pseudo-labels"):
        pseudo_states([str(tmp_path / "b.npz")], tiny)
    file = write(tmp_path / "c.npz", tiny.atlas_hash, 1)
    with pytest.raises(UsageError, match="--pseudo-labels"):
        TrainConfig(network="s1-base4", pseudo_labels=[file])
    with pytest.raises(UsageError, match="--pseudo-samples"):
        TrainConfig(network="map-c2-k3-r2", pseudo_samples=3)


def test_an_epoch_sees_as_many_pairs_as_asked(tiny: Dataset, tmp_path: Path) -> None:
    file = write(tmp_path / "c.npz", tiny.atlas_hash, 5)
    config = TrainConfig(
        network="map-c2-k3-r2",
        epochs=2,
        validation_presses=0,
        pseudo_labels=[file],
        pseudo_samples=2,
        device="cpu",
    )
    trainer = Trainer(tiny, config, tmp_path / "run")
    simulated = sum(tiny.presses[i].samples for i in tiny.train_ids)
    assert len(trainer.fit_samples) == simulated + 5
    assert trainer.epoch_samples == simulated + 2
    seen = [
        draw(trainer.fit_samples.source, trainer.most, torch.Generator().manual_seed(seed))
        for seed in range(8)
    ]
    pairs = [[int(i) for i in order if trainer.fit_samples.source[i] == PSEUDO] for order in seen]
    assert all(len(order) == simulated + 2 for order in seen)
    assert all(len(one) == 2 for one in pairs)
    # Other ones in other epochs.
    assert len({i for one in pairs for i in one}) > 2
    state = trainer.fit()
    assert state.history[-1]["train_loss"] > 0.0
    assert training_record(state, "best")["pseudo_labels"] == ["c.npz"]


def test_each_source_has_its_own_limit() -> None:
    source = torch.tensor([0, 0, 0, 1, 1, PSEUDO, PSEUDO, PSEUDO])
    most = {0: 2, 1: None, PSEUDO: 1}
    order = draw(source, most, torch.Generator().manual_seed(1))
    assert drawn(source, most) == len(order) == 5
    assert sorted(source[order].tolist()) == [PSEUDO, 0, 0, 1, 1]
