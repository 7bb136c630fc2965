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
from tiny_dataset import write_tiny_dataset

from papilla_trainer.check import check_model
from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.cli import main
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError, RunError, UsageError
from papilla_trainer.evaluation import evaluate_run
from papilla_trainer.export import export_run
from papilla_trainer.joined import STRIDE, open_datasets
from papilla_trainer.training import Trainer


@pytest.fixture(scope="module")
def face(operator_file: Path) -> TrainConfig:
    return TrainConfig(
        network="face-r8-n12-z4-h6",
        epochs=6,
        seed=5,
        batch=2,
        threads=1,
        device="cpu",
        learning_rate=1e-2,
        operator=str(operator_file),
    )


@pytest.fixture(scope="module")
def run_dir(tiny: Dataset, face: TrainConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("face") / "run"
    Trainer(tiny, face, directory).fit()
    evaluate_run(directory, tiny)
    return directory


def test_the_loss_goes_down(run_dir: Path) -> None:
    losses = [line["train_loss"] for line in Checkpoint.load(run_dir).history]
    assert losses[-1] < 0.9 * losses[0]


def test_resumed_equals_straight_through(
    tiny: Dataset, face: TrainConfig, run_dir: Path, tmp_path: Path
) -> None:
    Trainer(tiny, replace(face, epochs=2), tmp_path / "run").fit()
    resumed = Trainer(tiny, face, tmp_path / "run", resume=True).fit()
    straight = Checkpoint.load(run_dir)
    assert all(torch.equal(straight.model[k], resumed.model[k]) for k in straight.model)
    with pytest.raises(RunError, match="far_weight"):
        Trainer(tiny, replace(face, far_weight=0.5), tmp_path / "run", resume=True)


def test_only_training_presses_are_loaded(
    tiny: Dataset, face: TrainConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[int] = []
    load = tiny.load_vertices

    def spy(ids: list[int]) -> object:
        loaded.extend(ids)
        return load(ids)

    monkeypatch.setattr(tiny, "load_vertices", spy)
    Trainer(tiny, replace(face, epochs=1), tmp_path / "all").fit()
    assert sorted(loaded) == sorted(tiny.train_ids)
    loaded.clear()
    trainer = Trainer(tiny, replace(face, epochs=1, train_presses=2), tmp_path / "two")
    fit, validation = trainer.state.splits["fit"], trainer.state.splits["validation"]
    assert len(fit) == 2
    assert sorted(loaded) == sorted([*fit, *validation])


def test_the_exported_graph_is_the_network(tiny: Dataset, run_dir: Path, tmp_path: Path) -> None:
    model = export_run(run_dir, tmp_path / "face.onnx")
    report = check_model(model, tiny, [run_dir], None)
    assert report.failures == []
    assert report.zero_gives_zero is True
    assert export_run(run_dir, tmp_path / "again" / "face.onnx").read_bytes() == model.read_bytes()
    found = {entry.key: entry.value for entry in onnx.load(str(model)).metadata_props}
    assert json.loads(found["papilla.network"])["kind"] == "face_net"
    assert json.loads(found["papilla.training"])["loss"].startswith("relative L2 squared")


def test_s1_can_have_the_better_loss(tiny: Dataset, config: TrainConfig, tmp_path: Path) -> None:
    better = replace(config, network="s1-base2", epochs=2, loss="relative", batch=2)
    history = Trainer(tiny, better, tmp_path / "run").fit().history
    assert history[-1]["train_loss"] < history[0]["train_loss"]
    assert replace(config, network="s1-base2").loss_name == "mse"


def test_senseless_settings_are_refused(tiny: Dataset, face: TrainConfig, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="operator"):
        replace(face, network="s1-base4")
    with pytest.raises(UsageError, match="operator"):
        replace(face, operator=None)
    with pytest.raises(UsageError, match="base-rate"):
        replace(face, base_rate=-0.1)
    with pytest.raises(UsageError, match="loss"):
        replace(face, loss="l1")
    out = ["--out", str(tmp_path / "run"), "--network", "face-r8", "--operator", "none.npz"]
    assert main(["train", "--dataset", str(tiny.directory), *out]) == 3


def test_without_base_rate_the_operator_stays(
    tiny: Dataset, face: TrainConfig, tmp_path: Path
) -> None:
    trainer = Trainer(tiny, replace(face, base_rate=0.0, epochs=2), tmp_path / "run")
    before = [parameter.detach().clone() for parameter in trainer.network.linear_map()]
    state = trainer.fit()
    for was, now in zip(before, trainer.network.linear_map(), strict=True):
        assert torch.equal(was, now)
    assert state.model["correction.load"].any()


def test_two_datasets_are_one(
    tiny: Dataset, face: TrainConfig, tmp_path: Path, capsys: pytest.CaptureFixture[str]
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
    pressure, _ = both.load_vertices([STRIDE + 3, 1])
    np.testing.assert_array_equal(pressure[:6], other.load_vertices([3])[0])
    np.testing.assert_array_equal(pressure[6:], tiny.load_vertices([1])[0])
    with pytest.raises(DatasetError, match="twice"):
        open_datasets([second, second])
    run, model = str(tmp_path / "run"), str(tmp_path / "model.onnx")
    settings = ["--network", face.network, "--operator", str(face.operator), "--epochs", "2"]
    assert main(["train", *datasets, "--out", run, *settings, "--threads", "1"]) == 0
    assert main(["export", run, "--onnx", model]) == 0
    assert main(["check", model, *datasets, "--run", run]) == 0
    assert main(["check", model, *datasets[:2]]) == 1
    found = {entry.key: entry.value for entry in onnx.load(model).metadata_props}
    assert found["papilla.dataset_sha256"] == both.dataset_sha256
    assert json.loads(found["papilla.training"])["datasets"] == both.hashes


def test_large_constants_are_stored_small_and_lose_nothing(
    run_dir: Path, tiny: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = export_run(run_dir, tmp_path / "plain.onnx", "tiny")
    monkeypatch.setattr("papilla_trainer.export._LARGE", 16)
    small = export_run(run_dir, tmp_path / "small.onnx", "tiny")
    stored = [i for i in onnx.load(str(small)).graph.initializer if i.name.endswith(".stored")]
    kinds = {i.data_type for i in stored}
    assert kinds == {onnx.TensorProto.FLOAT16, onnx.TensorProto.INT16}
    assert any("stencil" in i.name for i in stored)
    assert small.stat().st_size < plain.stat().st_size
    assert check_model(small, tiny, [run_dir], None).failures == []
    pressure = tiny.load(tiny.test_ids).pressure_pa[0][None, None]
    answers = [
        onnxruntime.InferenceSession(str(path)).run(None, {"pressure_pa": pressure})[0]
        for path in (plain, small)
    ]
    assert np.array_equal(*answers)


def test_a_learning_curve_grows_and_goes_on(
    tiny: Dataset, operator_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_tiny_dataset(tmp_path / "other", seed=9)
    out = tmp_path / "curve"
    arguments = ["curve", "--json", "--dataset", str(tiny.directory), "--judge"]
    arguments += [str(tmp_path / "other"), "--network", "face-r8-n12-h4", "--threads", "1"]
    arguments += ["--operator", str(operator_file), "--epochs", "2", "--out", str(out)]
    arguments += ["--validation-presses", "1", "--presses", "4", "2"]
    assert main(arguments) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [(row["presses"], row["epochs"]) for row in rows[::2]] == [(2, 4), (4, 2)]
    assert {row["judged_on"] for row in rows} == {f"{tiny.directory.name}, held out", "other"}
    small, large = (set(Checkpoint.load(out / f"presses-{n}").splits["fit"]) for n in (2, 4))
    assert small < large
    assert (out / "curve.svg").read_text(encoding="utf-8").count("<path") > 5
    # A second time nothing is trained, and the figures are the same.
    before = (out / "presses-4" / "checkpoint.pt").stat().st_mtime_ns
    assert main(arguments) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == rows
    assert (out / "presses-4" / "checkpoint.pt").stat().st_mtime_ns == before
    # What is trained on does not judge.
    arguments[5] = str(tiny.directory)
    assert main(arguments) == 2
