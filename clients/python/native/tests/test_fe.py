"""Finite elements in process: the states of `fe-datagen`, to the bit; errors with fields; Ctrl-C."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import papilla
from papilla import fe

BLOCK = {
    "geometry": {"kind": "block", "size_mm": [6.0, 6.0], "elements": [4, 4],
                 "layers": [{"tissue": "dermis", "thickness_mm": 2.0, "elements": 2}]},
    "indenter": {"shape": "sphere", "radius_mm": 4.0},
    "motion": {"depth_mm": 0.3, "increments": 2},
}  # fmt: skip
FINGER = """
effects = ["finite_strain", "layers"]
[geometry]
kind = "fingertip"
density = "coarse"
order = "linear"
[indenter]
shape = "sphere"
radius_mm = 5.0
[motion]
depth_mm = 0.8
increments = 2
"""


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """Solves a scene by the command line; gives the folder of its results."""
    program = Path(os.environ.get("BIN", "target/debug")) / "fe-datagen"

    def solve(text):
        folder = tmp_path_factory.mktemp("fe")
        (folder / "scene.toml").write_text(text)
        out = folder / "out"
        command = [program, "solve", folder / "scene.toml", "--out", out, "--json"]
        # 3: a check of a state failed, which is told of.
        assert subprocess.run(command, capture_output=True, check=False).returncode in (0, 3)
        return out

    return solve


def test_states_of_a_finger_are_those_of_the_command_to_the_bit(command, tmp_path):
    out = command(FINGER)
    told = []
    states = fe.Scene(FINGER).run(progress=lambda *words: told.append(words))
    assert len(states) == 2 and told[0][:2] == (0, 2) and told[-1][:2] == (2, 2)
    with np.load(out / "maps.npz") as maps:
        for name in ("pressure_pa", "sed_dermis_j_per_m3", "sed_epidermis_j_per_m3"):
            for state in states:
                assert state.maps[name].tobytes() == maps[name][state.number].tobytes(), name
    increments = json.loads((out / "summary.json").read_text())["increments"]
    for state, increment in zip(states, increments, strict=True):
        for timed in (state.summary, increment):
            timed["effort"] = {name: n for name, n in timed["effort"].items() if not name.endswith("_s")}
            timed.pop("seconds")
        assert state.summary == increment
        state.write_vtu(tmp_path / "state.vtu")
        written = (out / f"state-{state.number:03}.vtu").read_bytes()
        assert (tmp_path / "state.vtu").read_bytes() == written and b'"stress_pa"' in written
    assert states[1].force_n[2] > states[0].force_n[2] > 0 and states[1].iterations > 0
    assert states[1].sed_j_per_m3.max() > 0 and states[1].pressure_pa.shape == (224, 224)


def test_files_of_a_run_are_those_of_the_command(command, tmp_path):
    out = command(FINGER)
    states = fe.Scene(FINGER).run(out=tmp_path / "own")
    with np.load(out / "maps.npz") as due, np.load(tmp_path / "own/maps.npz") as maps:
        assert sorted(maps) == sorted(due)
        for name in due:
            assert maps[name].dtype == due[name].dtype and maps[name].tobytes() == due[name].tobytes(), name
    for name in ("series.pvd", "state-000.vtu", "state-001.vtu"):
        assert (tmp_path / "own" / name).read_bytes() == (out / name).read_bytes(), name
    summary = json.loads((tmp_path / "own/summary.json").read_text())
    assert summary["increments"] == [state.summary for state in states] and "ended" not in summary
    assert summary["scene"] == json.loads((out / "summary.json").read_text())["scene"]
    # The same from the command line, without fields.
    (tmp_path / "scene.toml").write_text(FINGER)
    papilla_command, scene = [sys.executable, "-m", "papilla"], tmp_path / "scene.toml"
    words = [*papilla_command, "solve", scene, "--out", tmp_path / "line", "--no-fields"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "state 1: 0.800 mm deep" in done.stdout
    assert sorted(path.name for path in (tmp_path / "line").iterdir()) == ["maps.npz", "summary.json"]
    done = subprocess.run([*papilla_command, "explain", scene], capture_output=True, text=True, check=True)
    # But for the seconds, which it measures.
    said, due = done.stdout.splitlines(), str(fe.Scene(scene).explain()).splitlines()
    assert len(said) == len(due) > 10 and said[:10] == due[:10]
    # A solve that is stopped leaves what it found.
    (tmp_path / "file").write_text("")
    with pytest.raises(papilla.BadInput, match="no folder"):
        fe.Scene(FINGER).run(out=tmp_path / "file")

    def stop(done, *_):
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fe.Scene(FINGER).run(out=tmp_path / "part", fields=False, progress=stop)
    assert json.loads((tmp_path / "part/summary.json").read_text())["ended"] == "stopped"


def test_a_map_of_pressure_presses_as_the_indenter_that_it_came_of(command, tmp_path):
    ball = fe.Scene(FINGER).run(fields=False)[-1]
    np.savez(tmp_path / "map.npz", pressure_pa=np.stack([0 * ball.pressure_pa, ball.pressure_pa]))
    head = FINGER[: FINGER.index("[indenter]")]
    text = head + f'[pressure]\nfile = "{tmp_path}/map.npz"\nincrements = 2\n'
    states = fe.Scene(text).run(fields=False)
    given = fe.Scene(head + "[pressure]\nincrements = 2\n", pressure=ball.pressure_pa).run(fields=False)
    out = command(text)
    with np.load(out / "maps.npz") as maps:
        for one, other in zip(states, given, strict=True):
            assert one.sed_j_per_m3.tobytes() == other.sed_j_per_m3.tobytes()
            assert one.sed_j_per_m3.tobytes() == maps["sed_dermis_j_per_m3"][one.number].tobytes()
    # Half of the pressure, then all of it: as much force as the ball, and as the map's own integral.
    half, whole = states
    assert whole.force_n[2] == pytest.approx(ball.force_n[2], rel=0.02)
    assert half.force_n[2] == pytest.approx(0.5 * whole.force_n[2], rel=0.05)
    atlas = papilla.Finger().atlas()
    normals = fe_normals(atlas)
    integral = (ball.pressure_pa.ravel()[atlas.pixels] * atlas.areas_mm2 * normals).sum() * 1e-6
    assert whole.force_n[2] == pytest.approx(integral, rel=0.1)
    assert whole.summary["checks"]["energy_vs_work"] < 5e-3 and 0.3 < whole.depth_mm < 0.9
    # The output shows the pressure that was given, to what the nodes of this coarse mesh hold of it.
    error = np.linalg.norm(whole.pressure_pa - ball.pressure_pa) / np.linalg.norm(ball.pressure_pa)
    assert error < 0.05


def ball_of_triangles(radius_mm, splits):
    """An STL of a ball, in metres."""
    t = (1 + 5**0.5) / 2
    corners = [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t], [0, -1, -t], [0, 1, -t],
               [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]]  # fmt: skip
    faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
             [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
             [8, 6, 7], [9, 8, 1]]  # fmt: skip
    triangles = np.array(corners, float)[faces]
    for _ in range(splits):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        quarters = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
    triangles *= 1e-3 * radius_mm / np.linalg.norm(triangles, axis=2, keepdims=True)
    record = np.zeros(len(triangles), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]))
    record["corners"] = triangles
    return bytes(80) + np.uint32(len(triangles)).tobytes() + record.tobytes()


def test_a_mesh_from_a_file_presses_as_the_body_that_it_is(tmp_path):
    (tmp_path / "ball.stl").write_bytes(ball_of_triangles(5.0, 4))
    ball = fe.Scene(FINGER).run(fields=False)[-1]
    (tmp_path / "scene.toml").write_text(
        FINGER.replace('shape = "sphere"\nradius_mm = 5.0', 'shape = "mesh"\nfile = "ball.stl"\nunit = "m"')
    )
    mesh = fe.Scene(tmp_path / "scene.toml").run(fields=False)[-1]
    assert mesh.force_n[2] == pytest.approx(ball.force_n[2], rel=0.02)
    error = np.linalg.norm(mesh.sed_j_per_m3 - ball.sed_j_per_m3) / np.linalg.norm(ball.sed_j_per_m3)
    assert error < 0.05
    with pytest.raises(papilla.BadScene, match="cannot read") as bad:
        fe.Scene(FINGER.replace('shape = "sphere"\nradius_mm = 5.0', 'shape = "mesh"\nfile = "none.stl"'))
    assert bad.value.field == "indenter.file" and bad.value.line == 9


def test_a_mesh_of_too_many_triangles_is_decimated_and_said(tmp_path):
    (tmp_path / "ball.stl").write_bytes(ball_of_triangles(5.0, 6))
    (tmp_path / "scene.toml").write_text(
        FINGER.replace('shape = "sphere"\nradius_mm = 5.0', 'shape = "mesh"\nfile = "ball.stl"\nunit = "m"')
    )
    scene = fe.Scene(tmp_path / "scene.toml")
    (said,) = scene.explain()["mended"]
    told = re.match(r"(\d+) triangles became (\d+): the surface is at most (\S+) mm off", said)
    before, after, off_mm = int(told[1]), int(told[2]), float(told[3])
    # A chord of so many triangles, evenly spread, is some 0.0015 mm off.
    assert before > 32_000 > 16_384 >= after > 16_000 and 0.0003 < off_mm < 0.01
    mesh = scene.run(fields=False, out=tmp_path / "out")[-1]
    assert json.loads((tmp_path / "out/summary.json").read_text())["mended"] == [said]
    ball = fe.Scene(FINGER).run(fields=False)[-1]
    assert mesh.force_n[2] == pytest.approx(ball.force_n[2], rel=5e-3)


def fe_normals(atlas):
    """How far the outward normal of each pixel looks against z."""
    corners = atlas.positions_mm[atlas.triangles[atlas.owners]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return -normal[:, 2] / np.linalg.norm(normal, axis=1)


def test_a_map_that_cannot_press_is_said(tmp_path):
    head = FINGER[: FINGER.index("[indenter]")] + "[pressure]\n"
    press = np.zeros((224, 224))
    press[95:115, 105:130] = 8e3
    for values, words in [
        (0 * press, "no pressure anywhere"),
        (-press, "never pulled"),
        (1e9 * press, "were Pa meant"),
    ]:
        with pytest.raises(papilla.BadScene, match=words) as bad:
            fe.Scene(head, pressure=values)
        assert bad.value.field == "pressure"
    corner = np.zeros((224, 224))
    corner[:5, :5] = 8e3
    with pytest.raises(papilla.BadScene, match="none of its pressure is on the skin"):
        fe.Scene(head, pressure=corner).explain()
    small = fe.Scene(head, pressure=1e-3 * press)
    assert "indenter" not in small.as_dict() and "kPa" in small.explain()["doubts"][0]
    np.save(tmp_path / "small.npy", press[:8])
    with pytest.raises(papilla.BadScene, match=r"shape \[8, 224\]"):
        fe.Scene(head + f'file = "{tmp_path}/small.npy"\n').explain()
    with pytest.raises(papilla.BadScene, match="No such file") as bad:
        fe.Scene(head + 'file = "none.npy"\n').explain()
    assert bad.value.field == "pressure.file" and bad.value.line == 8
    with pytest.raises(papilla.BadScene, match="give one map"):
        fe.Scene(head)
    with pytest.raises(papilla.BadScene, match="leave motion out"):
        fe.Scene(head + "[motion]\ndepth_mm = 1.0\n", pressure=press)
    with pytest.raises(papilla.BadScene, match="give one of the two"):
        fe.Scene(head + '[indenter]\nshape = "sphere"\nradius_mm = 5.0\n', pressure=press)
    with pytest.raises(papilla.BadScene, match="atlas"):
        fe.Scene({"geometry": BLOCK["geometry"]}, pressure=press)
    with pytest.raises(papilla.BadInput, match="224"):
        fe.Scene(head, pressure=press[:8])


def test_fields_hang_together(tmp_path):
    state = fe.Scene(BLOCK).run()[-1]
    nodes, cells = state.nodes, state.cells
    assert len(cells["sed_j_per_m3"]) == 32 and len(nodes["displacement_mm"]) == len(nodes["places_mm"])
    assert cells["offsets"][-1] == len(cells["connectivity"]) and (cells["layer"] == 1).all()
    # Pressure and stress of the surface say the same where the ball presses: sigma_zz = -p, to what a coarse
    # mesh extrapolates.
    pressed = np.argmax(nodes["pressure_pa"])
    assert nodes["stress_pa"][pressed, 2] == pytest.approx(-nodes["pressure_pa"][pressed], rel=0.5)
    # Compressed along z, spread along x and y.
    under = np.argmax(cells["sed_j_per_m3"])
    xx, yy, zz = cells["strain"][under, :3]
    assert zz < 0 < min(xx, yy)
    assert state.maps == {} and state.flags == ()
    with pytest.raises(papilla.BadInput, match="no atlas"):
        _ = state.sed_j_per_m3
    light = next(fe.Scene(BLOCK).solve(fields=False))
    assert light.nodes == {} and light.cells == {}
    with pytest.raises(papilla.BadInput, match="fields=True"):
        light.write_vtu(tmp_path / "none.vtu")


def test_a_scene_is_a_dict_a_text_or_a_file(tmp_path):
    text = '[geometry]\nkind = "block"\nsize_mm = [6.0, 6.0]\nelements = [4, 4]\n'
    text += 'layers = [{ tissue = "dermis", thickness_mm = 2.0, elements = 2 }]\n'
    text += '[indenter]\nshape = "sphere"\nradius_mm = 4.0\n[motion]\ndepth_mm = 0.3\nincrements = 2\n'
    (tmp_path / "scene.toml").write_text(text)
    numbers = BLOCK | {"motion": {"depth_mm": np.float64(0.3), "increments": np.int64(2)}}
    dicts = [fe.Scene(source).as_dict() for source in (BLOCK, numbers, text, tmp_path / "scene.toml")]
    assert all(each == dicts[0] for each in dicts) and dicts[0]["motion"]["depth_mm"] == 0.3


def test_explain_is_that_of_the_command(tmp_path):
    (tmp_path / "scene.toml").write_text(FINGER)
    program = Path(os.environ.get("BIN", "target/debug")) / "fe-datagen"
    told = subprocess.run([program, "explain", tmp_path / "scene.toml", "--json"], check=True, capture_output=True)
    explained, command = fe.Scene(tmp_path / "scene.toml").explain(), json.loads(told.stdout)
    for each in (explained, command):
        each.pop("setup_s"), each.pop("better_mesh")
        # The machine's speed is measured.
        each["forecast"].pop("seconds"), each["forecast"].pop("machine")
    assert dict(explained) == command and "simulated" in explained.text == str(explained)


def test_effects_say_what_they_cost_and_change():
    (finite,) = fe.Scene(BLOCK | {"effects": ["finite_strain"]}).effects(solve=True)
    assert finite.name == "finite_strain" and finite.force_change > 0.01 and finite.sed_change is None
    assert finite.seconds_with > 0 and finite.seconds_without > 0 and finite.why_not is None
    shallow = FINGER.replace("0.8", "0.3").replace("increments = 2", "increments = 1")
    (layers,) = fe.Scene(shallow.replace('"finite_strain", ', "")).effects(solve=True)
    assert layers.sed_change > 0.05


def test_a_scene_that_cannot_be_says_where():
    with pytest.raises(papilla.BadScene, match="radius_mm") as bad:
        fe.Scene(FINGER.replace("radius_mm = 5.0", "radius_mm = -5.0"))
    assert bad.value.field == "indenter.radius_mm" and bad.value.line == 9
    with pytest.raises(papilla.BadScene, match="depth"):
        fe.Scene(BLOCK | {"motion": {"depth": 1.0}})
    with pytest.raises(papilla.BadScene, match="cannot read"):
        fe.Scene("nowhere.toml")
    # Found when the body is set up.
    far = FINGER.replace("depth_mm = 0.8", "depth_mm = 0.8\noffset_mm = [40.0, 40.0]")
    with pytest.raises(papilla.BadScene) as bad:
        next(fe.Scene(far).solve())
    assert bad.value.field == "motion.offset_mm"


def test_a_number_that_is_none_is_named():
    with pytest.raises(papilla.BadScene, match=r"indenter\.radius_mm: nan") as refused:
        papilla.fe.Scene({"indenter": {"kind": "sphere", "radius_mm": float("nan")}})
    assert refused.value.field == "indenter.radius_mm"


def test_a_hard_case_is_an_error_with_fields():
    # No depth of a block of 2 mm bears 900 N.
    with pytest.raises(papilla.NotSolved, match="no equilibrium") as failed:
        fe.Scene(BLOCK | {"motion": {"force_n": 900.0, "increments": 1}}).run(fields=False)
    error = failed.value
    assert error.kind == "no_equilibrium" and error.states == 0
    assert error.depth_mm > 2.0 and 0.0 < error.reached < 1.0


def test_ctrl_c_and_close_end_a_solve(interrupted):
    program = f"""
from papilla import fe
scene = fe.Scene({FINGER.replace('"linear"', '"quadratic"')!r})
print("ready", flush=True)
try:
    scene.run()
except KeyboardInterrupt:
    print("interrupted")
"""
    assert interrupted(program, 3.0, within_s=120.0) == "interrupted\n"
    with fe.Scene(BLOCK).solve() as solve:
        first = next(solve)
    assert first.number == 0 and list(solve) == []
