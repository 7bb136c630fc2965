from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from tiny_dataset import write_tiny_dataset

from papilla_trainer.check import check_model
from papilla_trainer.checkpoint import Checkpoint, Served
from papilla_trainer.dataset import Dataset
from papilla_trainer.errors import DatasetError
from papilla_trainer.export import export_run, properties
from papilla_trainer.joined import JoinedDataset
from papilla_trainer.serving import predict, served_model


@pytest.fixture(scope="module")
def model(run_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_run(run_dir, tmp_path_factory.mktemp("models") / "tiny.onnx")


def run_onnx(model: Path, pressure_pa: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(str(model), providers=["CPUExecutionProvider"])
    (output,) = session.run(["sed_j_per_m3"], {"pressure_pa": pressure_pa[None, None]})
    return np.asarray(output)[0, 0]


def test_onnx_equals_the_trained_network(model: Path, tiny: Dataset, finished: Checkpoint) -> None:
    pressure = tiny.load(tiny.test_ids).pressure_pa
    expected = predict(served_model(finished), pressure)
    assert expected.max() > 0.05 * tiny.sed_max_j_per_m3
    for p, e in zip(pressure, expected, strict=True):
        assert np.abs(run_onnx(model, p) - e).max() <= 1e-5 * expected.max()


def test_units_are_physical(model: Path, tiny: Dataset, finished: Checkpoint) -> None:
    """The graph scales itself: Pa in, J/m3 out, whatever the network's own range."""
    pressure = tiny.load(tiny.test_ids).pressure_pa[-1]
    network = served_model(finished).network
    with torch.no_grad():
        scaled = torch.from_numpy(pressure / np.float32(tiny.pressure_max_pa))[None, None]
        bare = network(scaled)[0, 0].numpy() * tiny.sed_max_j_per_m3
    expected = np.clip(bare, 0, None) * tiny.mask()
    assert np.abs(run_onnx(model, pressure) - expected).max() <= 1e-5 * expected.max()


def test_output_is_not_negative_and_zero_outside(model: Path, tiny: Dataset) -> None:
    for pressure in (np.zeros((224, 224), np.float32), tiny.load([0]).pressure_pa[0]):
        output = run_onnx(model, pressure)
        assert output.min() >= 0
        assert not output[tiny.mask() == 0].any()
        # The biases' residue is blanked where there is no pressure at all, and only there.
        assert output.any() == pressure.any()


def test_metadata_say_where_the_model_comes_from(model: Path, tiny: Dataset) -> None:
    found = {entry.key: entry.value for entry in onnx.load(str(model)).metadata_props}
    assert found["papilla.format"] == "1"
    assert found["papilla.name"] == "tiny"
    assert found["papilla.atlas_hash"] == tiny.atlas_hash
    assert found["papilla.dataset_sha256"] == tiny.dataset_sha256
    assert json.loads(found["papilla.effects"]) == ["finite_strain", "layers"]
    assert json.loads(found["papilla.network"]) == {"kind": "s1_unet", "base": 4}
    assert float(found["papilla.pressure_max_pa"]) == tiny.pressure_max_pa
    assert float(found["papilla.sed_max_j_per_m3"]) == tiny.sed_max_j_per_m3
    assert json.loads(found["papilla.training"])["seed"] == 7


def test_export_is_reproducible_and_holds_no_path(
    model: Path, run_dir: Path, tmp_path: Path
) -> None:
    again = export_run(run_dir, tmp_path / "tiny.onnx")
    assert again.read_bytes() == model.read_bytes()
    assert str(Path(__file__).resolve().parents[1]).encode() not in model.read_bytes()


def test_check_passes_and_writes_the_reference(
    model: Path, tiny: Dataset, run_dir: Path, tmp_path: Path
) -> None:
    report = check_model(model, tiny, [run_dir], tmp_path / "reference.npz")
    assert report.failures == []
    assert report.torch_difference_max is not None
    with np.load(tmp_path / "reference.npz") as arrays:
        pressure, sed = arrays["pressure_pa"], arrays["sed_j_per_m3"]
    assert pressure.shape == sed.shape == (report.samples, 224, 224)
    np.testing.assert_allclose(run_onnx(model, pressure[0]), sed[0], atol=1e-5 * sed.max())


def test_check_finds_what_is_wrong(
    model: Path, tiny: Dataset, run_dir: Path, tmp_path: Path
) -> None:
    graph = onnx.load(str(model))
    properties = {entry.key: entry.value for entry in graph.metadata_props}
    onnx.helper.set_model_props(graph, {**properties, "papilla.atlas_hash": "0" * 64})
    onnx.save(graph, str(tmp_path / "atlas.onnx"))
    assert "atlas_hash" in check_model(tmp_path / "atlas.onnx", tiny, [], None).failures[0]

    graph = onnx.load(str(model))
    head = next(t for t in graph.graph.initializer if t.name.endswith("head.bias"))
    head.CopyFrom(onnx.numpy_helper.from_array(onnx.numpy_helper.to_array(head) + 0.5, head.name))
    onnx.save(graph, str(tmp_path / "weights.onnx"))
    assert check_model(tmp_path / "weights.onnx", tiny, [], None).failures == []
    assert "differ" in check_model(tmp_path / "weights.onnx", tiny, [run_dir], None).failures[0]

    graph = onnx.load(str(model))
    graph.graph.node[-1].op_type = "Div"
    onnx.save(graph, str(tmp_path / "operator.onnx"))
    assert "Div" in check_model(tmp_path / "operator.onnx", tiny, [], None).failures[0]


def test_a_network_says_whose_finger_it_learnt(finished: Checkpoint, tmp_path: Path) -> None:
    folders = [write_tiny_dataset(tmp_path / f"{seed}", seed=seed) for seed in (1, 2)]
    assert Dataset(folders[0]).finger_sha256 is None
    manifest = json.loads((folders[1] / "manifest.json").read_text())
    manifest["campaign"]["finger_sha256"] = "f" * 64
    (folders[1] / "manifest.json").write_text(json.dumps(manifest))
    own = Dataset(folders[1])
    assert own.finger_sha256 == "f" * 64
    with pytest.raises(DatasetError, match="another finger"):
        JoinedDataset([Dataset(folders[0]), own])

    def trained(served: Served) -> dict[str, object]:
        said = properties(served, "tiny", {}, {"seed": 0})["papilla.training"]
        return dict(json.loads(said))

    assert "finger_sha256" not in trained(finished.served)
    served = dataclasses.replace(finished.served, finger_sha256=own.finger_sha256)
    assert trained(served)["finger_sha256"] == "f" * 64
