"""Shared fixtures: a tiny made-up dataset, a short finished run, and a shipped dataset.

Maps of shipped datasets are drawn by the real fe-datagen: FE_DATAGEN names it, else it is the one
that `cargo build` left in target.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from tiny_dataset import write_tiny_dataset, write_tiny_operator

from papilla_trainer.checkpoint import Checkpoint
from papilla_trainer.config import TrainConfig
from papilla_trainer.dataset import Dataset
from papilla_trainer.maps import FOLDER_VARIABLE, PROGRAM_VARIABLE
from papilla_trainer.training import Trainer

REPOSITORY = Path(__file__).resolve().parents[3]


def program(name: str) -> str:
    """A program of this repository that is built."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
    built = [target / profile / name for profile in ("release", "debug")]
    found = sorted((p for p in built if p.is_file()), key=lambda p: p.stat().st_mtime)
    assert found, f"no {name} in {target}: cargo build --bin {name}"
    return str(found[-1])


@pytest.fixture(scope="session", autouse=True)
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where the tests' maps are kept, in place of the user's cache."""
    folder = tmp_path_factory.mktemp("store")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(folder))
        if PROGRAM_VARIABLE not in os.environ:
            patch.setenv(PROGRAM_VARIABLE, program("fe-datagen"))
        yield folder


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
    """A finished, uninterrupted run on the tiny dataset."""
    directory = tmp_path_factory.mktemp("run") / "straight"
    Trainer(tiny, config, directory).fit()
    return directory


@pytest.fixture(scope="session")
def finished(run_dir: Path) -> Checkpoint:
    """The checkpoint of that run."""
    return Checkpoint.load(run_dir)


@pytest.fixture(scope="session")
def shipped() -> Dataset:
    """A small one of the finite-element datasets that the repository ships."""
    return Dataset(REPOSITORY / "data" / "final-anew")
