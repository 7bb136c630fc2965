from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from papilla_trainer.cli import main
from papilla_trainer.dataset import Dataset


def test_from_dataset_to_checked_onnx(
    tiny: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, run, model = str(tiny.directory), tmp_path / "run", tmp_path / "s1-base4.onnx"
    command = ["train", "--dataset", data, "--network", "s1-base4", "--out", str(run)]
    assert main([*command, "--epochs", "3", "--batch", "1", "--threads", "1", "--json"]) == 0
    trained = json.loads(capsys.readouterr().out)
    assert trained["epochs"] == 3
    assert trained["train_loss"] > 0
    assert trained["samples_per_s"] > 0
    assert {p.name for p in run.iterdir()} == {
        *("checkpoint.pt", "history.csv", "loss.png"),
    }
    assert (run / "loss.png").read_bytes().startswith(b"\x89PNG")
    assert len((run / "history.csv").read_text().splitlines()) == 4

    assert main(["export", str(run), "--onnx", str(model)]) == 0
    capsys.readouterr()
    assert main(["check", str(model), "--dataset", data, "--run", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["failures"] == []


def test_exit_codes(
    tiny: Dataset, run_dir: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = str(tiny.directory)
    out = ["--out", str(tmp_path / "run")]
    assert main(["train", "--dataset", data, "--network", "resnet", *out]) == 2
    assert main(["train", "--dataset", str(tmp_path / "none"), *out, "--json"]) == 3
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["code"] == "bad_dataset"
    assert "fe-datagen generate" in error["message"]
    assert main(["train", "--dataset", data, "--out", str(run_dir)]) == 4
    assert main(["export", str(tmp_path / "none"), "--onnx", str(tmp_path / "m.onnx")]) == 4
    (tmp_path / "broken.onnx").write_bytes(b"not a model")
    assert main(["check", str(tmp_path / "broken.onnx"), "--dataset", data]) == 1
    with pytest.raises(SystemExit) as stopped:
        main(["train"])
    assert stopped.value.code == 2


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ([], ["train"], ["export"], ["check"]):
        with pytest.raises(SystemExit) as stopped:
            main([*command, "--help"])
        assert stopped.value.code == 0
        assert "exit codes" in capsys.readouterr().out


def test_out_is_a_folder_everywhere(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("train", "curve", "export", "operator", "half-space"):
        with pytest.raises(SystemExit):
            main([command, "--help"])
        shown = capsys.readouterr().out
        # Named in capitals; "the --out of train" is no option of its own.
        assert set(re.findall(r"--out ([A-Z][A-Z_.]*)", shown)) <= {"RUN_DIR", "DIR"}, command
