"""Shared fixtures: a tiny made-up dataset, a short finished run, and the shipped dataset."""

from __future__ import annotations

from pathlib import Path

import pytest
from tiny_dataset import write_tiny_dataset, write_tiny_operator

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.evaluation import evaluate_run
from papilla_trainer.training import Trainer

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Six indentations of six depths; not physics."""
    return Dataset(write_tiny_dataset(tmp_path_factory.mktemp("tiny") / "dataset"))


@pytest.fixture(scope="session")
def operator_file(tiny: Dataset) -> Path:
    """A made-up linear operator of the tiny dataset's atlas."""
    return write_tiny_operator(tiny.directory)


@pytest.fixture(scope="session")
def config() -> TrainConfig:
    """A training of a second or two."""
    return TrainConfig(network="s1-base4", epochs=5, seed=7, batch=1, threads=1, device="cpu")


@pytest.fixture(scope="session")
def run_dir(tiny: Dataset, config: TrainConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished, measured, uninterrupted run on the tiny dataset."""
    directory = tmp_path_factory.mktemp("run") / "straight"
    Trainer(tiny, config, directory).fit()
    evaluate_run(directory, tiny)
    return directory


@pytest.fixture(scope="session")
def finished(run_dir: Path) -> Checkpoint:
    """The checkpoint of that run."""
    return Checkpoint.load(run_dir)


@pytest.fixture(scope="session")
def shipped() -> Dataset:
    """The finite-element dataset that the repository ships."""
    manifests = sorted((REPOSITORY / "data").glob("*/manifest.json"))
    assert manifests, "no dataset under data/"
    return Dataset(manifests[0].parent)
