from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import onnx
import pytest
import torch

from papilla_trainer.check import check_model
from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.cli import main
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import RunError, UsageError
from papilla_trainer.evaluation import evaluate_run
from papilla_trainer.export import export_run
from papilla_trainer.training import Trainer

CONFIG = TrainConfig(
    network="vertex-r8-n5-g-h6",
    epochs=6,
    seed=5,
    batch=2,
    threads=1,
    device="cpu",
    learning_rate=1e-2,
)


@pytest.fixture(scope="module")
def run_dir(tiny: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("vertex") / "run"
    Trainer(tiny, CONFIG, directory).fit()
    evaluate_run(directory, tiny)
    return directory


def test_the_loss_goes_down(run_dir: Path) -> None:
    losses = [line["train_loss"] for line in Checkpoint.load(run_dir).history]
    assert losses[-1] < 0.9 * losses[0]


def test_resumed_equals_straight_through(tiny: Dataset, run_dir: Path, tmp_path: Path) -> None:
    Trainer(tiny, replace(CONFIG, epochs=2), tmp_path / "run").fit()
    resumed = Trainer(tiny, CONFIG, tmp_path / "run", resume=True).fit()
    straight = Checkpoint.load(run_dir)
    assert all(torch.equal(straight.model[k], resumed.model[k]) for k in straight.model)
    with pytest.raises(RunError, match="far_weight"):
        Trainer(tiny, replace(CONFIG, far_weight=0.5), tmp_path / "run", resume=True)


def test_only_training_presses_are_loaded(
    tiny: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[int] = []
    load = tiny.load_vertices

    def spy(ids: list[int]) -> object:
        loaded.extend(ids)
        return load(ids)

    monkeypatch.setattr(tiny, "load_vertices", spy)
    Trainer(tiny, replace(CONFIG, epochs=1), tmp_path / "all").fit()
    assert sorted(loaded) == sorted(tiny.train_ids)
    loaded.clear()
    trainer = Trainer(tiny, replace(CONFIG, epochs=1, train_presses=2), tmp_path / "two")
    fit, validation = trainer.state.splits["fit"], trainer.state.splits["validation"]
    assert len(fit) == 2
    assert sorted(loaded) == sorted([*fit, *validation])


def test_the_exported_graph_is_the_network(tiny: Dataset, run_dir: Path, tmp_path: Path) -> None:
    model = export_run(run_dir, tmp_path / "vertex.onnx")
    report = check_model(model, tiny, run_dir, None)
    assert report.failures == []
    assert report.zero_gives_zero is True
    assert (
        export_run(run_dir, tmp_path / "again" / "vertex.onnx").read_bytes() == model.read_bytes()
    )
    found = {entry.key: entry.value for entry in onnx.load(str(model)).metadata_props}
    assert json.loads(found["papilla.network"])["kind"] == "vertex_net"
    assert json.loads(found["papilla.training"])["loss"].startswith("relative L2 squared")


def test_s1_can_have_the_better_loss(tiny: Dataset, tmp_path: Path) -> None:
    config = replace(CONFIG, network="s1-base2", epochs=2, loss="relative", batch=2)
    history = Trainer(tiny, config, tmp_path / "run").fit().history
    assert history[-1]["train_loss"] < history[0]["train_loss"]
    assert replace(CONFIG, network="s1-base2").loss_name == "mse"


def test_senseless_settings_are_refused(tiny: Dataset, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="operator"):
        replace(CONFIG, network="s1-base4", operator="operator.npz")
    with pytest.raises(UsageError, match="loss"):
        replace(CONFIG, loss="l1")
    out = ["--out", str(tmp_path / "run"), "--network", "vertex-r8", "--operator", "none.npz"]
    assert main(["train", "--dataset", str(tiny.directory), *out]) == 3
