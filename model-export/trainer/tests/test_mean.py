"""The mean of two runs as one model."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.cli import main
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.mean import MeanModel, correction, mean_record
from papilla_trainer.serving import predict, served_model
from papilla_trainer.training import Trainer


@pytest.fixture(scope="module")
def runs(
    tiny: Dataset, run_dir: Path, config: TrainConfig, tmp_path_factory: pytest.TempPathFactory
) -> list[Path]:
    other = tmp_path_factory.mktemp("other")
    Trainer(tiny, replace(config, network="map-c2-k3-r4", seed=3), other).fit()
    return [run_dir, other]


def test_a_mean_lies_half_way_between_its_networks(
    runs: list[Path], tiny: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made, data = tmp_path / "mean.onnx", ["--dataset", str(tiny.directory), "--json"]
    folders = [str(run) for run in runs]
    assert main(["mean", *folders, "--onnx", str(made), *data]) == 0
    assert json.loads(capsys.readouterr().out)["bytes"] == made.stat().st_size
    pressure = tiny.load(tiny.test_ids).pressure_pa
    first, second = (predict(served_model(Checkpoint.load(run)), pressure) for run in runs)
    assert np.abs(first - second).max() > 0.01 * first.max()
    session = onnxruntime.InferenceSession(str(made), providers=["CPUExecutionProvider"])
    for p, expected in zip(pressure, (first + second) / 2, strict=True):
        (output,) = session.run(["sed_j_per_m3"], {"pressure_pa": p[None, None]})
        assert np.abs(output[0, 0] - expected).max() <= 1e-5 * expected.max()
    props = {entry.key: entry.value for entry in onnx.load(str(made)).metadata_props}
    assert json.loads(props["papilla.network"])["kind"] == "mean"
    assert [run["seed"] for run in json.loads(props["papilla.training"])["mean_of"]] == [7, 3]
    both = [argument for folder in folders for argument in ("--run", folder)]
    assert main(["check", str(made), *both, *data]) == 0
    assert main(["check", str(made), *both[:2], *data]) == 1


def test_a_finer_mesh_puts_a_mean_right_by_one_factor(
    runs: list[Path], tiny: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made, folder = tmp_path / "mean.onnx", str(tiny.directory)
    folders, data = [str(run) for run in runs], ["--dataset", folder]
    assert main(["mean", *folders, "--onnx", str(made), *data, "--finer", folder, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["finer"]
    factor, models = found["factor"], [served_model(Checkpoint.load(run)) for run in runs]
    right = correction(MeanModel(models, factor).eval(), tiny)
    assert right.factor == pytest.approx(1.0, rel=1e-5)
    half = correction(MeanModel(models, 0.5).eval(), tiny)
    assert half.factor == pytest.approx(2 * factor)
    # Whatever the mean is multiplied by before, it ends at the same answers.
    assert half.relative_l2_corrected == pytest.approx(found["relative_l2_corrected"])
    assert right.relative_l2_plain["median"] < half.relative_l2_plain["median"]
    props = {entry.key: entry.value for entry in onnx.load(str(made)).metadata_props}
    assert json.loads(props["papilla.training"])["finer"] == found
    assert found["dataset_sha256"] == tiny.dataset_sha256
    both = [argument for run in folders for argument in ("--run", run)]
    assert main(["check", str(made), *both, *data]) == 0


def test_a_mean_is_of_several_runs_of_the_same_dataset(
    runs: list[Path], shipped: Dataset, tiny: Dataset, tmp_path: Path
) -> None:
    made = ["--onnx", str(tmp_path / "mean.onnx"), "--dataset"]
    assert main(["mean", str(runs[0]), *made, str(tiny.directory)]) == 4
    assert main(["mean", *map(str, runs), *made, str(shipped.directory)]) == 4


def test_a_mean_knows_the_pressure_of_contact_if_all_of_its_networks_do() -> None:
    knows, other = {"seed": 1, "contact": ["a.npz"]}, {"seed": 2}
    assert mean_record([knows, knows])["contact"] == ["a.npz"]
    assert "contact" not in mean_record([knows, other])
