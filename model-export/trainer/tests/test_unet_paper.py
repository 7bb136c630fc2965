"""What the study of the U-Net paper needs: its split, a budget of time, errors of states."""

from __future__ import annotations

import dataclasses
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import program

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.comparison.measures import Zones, measure
from papilla_trainer.comparison.split_by_sample import SplitBySample
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import RunError
from papilla_trainer.export import export_run
from papilla_trainer.serving import predict, served_model
from papilla_trainer.training import Trainer

FIGURES = (
    "relative_l2",
    "far_field_relative_l2",
    "peak_error",
    "nail_base_error",
    "total_energy_error",
)


def test_a_split_by_sample_shares_simulations_and_no_state(tiny: Dataset) -> None:
    split = SplitBySample(tiny, seed=3)
    states = sum(press.samples for press in tiny.presses.values())
    assert len(split.test_ids) == sum(tiny.presses[i].samples for i in tiny.test_ids)
    assert sorted(split.train_ids + split.test_ids) == list(range(states))
    pairs = {
        part: [(int(tiny.drawn.press[row]), int(tiny.drawn.state[row])) for row in rows]
        for part, rows in (("train", split.train_ids), ("test", split.test_ids))
    }
    assert not set(pairs["train"]) & set(pairs["test"])
    assert {press for press, _ in pairs["train"]} & {press for press, _ in pairs["test"]}
    assert split.test_ids == SplitBySample(tiny, seed=3).test_ids
    assert split.test_ids != SplitBySample(tiny, seed=4).test_ids
    # Row by row the same maps as of the whole dataset.
    whole = {(s.press_id, s.state): s for s in tiny.states(sorted(tiny.presses))}
    for pair, state in zip(pairs["test"], split.states(split.test_ids), strict=True):
        assert state.state == whole[pair].state
        assert np.array_equal(state.pressure_pa, whole[pair].pressure_pa)
        assert np.array_equal(state.sed_j_per_m3, whole[pair].sed_j_per_m3)


def test_a_network_learns_by_sample_and_not_from_the_states_for_testing(
    tiny: Dataset, config: TrainConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    split = SplitBySample(tiny, seed=3)
    read: list[int] = []
    states = split.states
    monkeypatch.setattr(split, "states", lambda ids: read.extend(ids) or states(ids))
    run = dataclasses.replace(config, epochs=3, validation_presses=0)
    history = Trainer(split, run, tmp_path / "run").fit().history
    assert history[-1]["train_loss"] < history[0]["train_loss"]
    assert sorted(read) == split.train_ids
    # Of the other split nothing goes on from it.
    with pytest.raises(RunError, match="another split"):
        Trainer(tiny, run, tmp_path / "run", resume=True)


def test_training_stops_when_it_is_enough_and_goes_on_from_there(
    tiny: Dataset, config: TrainConfig, finished: Checkpoint, tmp_path: Path
) -> None:
    def enough(state: Checkpoint) -> bool:
        return len(state.history) >= 2

    stopped = Trainer(tiny, config, tmp_path / "run").fit(enough=enough)
    assert stopped.epoch == 2
    assert all(line["processor_seconds"] > 0.0 for line in stopped.history)
    again = Trainer(tiny, config, tmp_path / "run", resume=True)
    assert again.fit(enough=enough).epoch == 2
    straight = [line["train_loss"] for line in finished.history]
    assert [line["train_loss"] for line in again.fit().history] == straight


def test_errors_are_those_that_model_export_measures(
    shipped: Dataset, config: TrainConfig, tmp_path: Path
) -> None:
    run = dataclasses.replace(config, epochs=1, train_presses=2, batch=2)
    Trainer(shipped, run, tmp_path / "run").fit()
    model = export_run(tmp_path / "run", tmp_path / "model.onnx")
    command = [program("model-export"), "evaluate", str(model), str(shipped.directory), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    metrics = json.loads(done.stdout)["card"]["metrics"]
    maps = shipped.load(shipped.test_ids)
    found = predict(served_model(Checkpoint.load(tmp_path / "run")), maps.pressure_pa)
    zones = Zones.of(shipped)
    assert zones.nail_base.any()
    assert (zones.mask | ~zones.nail_base).all()
    each = [measure(p, t, zones) for p, t in zip(found, maps.sed_j_per_m3, strict=True)]
    assert metrics["samples"] == len(each)
    for figure in FIGURES:
        values = [errors[figure] for errors in each]
        assert np.median(values) == pytest.approx(metrics[figure]["median"], rel=1e-3)
        assert np.percentile(values, 95) == pytest.approx(metrics[figure]["p95"], rel=1e-3)
