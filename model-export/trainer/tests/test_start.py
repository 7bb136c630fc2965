"""Training that goes on from an exported network."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import onnx
import onnxruntime
import pytest
import torch
from conftest import REPOSITORY

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.cli import main
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import RunError, UsageError
from papilla_trainer.export import export_run
from papilla_trainer.map_network import MapNet
from papilla_trainer.start import Start
from papilla_trainer.tasks import fresh_network
from papilla_trainer.training import Trainer

MODELS = REPOSITORY / "models"
CONFIG = TrainConfig(
    network="map-c2-k3-r4-h2",
    epochs=4,
    seed=5,
    batch=2,
    threads=1,
    device="cpu",
    learning_rate=1e-2,
)


@pytest.fixture(scope="module")
def exported(tiny: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A network on maps, trained for a moment; its run lies beside it."""
    folder = tmp_path_factory.mktemp("start")
    Trainer(tiny, CONFIG, folder / "run").fit()
    return export_run(folder / "run", folder / "first.onnx")


@pytest.mark.parametrize("name", ["nano", "small", "large"])
@torch.no_grad()
def test_shipped_networks_answer_as_their_files(name: str) -> None:
    path = MODELS / f"{name}.onnx"
    start = Start.read(path)
    card = json.loads((MODELS / f"{name}.json").read_text())
    assert start.record() == {"name": name, "onnx_sha256": card["onnx_sha256"]}
    network = MapNet(start.spec)
    start.give(network, start.spec.name)
    pressure = torch.zeros(1, 1, 224, 224)
    pressure[0, 0, 100:121, 90:117] = 2e4
    session = onnxruntime.InferenceSession(path)
    (due,) = session.run(None, {"pressure_pa": pressure.numpy()})
    due = torch.from_numpy(due)
    shown = due > 0.0
    assert shown.sum() > 1000
    found = network(pressure)
    assert ((found - due)[shown].abs().max() / due.max()).item() < 1e-5


def test_weights_come_back_as_they_were(exported: Path) -> None:
    run = Checkpoint.load(exported.parent / "run")
    weights = Start.read(exported).weights
    assert weights.keys() == run.best_model.keys()
    for name, weight in weights.items():
        torch.testing.assert_close(weight, run.best_model[name], rtol=1e-6, atol=0.0)


def test_a_run_begins_with_the_weights_of_the_model(
    tiny: Dataset, exported: Path, tmp_path: Path
) -> None:
    start = Start.read(exported)
    config = replace(CONFIG, start=start.record(), epochs=1)
    begun = Trainer(tiny, config, tmp_path / "on", start=start)
    random = fresh_network(config.spec, config.seed).state_dict()
    reach = begun.state.model["reach_in"]
    torch.testing.assert_close(reach, start.weights["reach_in"])
    assert not torch.equal(reach, random["reach_in"])
    on, anew = begun.fit(), Trainer(tiny, replace(CONFIG, epochs=1), tmp_path / "anew").fit()
    assert on.history[0]["train_loss"] < 0.9 * anew.history[0]["train_loss"]


def test_the_command_names_the_model_it_began_from(
    tiny: Dataset, exported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ["--dataset", str(tiny.directory), "--out", str(tmp_path / "run"), "--epochs", "2"]
    common += ["--batch", "2", "--threads", "1", "--device", "cpu"]
    began = ["train", *common, "--start", str(exported)]
    assert main(began) == 0
    model = export_run(tmp_path / "run", tmp_path / "next.onnx")
    metadata = {p.key: p.value for p in onnx.load(model).metadata_props}
    training = json.loads(metadata["papilla.training"])
    assert training["start"] == Start.read(exported).record()
    assert json.loads(metadata["papilla.network"])["rank"] == 4
    capsys.readouterr()
    # The same run from random weights, or from others, is another one.
    assert main(["train", *common, "--network", CONFIG.network, "--resume"]) == RunError.exit_code
    assert "start was" in capsys.readouterr().err
    assert main([*began, "--resume"]) == 0


@pytest.mark.parametrize(
    ("name", "kind"),
    [("s1-base16", "'s1_unet'"), ("half-space", "'half_space'"), ("large-maps", "'mean'")],
)
def test_other_kinds_are_refused_by_name(name: str, kind: str) -> None:
    with pytest.raises(UsageError, match=f"{name}.onnx: it is of the kind {kind}"):
        Start.read(MODELS / f"{name}.onnx")


def test_another_architecture_is_refused_by_name(
    tiny: Dataset, exported: Path, tmp_path: Path
) -> None:
    start = Start.read(exported)
    config = replace(CONFIG, network="map-c3-k3-r4-h2", start=start.record())
    with pytest.raises(UsageError, match="it is a map-c2-k3-r4-h2, and --network asks for map-c3"):
        Trainer(tiny, config, tmp_path / "run", start=start)
    assert not (tmp_path / "run").exists()


def test_damaged_files_are_refused(exported: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read"):
        Start.read(tmp_path / "absent.onnx")
    (tmp_path / "text.onnx").write_text("no model")
    with pytest.raises(UsageError, match="not an ONNX file"):
        Start.read(tmp_path / "text.onnx")
    model = onnx.load(exported)
    kept = [i for i in model.graph.initializer if not i.name.endswith("levels.1.near")]
    del model.graph.initializer[:]
    model.graph.initializer.extend(kept)
    onnx.save(model, tmp_path / "lacking.onnx")
    with pytest.raises(UsageError, match=r"levels\.1\.near"):
        Start.read(tmp_path / "lacking.onnx")
