"""Campaigns and datasets in process: those of `fe-datagen generate`, to the bit; Ctrl-C and going on."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import papilla
from papilla import fe

CAMPAIGN = {
    "name": "three balls", "seed": 3, "presses": 3, "depths_mm": [0.15, 0.3], "test_one_in": 3,
    "density": "coarse", "order": "linear", "effects": ["layers"],
    "indenter": {"shape": "sphere", "radius_mm": 6.0},
    "pose": {"pitch_deg": [0.0, 20.0], "roll_deg": [-10.0, 10.0], "yaw_deg": [0.0, 0.0]},
}  # fmt: skip


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The campaign, its dataset's folder, what the run said, and what it told meanwhile."""
    folder, told = tmp_path_factory.mktemp("campaign") / "out", []
    campaign = fe.Campaign(CAMPAIGN)
    report = campaign.run(folder, threads=2, progress=lambda *words: told.append(words))
    return campaign, folder, report, told


def files(folder):
    """The dataset's files; times of a run are in `progress`."""
    found = [path for part in ("", "shards") for path in sorted((folder / part).iterdir()) if path.is_file()]
    return {path.name: path.read_bytes() for path in found}


def test_the_dataset_is_that_of_the_command_to_the_byte(solved, tmp_path):
    _, folder, report, told = solved
    assert report["dataset"]["samples"] == 6 and report.failed == [] and report.left == 0
    assert told[-1][:2] == (3, 3) and all(due == 3 for _, due, _ in told) and "6 of 6 samples" in str(report)
    lines = [f"{name} = {json.dumps(value)}" for name, value in CAMPAIGN.items() if not isinstance(value, dict)]
    for table in ("indenter", "pose"):
        lines += [f"[{table}]", *(f"{name} = {json.dumps(value)}" for name, value in CAMPAIGN[table].items())]
    (tmp_path / "campaign.toml").write_text("\n".join(lines))
    program = Path(os.environ.get("BIN", "target/debug")) / "fe-datagen"
    command = [program, "generate", tmp_path / "campaign.toml", "--out", tmp_path / "out"]
    subprocess.run(command, check=True, capture_output=True)
    assert files(tmp_path / "out") == files(folder)


def test_explain_is_that_of_the_command():
    path = "campaigns/smoke.toml"
    program = Path(os.environ.get("BIN", "target/debug")) / "fe-datagen"
    told = json.loads(subprocess.run([program, "explain", path, "--json"], check=True, capture_output=True).stdout)
    explained = fe.Campaign(path).explain()
    assert "4 indentations, 8 states" in str(explained)
    # Seconds are measured.
    still = ("campaign", "presses", "states", "memory_bytes", "sed_error", "refused")
    assert {name: explained[name] for name in still} == {name: told[name] for name in still}


def test_states_as_arrays(solved):
    campaign, folder, _, _ = solved
    dataset = campaign.dataset(folder)
    assert len(dataset) == 6 and "6 states of 3 simulations" in repr(dataset)
    held_out, all_ = dataset.ids("test"), dataset.arrays(maps=["pressure_pa", "sed_dermis_j_per_m3", "shear_pa"])
    assert len(held_out) == 1 and sorted(dataset.ids("train") + held_out) == [0, 1, 2]
    assert all_["press"].tolist() == [0, 0, 1, 1, 2, 2] and all_["state"].tolist() == [0, 1] * 3
    np.testing.assert_allclose(all_["depth_mm"], [0.15, 0.3] * 3)
    assert all_["shear_pa"].shape == (6, 3, 224, 224) and not all_["shear_pa"].any()
    # The force of a deeper state is greater, and a map holds what its shard holds.
    assert (np.diff(all_["force_n"][:, 2].reshape(3, 2)) > 0).all() and all_["checks"].shape == (6, 11)
    (press,) = dataset.presses("test")
    assert press.entry["split"] == "test" and press.entry["indenter"] == "sphere"
    assert press.arrays["pressure_pa"].tobytes() == all_["pressure_pa"][all_["press"] == held_out[0]].tobytes()
    # One scene in the pose of the manifest, but for the 11 bits that a dataset keeps.
    scene = {name: CAMPAIGN[name] for name in ("indenter", "effects")} | {
        "geometry": {"kind": "fingertip", "density": "coarse", "order": "linear"},
        "motion": {"depth_mm": 0.3, "increments": 2}
        | {name: press.entry[name] for name in ("pitch_deg", "roll_deg", "yaw_deg")},
    }
    state = fe.Scene(scene).run(fields=False)[-1]
    for name in ("pressure_pa", "sed_dermis_j_per_m3"):
        error = np.linalg.norm(press.arrays[name][-1] - state.maps[name]) / np.linalg.norm(state.maps[name])
        assert error < 1e-3, name


def test_ctrl_c_leaves_what_can_be_gone_on_with(solved, tmp_path):
    campaign, folder, _, _ = solved
    # Interrupts itself once the first simulation is stored, as somebody at the keyboard would.
    program = f"""
import os, signal, threading, time
from pathlib import Path
from papilla import fe
def watch():
    progress = Path({str(tmp_path)!r}) / "progress"
    while not list(progress.glob("press-00000.json")):
        time.sleep(0.02)
    os.kill(os.getpid(), signal.SIGINT)
# What a shell starts in the background ignores it.
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Thread(target=watch, daemon=True).start()
try:
    fe.Campaign({CAMPAIGN!r}).run({str(tmp_path)!r}, threads=1)
except KeyboardInterrupt:
    print("interrupted")
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert run.stdout == "interrupted\n", run.stderr
    assert not (tmp_path / "manifest.json").exists()
    report = campaign.run(tmp_path)
    assert report["slice"]["reused"] >= 1 and report["slice"]["reused"] + report["slice"]["solved"] == 3
    assert files(tmp_path) == files(folder)
    # Nothing is left to do.
    assert campaign.run(tmp_path)["slice"]["reused"] == 3


def test_what_cannot_be_is_said(solved, tmp_path):
    campaign, folder, _, _ = solved
    with pytest.raises(papilla.BadScene, match="presses is 0") as bad:
        fe.Campaign(CAMPAIGN | {"presses": 0})
    assert bad.value.field == "presses"
    with pytest.raises(papilla.BadScene, match="unknown field `press`"):
        fe.Campaign(CAMPAIGN | {"press": 4})
    with pytest.raises(papilla.BadScene, match="is a scene, not a campaign"):
        fe.Campaign("scenes/flat-press.toml")
    with pytest.raises(papilla.BadScene, match="nowhere"):
        fe.Campaign("nowhere.toml")
    other = fe.Campaign(CAMPAIGN | {"seed": 4})
    with pytest.raises(papilla.BadDataset, match="another campaign"):
        other.run(folder)
    with pytest.raises(papilla.BadDataset, match="another campaign, three balls"):
        other.dataset(folder)
    with pytest.raises(papilla.BadDataset, match="manifest"):
        fe.Dataset(tmp_path)
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(papilla.BadDataset, match="file"):
        campaign.run(tmp_path / "file")
    with pytest.raises(papilla.BadInput, match="3/2"):
        campaign.run(tmp_path / "slice", slice=(3, 2))
    with pytest.raises(papilla.BadInput, match="at least one"):
        campaign.run(tmp_path / "slice", threads=0)
    assert not (tmp_path / "slice").exists()
    dataset = fe.Dataset(folder)
    with pytest.raises(papilla.BadInput, match="no simulation 7"):
        dataset.press(7)
    with pytest.raises(papilla.BadInput, match="there is no map 'sed'"):
        dataset.press(0, ["sed"])
    with pytest.raises(papilla.BadInput, match="'train' and 'test'"):
        dataset.ids("validation")
    # Of an altered file the hash tells.
    shard = tmp_path / "damaged"
    subprocess.run(["cp", "-r", folder, shard], check=True)
    path = shard / "shards/press-00001.npz"
    path.write_bytes(path.read_bytes()[:-1] + b"!")
    with pytest.raises(papilla.BadDataset, match="sha256"):
        fe.Dataset(shard).arrays()
