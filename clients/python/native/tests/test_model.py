"""SED of maps and batches in process."""

import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import papilla
from papilla.model import folder


@pytest.fixture(scope="module")
def model():
    return papilla.Model("nano")


def test_a_batch_is_its_maps_on_any_number_of_threads(model, pressure_pa):
    batch = np.stack([pressure_pa * share for share in (0.0, 0.2, 0.5, 1.0, 40.0)])
    singly = np.stack([model.sed(each) for each in batch])
    for threads in (1, 3):
        assert model.sed(batch, threads=threads).tobytes() == singly.tobytes()
    rendered = model.render(batch.astype(np.float64)[:, ::1])
    assert rendered.sed.tobytes() == singly.tobytes()
    assert rendered.flagged("no_contact").tolist() == [True, False, False, False, False]
    assert rendered.flagged("out_of_range").tolist() == [False, False, False, False, True]
    assert model.sed(batch[:0]).shape == (0, 224, 224)


def test_strided_maps_are_read_as_they_lie(model, pressure_pa):
    wide = np.zeros((224, 448), np.float32)
    wide[:, ::2] = pressure_pa
    assert np.array_equal(model.sed(wide[:, ::2]), model.sed(pressure_pa))


def test_bad_input_is_named(model, pressure_pa):
    bad = np.stack([pressure_pa, pressure_pa])
    bad[1, 5, 7] = np.inf
    with pytest.raises(papilla.BadInput, match=r"frame 1: .*row 5, column 7") as refused:
        model.sed(bad)
    assert refused.value.frame == 1
    with pytest.raises(papilla.BadInput, match="224 x 224"):
        model.sed(np.zeros((8, 8)))
    with pytest.raises(papilla.BadInput, match="due"):
        model.sed(np.zeros((2, 8, 8)))
    with pytest.raises(papilla.BadInput, match="real numbers"):
        model.sed(np.full((224, 224), "x"))
    with pytest.raises(papilla.BadInput, match="threads"):
        model.sed(pressure_pa, threads=0)
    with pytest.raises(papilla.BadInput, match="unit='kPa'"):
        model.sed(1e-3 * pressure_pa)
    with pytest.raises(papilla.BadInput, match="masked"):
        model.sed(np.ma.masked_less(pressure_pa, 1.0))
    np.testing.assert_allclose(model.sed(1e-3 * pressure_pa, unit="kPa"), model.sed(pressure_pa), rtol=1e-4, atol=1e-4)
    assert np.array_equal(model.sed(pressure_pa), model.sed(pressure_pa))


def test_the_short_call_needs_no_service(model, pressure_pa):
    assert np.array_equal(papilla.sed(pressure_pa, url="local", tier="nano"), model.sed(pressure_pa))
    for member in ("finger", "budget_us"):
        with pytest.raises(papilla.BadInput, match=f"{member}: a service has it"):
            papilla.sed(pressure_pa, url="local", **{member: 1})


def test_calls_in_this_process_read_a_network_once(monkeypatch, tmp_path, pressure_pa):
    for file in folder(None).iterdir():
        if file.name == "index.json":
            (tmp_path / file.name).write_bytes(file.read_bytes())
        else:
            (tmp_path / file.name).symlink_to(file.absolute())
    monkeypatch.setenv("PAPILLA_MODELS", str(tmp_path))
    made, read = papilla.Model.__init__, []

    def counted(self, tier=None, **more):
        read.append(tier)
        made(self, tier, **more)

    monkeypatch.setattr(papilla.Model, "__init__", counted)
    frames = np.stack([pressure_pa, 0.5 * pressure_pa])
    first = papilla.render(frames, url="local", tier="nano").sed
    for lanes in (1, 2):
        assert np.array_equal(papilla.render(frames, url="local", tier="nano", lanes=lanes).sed, first)
    assert np.array_equal(papilla.sed(pressure_pa, url="local", tier="nano"), first[0])
    assert read == ["nano"]
    ball = {"shape": {"shape": "sphere", "radius_mm": 8.0}}
    for _ in range(2):
        papilla.render([[[11.25, 0, -14.2, 0, 0, 0, 1]]], url="local", input="objects", objects=[ball])
    assert read == ["nano", None]
    # Networks that were trained anew are not mistaken for the old ones.
    index = tmp_path / "index.json"
    os.utime(index, ns=(0, index.stat().st_mtime_ns + 1_000_000))
    papilla.sed(pressure_pa, url="local", tier="nano")
    assert read == ["nano", None, "nano"]


def test_bad_folders_are_named(tmp_path):
    with pytest.raises(papilla.BadModels, match=r"index\.json"):
        papilla.Model(models=tmp_path)
    with pytest.raises(papilla.BadModels, match=r"lists .*nano"):
        papilla.Model("none")


def test_other_threads_of_python_go_on(model, pressure_pa):
    batch = np.repeat(pressure_pa[None], 60, axis=0)
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    beside = threading.Thread(target=tick)
    beside.start()
    model.sed(batch, threads=1)
    done.set()
    beside.join()
    assert len(ticks) > 5


def test_ctrl_c_ends_a_batch(interrupted):
    program = """
import numpy as np, papilla
model = papilla.Model("small")
batch = np.zeros((600, 224, 224), np.float32)
batch[:, 95:115, 105:130] = 8e3
print("ready", flush=True)
try:
    model.sed(batch)
except KeyboardInterrupt:
    print("interrupted")
"""
    assert interrupted(program, 1.0) == "interrupted\n"


def test_import_is_quick_and_the_client_works_without_the_native_module():
    program = """
import sys
sys.modules["papilla._native"] = None
import papilla
papilla.Session, papilla.Model, papilla.local
try:
    papilla.Model("nano")
except papilla.NativeMissing as error:
    print("clients/python/wheel" in str(error))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_the_service_is_a_command():
    beside = os.path.join(os.path.dirname(sys.executable), "papilla-server")
    done = subprocess.run([beside, "--version"], capture_output=True, text=True, check=True)
    assert papilla.model.native().__version__ in done.stdout
