"""Samples whose pressure is the service's own contact's."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch
from tiny_dataset import write_tiny_dataset

from papilla_trainer.config import TrainConfig
from papilla_trainer.contact_maps import with_contact
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError, UsageError
from papilla_trainer.export import training_record
from papilla_trainer.joined import STRIDE, JoinedDataset
from papilla_trainer.training import Trainer


def write(path: Path, dataset: Dataset, press: list[int], state: list[int]) -> str:
    """Pressure of 1 Pa, 2 Pa, ... all over."""
    value = np.arange(1, len(press) + 1, dtype=np.float32)
    np.savez(
        path,
        dataset_sha256=np.frombuffer(dataset.dataset_sha256.encode(), dtype=np.uint8),
        press=np.array(press),
        state=np.array(state),
        pressure_pa=np.broadcast_to(value[:, None, None], (len(press), 224, 224)),
    )
    return str(path)


def test_a_pressure_goes_with_the_sed_of_its_own_state(tmp_path: Path) -> None:
    parts = [
        Dataset(write_tiny_dataset(tmp_path / f"{seed}", presses=6, depths=3, seed=seed))
        for seed in (1, 2)
    ]
    joined = JoinedDataset(parts)
    first, last = parts[1].train_ids[0], parts[1].train_ids[-1]
    held_out = parts[1].test_ids[0]
    file = write(tmp_path / "c.npz", parts[1], [last, held_out, first], [2, 1, 0])
    states = joined.states(joined.train_ids)
    found = with_contact(states, joined, [file])
    # The held-out press is not asked for, so it is not learnt.
    assert len(found) == len(states) + 2
    assert [state.press_id for state in found[-2:]] == [STRIDE + last, STRIDE + first]
    assert [state.pressure_pa[0, 0] for state in found[-2:]] == [1.0, 3.0]
    truth = joined.load([STRIDE + last, STRIDE + first]).sed_j_per_m3
    assert np.array_equal([state.sed_j_per_m3 for state in found[-2:]], truth[[2, 3]])
    assert all(a is b for a, b in zip(found, states, strict=False))


def test_a_file_of_another_dataset_is_refused(tiny: Dataset, tmp_path: Path) -> None:
    other = Dataset(write_tiny_dataset(tmp_path / "other", seed=9))
    file = write(tmp_path / "c.npz", other, other.train_ids[:1], [0])
    with pytest.raises(DatasetError, match="not trained on"):
        with_contact(tiny.states(tiny.train_ids), tiny, [file])
    with pytest.raises(DatasetError, match="not a readable"):
        with_contact(tiny.states(tiny.train_ids), tiny, [str(tmp_path / "none.npz")])
    with pytest.raises(UsageError, match="--contact"):
        TrainConfig(network="s1-base4", contact=[file])


def test_a_run_learns_from_both_pressures(tiny: Dataset, tmp_path: Path) -> None:
    file = write(tmp_path / "c.npz", tiny, tiny.train_ids[:1], [1])
    config = TrainConfig(
        network="map-c2-k3-r2", epochs=1, validation_presses=0, contact=[file], device="cpu"
    )
    trainer = Trainer(tiny, config, tmp_path / "run")
    states = sum(tiny.presses[i].samples for i in tiny.train_ids)
    assert len(trainer.fit_samples) == states + 1
    assert trainer.fit().history[-1]["train_loss"] > 0.0


def test_a_run_learns_from_the_pressure_of_contact_alone(tiny: Dataset, tmp_path: Path) -> None:
    first, held_out = tiny.train_ids[0], tiny.test_ids[0]
    file = write(tmp_path / "c.npz", tiny, [first, held_out, first], [1, 0, 0])
    config = TrainConfig(
        network="map-c2-k3-r2",
        epochs=1,
        validation_presses=0,
        contact=[file],
        contact_alone=True,
        device="cpu",
    )
    trainer = Trainer(tiny, config, tmp_path / "run")
    inputs, _ = trainer.fit_samples.batch(torch.tensor([0, 1]))
    assert len(trainer.fit_samples) == 2
    assert inputs[:, 0, 0, 0].tolist() == [1.0, 3.0]
    assert training_record(trainer.fit(), "best")["contact_alone"] is True
    with pytest.raises(UsageError, match="--contact-alone"):
        dataclasses.replace(config, contact=[])
    with pytest.raises(UsageError, match="pseudo"):
        dataclasses.replace(config, pseudo_labels=[file])
    none_to_learn = write(tmp_path / "held-out.npz", tiny, [held_out], [0])
    config = dataclasses.replace(config, contact=[none_to_learn])
    with pytest.raises(UsageError, match="no state of the training"):
        Trainer(tiny, config, tmp_path / "none")
