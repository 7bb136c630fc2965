"""Meshes as they come."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import papilla
from papilla import meshes


def ball(radius_mm=6.0, subdivisions=3):
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius_mm)


def force_n(url, objects, pose):
    with papilla.Session(url, input="objects", objects=objects, map=False) as session:
        return session.touch(pose).touch.force_n[2]


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "glb"])
def test_a_ball_from_a_file_pushes_like_the_ball(url, tmp_path, ending):
    file = tmp_path / f"ball.{ending}"
    whole = ball()
    if ending == "glb":
        whole.apply_scale(1e-3)
    whole.export(file)
    part = meshes.load(file)
    np.testing.assert_allclose(part.bounds_mm, [[-6] * 3, [6] * 3], atol=0.05)
    assert part.notes == [] and part.triangles == 1280 and part.decimated_mm == 0.0
    pose = part.under_pad(0.5)
    sphere = {"shape": {"shape": "sphere", "radius_mm": 6.0}}
    assert force_n(url, [part.object()], pose) == pytest.approx(force_n(url, [sphere], pose), rel=0.06)


def test_a_size_that_looks_wrong_is_asked_about(tmp_path):
    small = ball()
    small.apply_scale(1e-3)
    small.export(tmp_path / "small.stl")
    with pytest.raises(papilla.BadInput, match="unit='m'"):
        meshes.load(tmp_path / "small.stl")
    assert meshes.load(tmp_path / "small.stl", unit="m").bounds_mm[1, 0] == pytest.approx(6.0, rel=1e-3)
    ball().export(tmp_path / "large.glb")
    with pytest.raises(papilla.BadInput, match="unit='mm'"):
        meshes.load(tmp_path / "large.glb")
    with pytest.raises(papilla.BadInput, match="none of mm"):
        meshes.load(tmp_path / "large.glb", unit="feet")


def test_open_and_crossing_surfaces_are_bodies_all_the_same(url):
    whole = ball()
    closed = meshes.of(whole.vertices, whole.faces)
    pose = closed.under_pad(0.5)
    due = force_n(url, [closed.object()], pose)
    # Away from the hole, which is on the far side, it is the whole ball.
    below = np.argsort(whole.triangles_center[:, 2])[20:]
    bowl = meshes.of(whole.vertices, whole.faces[below])
    assert any("open, at" in note and "first near (" in note and "winding" in note for note in bowl.notes)
    assert force_n(url, [bowl.object()], pose) == pytest.approx(due, rel=1e-3)
    with papilla.Session(url, input="objects", objects=[bowl.object()], map=False) as session:
        assert any("1 hole was closed" in words for words in session.warnings), session.warnings
    pulled = whole.vertices.copy()
    pulled[int(np.argmax(pulled[:, 0])), 0] = -9.0
    crossing = meshes.of(pulled, whole.faces)
    assert any("crosses itself" in note for note in crossing.notes)
    assert force_n(url, [crossing.object()], pose) == pytest.approx(due, rel=0.02)


def test_a_sheet_is_refused_where_contact_is_computed(url):
    flat = [[x, y, 0.0] for x in range(4) for y in range(4)]
    cells = [4 * x + y for x in range(3) for y in range(3)]
    sheet = meshes.of(flat, [[a, a + 4, a + 5] for a in cells] + [[a, a + 5, a + 1] for a in cells])
    with pytest.raises(papilla.Refused, match="no inside"):
        force_n(url, [sheet.object()], sheet.under_pad(0.3))
    with pytest.raises(meshes.BadMesh, match="not finite"):
        meshes.of(np.full((4, 3), np.nan), [[0, 1, 2]])


@pytest.mark.parametrize(
    ("shape", "top_mm"),
    [
        ({"shape": "box", "size_mm": [8, 6, 4], "edge_radius_mm": 0.5}, 2.0),
        ({"shape": "capsule", "radius_mm": 2, "length_mm": 9}, 2.0),
        ({"shape": "torus", "radius_mm": 4, "tube_radius_mm": 1.5}, 1.5),
    ],
)
def test_shapes_that_were_missed_press_as_their_meshes(url, shape, top_mm):
    make = trimesh.creation
    mesh = {
        "box": lambda: _rounded_box([8, 6, 4], 0.5),
        "capsule": lambda: make.capsule(height=5, radius=2, count=[48, 48]),
        "torus": lambda: make.torus(4, 1.5, major_sections=72, minor_sections=48),
    }[shape["shape"]]()
    if shape["shape"] == "capsule":
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
        mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    part = meshes.of(mesh.vertices, mesh.faces)
    # Over the tube of a torus, not over its hole.
    aside = shape["radius_mm"] if shape["shape"] == "torus" else 0.0
    pose = [11.25 - aside, 0, -6.53 - top_mm + 0.5, 0, 0, 0, 1]
    due = force_n(url, [part.object()], pose)
    assert due > 0.01
    assert force_n(url, [{"shape": shape}], pose) == pytest.approx(due, rel=0.03)


def _rounded_box(size, radius):
    """The convex hull of balls at its corners."""
    corners = [[sx * (size[0] / 2 - radius), sy * (size[1] / 2 - radius), sz * (size[2] / 2 - radius)]
               for sx in (-1, 1) for sy in (-1, 1) for sz in (-1, 1)]  # fmt: skip
    points = trimesh.creation.icosphere(subdivisions=3, radius=radius).vertices
    return trimesh.convex.convex_hull(np.concatenate([points + corner for corner in corners]))


def test_what_is_mended_is_said(url):
    whole = ball()
    inside_out = meshes.of(whole.vertices, whole.faces[:, ::-1])
    assert any("turned" in note for note in inside_out.notes) and not any("winding" in n for n in inside_out.notes)
    twice = np.concatenate([whole.faces, whole.faces[:2]])
    assert any("2 triangles" in note for note in meshes.of(whole.vertices, twice).notes)
    pose = inside_out.under_pad(0.4)
    straight = meshes.of(whole.vertices, whole.faces)
    assert force_n(url, [inside_out.object()], pose) == pytest.approx(force_n(url, [straight.object()], pose), rel=1e-3)


def test_two_bodies_become_a_union(url):
    left, right = ball(2.0, 2), ball(2.0, 2)
    left.apply_translation([-3, 0, 0])
    right.apply_translation([3, 0, 0])
    both = trimesh.util.concatenate([left, right])
    part = meshes.of(both.vertices, both.faces)
    assert part.shape()["shape"] == "union" and len(part.parts) == 2
    assert force_n(url, [part.object()], part.under_pad(0.6)) > 0.0


def test_too_many_triangles_are_decimated_and_the_distance_is_stated(url):
    fine = ball(6.0, 6)
    part = meshes.of(fine.vertices, fine.faces, triangles_max=2000)
    assert part.triangles <= 2000 and 0 < part.decimated_mm < 0.05
    assert any("mm off" in note for note in part.notes)
    whole = meshes.of(ball(6.0, 4).vertices, ball(6.0, 4).faces)
    pose = whole.under_pad(0.5)
    assert force_n(url, [part.object()], pose) == pytest.approx(force_n(url, [whole.object()], pose), rel=0.05)


def test_a_mesh_with_more_triangles_than_a_hello_holds_is_made_to_fit(url, tmp_path):
    fine = ball(6.0, 6)
    fine.export(tmp_path / "fine.stl")
    part = meshes.load(tmp_path / "fine.stl")
    assert 12_000 < part.triangles <= meshes.TRIANGLES_MAX < len(fine.faces) and 0 < part.decimated_mm < 0.01
    pose = part.under_pad(0.5)
    sphere = {"shape": {"shape": "sphere", "radius_mm": 6.0}}
    assert force_n(url, [part.object()], pose) == pytest.approx(force_n(url, [sphere], pose), rel=0.02)
    # Coordinates with more digits leave room for fewer triangles.
    fine.apply_translation([-333.3, -222.2, -111.1])
    far = meshes.of(fine.vertices, fine.faces)
    assert 12_000 < far.triangles < part.triangles
    assert len(json.dumps(far.shape(), separators=(",", ":"))) <= meshes.SHAPE_BYTES_MAX
    assert force_n(url, [far.object()], far.under_pad(0.5)) == pytest.approx(force_n(url, [sphere], pose), rel=0.02)
    # So do many bodies, which one by one have few triangles.
    balls = [ball(2.0, 5).apply_translation([5.0 * i, 0.1234, 0.1234]) for i in range(3)]
    several = trimesh.util.concatenate(balls)
    union = meshes.of(several.vertices, several.faces)
    assert len(json.dumps(union.shape(), separators=(",", ":"))) <= meshes.SHAPE_BYTES_MAX
    assert force_n(url, [union.object()], union.under_pad(0.3)) > 0.0


# Imports nothing but what the extra brings, and what that asks for.
_ALONE = """
import importlib.metadata as metadata, re, sys, tomllib
held = tomllib.load(open("{pyproject}", "rb"))["project"]
name_of = lambda words: re.match(r"[A-Za-z0-9_.-]+", words)[0].lower().replace("_", "-")
due = [name_of(words) for words in held["dependencies"] + held["optional-dependencies"]["meshes"]]
allowed = set()
while due:
    name = due.pop()
    if name not in allowed:
        allowed.add(name)
        due += [name_of(words) for words in metadata.requires(name) or [] if "extra ==" not in words]
owners = metadata.packages_distributions()
for module, names in owners.items():
    if not any(name.lower().replace("_", "-") in allowed for name in names) and module != "papilla":
        sys.modules[module] = None
assert sys.modules.get("pytest", 1) is None, "nothing was held back"
import numpy as np, trimesh
from papilla import meshes
ball = trimesh.creation.icosphere(subdivisions=4, radius=6)
faces = ball.faces.copy()
faces[::2] = faces[::2, ::-1]
part = meshes.of(ball.vertices, faces, triangles_max=1000)
assert any("turned" in note for note in part.notes), part.notes
solid = trimesh.Trimesh(*part.parts[0])
assert abs(solid.volume / ball.volume - 1) < 0.01, solid.volume
both = trimesh.util.concatenate([ball, ball.copy().apply_translation([20, 0, 0])])
assert len(meshes.of(both.vertices, both.faces).parts) == 2
"""


def test_the_extra_brings_all_that_meshes_need():
    program = _ALONE.format(pyproject=Path(__file__).parents[1] / "pyproject.toml")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_surface_whose_triangles_look_both_ways_is_turned(url, tmp_path):
    whole = ball()
    mixed = whole.faces.copy()
    mixed[::2] = mixed[::2, ::-1]
    trimesh.Trimesh(whole.vertices, mixed, process=False).export(tmp_path / "mixed.stl")
    part = meshes.load(tmp_path / "mixed.stl")
    assert any("turned" in note for note in part.notes)
    straight = meshes.of(whole.vertices, whole.faces)
    pose = straight.under_pad(0.4)
    assert force_n(url, [part.object()], pose) == pytest.approx(force_n(url, [straight.object()], pose), rel=1e-3)


def test_files_that_are_none_are_named(tmp_path, monkeypatch):
    (tmp_path / "a.stl").write_bytes(b"solid nothing\nendsolid\n")
    with pytest.raises(papilla.PapillaError, match=r"a\.stl"):
        meshes.load(tmp_path / "a.stl")
    with pytest.raises(papilla.BadInput, match=r"none of \.stl"):
        meshes.load(tmp_path / "a.step")
    with pytest.raises(papilla.BadInput, match="does not exist"):
        meshes.load(tmp_path / "b.stl")
    whole = ball()
    spoilt = whole.vertices.copy()
    spoilt[5] = np.nan
    lines = [f"{x:f} {y:f} {z:f}" for x, y, z in spoilt] + [f"3 {a} {b} {c}" for a, b, c in whole.faces]
    head = f"ply\nformat ascii 1.0\nelement vertex {len(spoilt)}\n" + "".join(f"property float {x}\n" for x in "xyz")
    head += f"element face {len(whole.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "nan.ply").write_text(head + "\n".join(lines) + "\n")
    with pytest.raises(meshes.BadMesh, match="a vertex is not finite"):
        meshes.load(tmp_path / "nan.ply")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(papilla.MissingExtra, match=r"papilla\[meshes\]"):
        meshes.load(tmp_path / "a.stl")
