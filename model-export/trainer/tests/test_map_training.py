"""Training of networks on maps: the relative loss, joined datasets, learning curves."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from conftest import REPOSITORY, program
from tiny_dataset import write_tiny_dataset

from papilla_trainer.check import check_model
from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.cli import main
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError, RunError, UsageError
from papilla_trainer.export import export_run
from papilla_trainer.joined import STRIDE, open_datasets
from papilla_trainer.losses import relative_loss
from papilla_trainer.training import Trainer


@pytest.fixture(scope="module")
def on_maps() -> TrainConfig:
    return TrainConfig(
        network="map-c2-k3-r4-h2",
        epochs=6,
        seed=5,
        batch=2,
        threads=1,
        device="cpu",
        learning_rate=1e-2,
    )


@pytest.fixture(scope="module")
def run_dir(tiny: Dataset, on_maps: TrainConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("maps") / "run"
    Trainer(tiny, on_maps, directory).fit()
    return directory


def test_the_loss_goes_down(run_dir: Path) -> None:
    losses = [line["train_loss"] for line in Checkpoint.load(run_dir).history]
    assert losses[-1] < 0.9 * losses[0]


def test_resumed_equals_straight_through(
    tiny: Dataset, on_maps: TrainConfig, run_dir: Path, tmp_path: Path
) -> None:
    Trainer(tiny, replace(on_maps, epochs=2), tmp_path / "run").fit()
    resumed = Trainer(tiny, on_maps, tmp_path / "run", resume=True).fit()
    straight = Checkpoint.load(run_dir)
    assert all(torch.equal(straight.model[k], resumed.model[k]) for k in straight.model)
    with pytest.raises(RunError, match="far_weight"):
        Trainer(tiny, replace(on_maps, far_weight=0.5), tmp_path / "run", resume=True)


def test_only_training_presses_are_loaded(
    tiny: Dataset, on_maps: TrainConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[int] = []
    states = tiny.states

    def spy(ids: list[int]) -> object:
        loaded.extend(ids)
        return states(ids)

    monkeypatch.setattr(tiny, "states", spy)
    Trainer(tiny, replace(on_maps, epochs=1), tmp_path / "all").fit()
    assert sorted(loaded) == sorted(tiny.train_ids)
    loaded.clear()
    trainer = Trainer(tiny, replace(on_maps, epochs=1, train_presses=2), tmp_path / "two")
    fit, validation = trainer.state.splits["fit"], trainer.state.splits["validation"]
    assert len(fit) == 2
    assert sorted(loaded) == sorted([*fit, *validation])


def test_the_exported_graph_is_the_network(tiny: Dataset, run_dir: Path, tmp_path: Path) -> None:
    model = export_run(run_dir, tmp_path / "maps.onnx")
    report = check_model(model, tiny, [run_dir], None)
    assert report.failures == []
    assert report.zero_gives_zero is True
    assert export_run(run_dir, tmp_path / "again" / "maps.onnx").read_bytes() == model.read_bytes()
    found = {entry.key: entry.value for entry in onnx.load(str(model)).metadata_props}
    assert json.loads(found["papilla.network"])["kind"] == "map_net"
    assert json.loads(found["papilla.training"])["loss"].startswith("relative L2 squared")


def test_s1_can_have_the_better_loss(tiny: Dataset, config: TrainConfig, tmp_path: Path) -> None:
    better = replace(config, network="s1-base2", epochs=2, loss="relative", batch=2)
    history = Trainer(tiny, better, tmp_path / "run").fit().history
    assert history[-1]["train_loss"] < history[0]["train_loss"]
    assert replace(config, network="s1-base2").loss_name == "mse"


def test_senseless_settings_are_refused(on_maps: TrainConfig) -> None:
    with pytest.raises(UsageError, match="loss"):
        replace(on_maps, loss="l1")


def test_two_datasets_are_one(
    tiny: Dataset, on_maps: TrainConfig, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    second = write_tiny_dataset(tmp_path / "second", presses=5, seed=2)
    datasets = ["--dataset", str(tiny.directory), "--dataset", str(second)]
    both = open_datasets([tiny.directory, second])
    assert both.train_ids == [*tiny.train_ids, *(STRIDE + i for i in (0, 1, 3, 4))]
    assert both.test_ids == [*tiny.test_ids, STRIDE + 2]
    assert both.pressure_max_pa == tiny.pressure_max_pa
    other = Dataset(second)
    joined = hashlib.sha256((tiny.dataset_sha256 + other.dataset_sha256).encode())
    assert both.dataset_sha256 == joined.hexdigest()
    maps = both.load([STRIDE + 3, 1])
    np.testing.assert_array_equal(maps.pressure_pa[:6], other.load([3]).pressure_pa)
    np.testing.assert_array_equal(maps.pressure_pa[6:], tiny.load([1]).pressure_pa)
    assert maps.press_id.tolist() == [STRIDE + 3] * 6 + [1] * 6
    with pytest.raises(DatasetError, match="twice"):
        open_datasets([second, second])
    run, model = str(tmp_path / "run"), str(tmp_path / "model.onnx")
    settings = ["--network", on_maps.network, "--epochs", "2"]
    assert main(["train", *datasets, "--out", run, *settings, "--threads", "1"]) == 0
    assert main(["export", run, "--onnx", model]) == 0
    assert main(["check", model, *datasets, "--run", run]) == 0
    assert main(["check", model, *datasets[:2]]) == 1
    found = {entry.key: entry.value for entry in onnx.load(model).metadata_props}
    assert found["papilla.dataset_sha256"] == both.dataset_sha256
    assert json.loads(found["papilla.training"])["datasets"] == both.hashes


def test_large_constants_are_stored_small_and_lose_nothing(
    tiny: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = ["--dataset", str(tiny.directory), "--rank", "8", "--near", "5", "--name", "tiny"]
    plain, small = tmp_path / "plain.onnx", tmp_path / "small.onnx"
    assert main(["half-space", *body, "--onnx", str(plain)]) == 0
    monkeypatch.setattr("papilla_trainer.export._LARGE", 16)
    assert main(["half-space", *body, "--onnx", str(small)]) == 0
    stored = [i for i in onnx.load(str(small)).graph.initializer if i.name.endswith(".stored")]
    kinds = {i.data_type for i in stored}
    assert kinds == {onnx.TensorProto.FLOAT16, onnx.TensorProto.INT16}
    assert any("stencil" in i.name for i in stored)
    assert small.stat().st_size < plain.stat().st_size
    assert check_model(small, tiny, [], None).failures == []
    pressure = tiny.load(tiny.test_ids).pressure_pa[0][None, None]
    answers = [
        onnxruntime.InferenceSession(str(path)).run(None, {"pressure_pa": pressure})[0]
        for path in (plain, small)
    ]
    assert np.array_equal(*answers)


def test_a_learning_curve_grows_and_goes_on(
    shipped: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = Dataset(REPOSITORY / "data" / "final")
    out = tmp_path / "curve"
    arguments = ["curve", "--json", "--dataset", str(shipped.directory), "--judge"]
    arguments += [str(other.directory), "--network", "map-c2-k3-r4", "--threads", "1"]
    arguments += ["--epochs", "2", "--out", str(out), "--model-export", program("model-export")]
    arguments += ["--validation-presses", "1", "--presses", "4", "2"]
    assert main(arguments) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    # As many steps on two presses as on the five that there are.
    assert [(row["presses"], row["epochs"]) for row in rows[::2]] == [(2, 5), (4, 3)]
    assert {row["judged_on"] for row in rows} == {"final-anew, held out", "final"}
    assert all(0.0 < row["relative_l2_median"] < 2.0 for row in rows)
    small, large = (set(Checkpoint.load(out / f"presses-{n}").splits["fit"]) for n in (2, 4))
    assert small < large
    assert (out / "curve.svg").read_text(encoding="utf-8").count("<path") > 5
    # A second time nothing is trained, and the figures are the same.
    before = (out / "presses-2" / "checkpoint.pt").stat().st_mtime_ns
    assert main([*arguments[:-2], "2"]) == 0
    again = json.loads(capsys.readouterr().out)["rows"]
    assert [{**row, "seconds": 0} for row in again] == [{**row, "seconds": 0} for row in rows[:2]]
    assert (out / "presses-2" / "checkpoint.pt").stat().st_mtime_ns == before
    # What is trained on does not judge.
    arguments[5] = str(shipped.directory)
    assert main(arguments) == 2


def test_relative_loss_is_what_it_says() -> None:
    target = torch.tensor([[10.0, 0.5, 0.5], [0.0, 0.0, 0.0]])
    weights = torch.tensor([[1.0, 2.0, 0.0]])
    output = target + torch.tensor([[1.0, 0.1, 99.0], [0.0, 0.0, 0.0]])
    whole = (1.0 + 2 * 0.01) / (100.0 + 2 * 0.25)
    far = 2 * 0.01 / (2 * 0.25 + 1e-4 * 100.5)
    expected = 0.5 * (whole + 0.3 * far)  # the empty sample counts nothing
    assert float(relative_loss(output, target, weights, 0.3)) == pytest.approx(expected, rel=1e-5)
