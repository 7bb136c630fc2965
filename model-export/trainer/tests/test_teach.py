"""`fe-datagen finger teach`, from a finger's file to networks of it: coarse, tiny and real."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import REPOSITORY, program

# A plate and a ball on the coarse even mesh, which takes seconds.
CAMPAIGN = """
name = "tiny"
seed = 5
presses = 10
test_one_in = 5
density = "coarse"
order = "linear"
effects = ["layers"]
depths_mm = [0.1, 0.2]

[pose]
pitch_deg = [0.0, 20.0]
roll_deg = [-10.0, 10.0]
yaw_deg = [0.0, 0.0]

[[indenters]]
name = "plate"
indenter = { shape = "plate", size_mm = [20.0, 20.0], edge_radius_mm = 1.0 }

[[indenters]]
name = "ball"
indenter = { shape = "sphere", radius_mm = 6.0 }
"""


def command(folder: Path, *arguments: str) -> list[str]:
    return [
        *(os.environ["FE_DATAGEN"], "finger", "teach", str(folder)),
        *("--campaign", str(folder.parent / "tiny.toml"), "--from", str(REPOSITORY / "models")),
        *("--without-contact", "--network", "nano", "--epochs", "20", "--threads", "1"),
        *arguments,
    ]


def environment(**changes: str) -> dict[str, str]:
    own = {
        "PYTHON": sys.executable,
        "MODEL_EXPORT": os.environ.get("MODEL_EXPORT") or program("model-export"),
        "PYTHONPATH": str(REPOSITORY / "model-export/trainer"),
    }
    return {**os.environ, **own, **changes}


def teach(folder: Path, *arguments: str, **changes: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(folder, *arguments),
        capture_output=True,
        text=True,
        check=False,
        env=environment(**changes),
    )


def refused(folder: Path, *arguments: str, **changes: str) -> str:
    done = teach(folder, *arguments, **changes)
    assert done.returncode in (1, 2), done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def finger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finger that is narrower and flatter than the default one."""
    folder = tmp_path_factory.mktemp("fingers") / "mine"
    made = [os.environ["FE_DATAGEN"], "finger", "new", "--out", str(folder)]
    subprocess.run(made, check=True, capture_output=True)
    file = folder / "finger.toml"
    text = file.read_text()
    for key, value in (("width_mm", "16.0"), ("height_mm", "12.0"), ("dermis_mm", "0.8")):
        text, count = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
        assert count == 1
    file.write_text(text)
    (folder.parent / "tiny.toml").write_text(CAMPAIGN)
    return folder


def shards(folder: Path) -> dict[str, int]:
    """When each shard was written."""
    found = (folder / "teach/presses/shards").glob("*.npz")
    return {path.name: path.stat().st_mtime_ns for path in found}


def test_what_cannot_be_done_is_refused_before_anything_is_solved(
    finger: Path, tmp_path: Path
) -> None:
    assert "--hours 4" in refused(finger)
    assert "at least 5" in refused(finger, "--presses", "3")
    assert "at most 1000" in refused(finger, "--presses", "2000")
    assert "above 0" in refused(finger, "--hours", "0")
    assert "core hours" in refused(finger, "--hours", "1e-5")
    assert "there is no" in refused(finger, "--presses", "5", "--network", "tiny")
    assert "'mean'" in refused(finger, "--presses", "5", "--network", "large-maps")
    absent = refused(finger, "--presses", "5", PYTHON="/no/python")
    assert "/no/python cannot be run" in absent
    assert "training.md" in absent
    assert "MODEL_EXPORT" in refused(finger, "--presses", "5", MODEL_EXPORT="/no/program")
    assert "no finger" in refused(tmp_path, "--presses", "5") or "finger.toml" in refused(
        tmp_path, "--presses", "5"
    )
    assert not (finger / "teach/presses").exists()
    assert not (finger / "teach/campaign.toml").exists()


def test_a_finger_gets_a_network_of_its_own(finger: Path) -> None:
    planned = teach(finger, "--presses", "5", "--plan", "--json")
    assert planned.returncode == 0, planned.stderr
    plan = json.loads(planned.stdout)
    assert (plan["presses"], plan["states"], plan["held_out"], plan["solved"]) == (5, 10, 1, 0)
    assert plan["press_hours"] > 0.0
    assert not (finger / "teach/presses").exists()

    # Asked to leave while it solves: what is solved stays, and nothing half-written is left.
    with subprocess.Popen(
        command(finger, "--presses", "5"), env=environment(), stderr=subprocess.DEVNULL
    ) as begun:
        while not shards(finger) and begun.poll() is None:
            time.sleep(0.02)
        begun.send_signal(signal.SIGINT)
        assert begun.wait(60) == 130
    solved = shards(finger)
    assert 1 <= len(solved) < 5
    assert not (finger / "nano.onnx").exists()

    done = teach(finger, "--presses", "5", "--json")
    assert done.returncode == 0, done.stderr
    assert "1 are solved already" in done.stderr or len(solved) > 1
    report = json.loads(done.stdout)
    assert json.loads((finger / "teach/report.json").read_text()) == report
    assert shards(finger).items() >= solved.items()
    assert (report["presses"], report["held_out"], report["held_out_states"]) == (5, 1, 2)
    (network,) = report["networks"]
    before, after = (network[when]["pressure_to_sed"]["median"] for when in ("before", "after"))
    # The coarse even mesh makes SED half wrong, so the shipped network is far off: it has learnt.
    assert after < 0.8 * before
    assert network["before"]["pose_to_sed"] is None

    shipped = json.loads((REPOSITORY / "models/nano.json").read_text())
    card = json.loads((finger / "nano.json").read_text())
    atlas = json.loads((finger / "teach/presses/manifest.json").read_text())["atlas_hash"]
    assert card["atlas_hash"] == atlas != shipped["atlas_hash"]
    assert card["training"]["finger_sha256"] == report["finger_sha256"]
    assert card["training"]["start"]["onnx_sha256"] == shipped["onnx_sha256"]
    assert card["metrics"]["relative_l2"]["median"] == pytest.approx(after)
    assert card["pattern_max"]["load_mpa_px"] > 0.0
    index = json.loads((finger / "index.json").read_text())
    assert (index["default"], index["models"]) == ("nano", ["nano"])
    replay = json.loads((finger / "replay.json").read_text())
    assert (replay["atlas_hash"], len(replay["presses"])) == (atlas, 1)
    assert not list(finger.rglob("*.partial")) + list(finger.rglob("*.part"))


def test_more_presses_keep_those_that_are_solved(finger: Path) -> None:
    first = shards(finger)
    weights = (finger / "nano.onnx").read_bytes()
    done = teach(finger, "--presses", "6", "--json")
    assert done.returncode == 0, done.stderr
    later = shards(finger)
    assert len(later) == 6
    assert later.items() >= first.items()
    assert (finger / "nano.onnx").read_bytes() != weights
    report = json.loads(done.stdout)
    # What is left of a five is learnt from.
    assert (report["presses"], report["held_out"]) == (6, 1)
    assert "give 6 or more" in refused(finger, "--presses", "5")


def test_a_changed_finger_or_a_stranger_is_refused(finger: Path) -> None:
    stranger = finger / "small.onnx"
    stranger.write_bytes((REPOSITORY / "models/small.onnx").read_bytes())
    (finger / "small.json").write_bytes((REPOSITORY / "models/small.json").read_bytes())
    assert "add --network small" in refused(finger)
    stranger.unlink()
    (finger / "small.json").unlink()
    file = finger / "finger.toml"
    text = file.read_text()
    file.write_text(text.replace("width_mm = 16.0", "width_mm = 16.5"))
    before = shards(finger)
    assert "move the folder away" in refused(finger)
    assert shards(finger) == before
    file.write_text(text)
