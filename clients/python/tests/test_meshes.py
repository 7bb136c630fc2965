"""Meshes as they come."""

import sys

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


def test_open_and_crossing_surfaces_are_named_with_the_place():
    whole = ball()
    with pytest.raises(meshes.BadMesh, match=r"open, at 3 edges, the first near \(.*Close Holes"):
        meshes.of(whole.vertices, whole.faces[1:])
    pulled = whole.vertices.copy()
    pulled[int(np.argmax(pulled[:, 0])), 0] = -9.0
    with pytest.raises(meshes.BadMesh, match="crosses itself"):
        meshes.of(pulled, whole.faces)
    with pytest.raises(meshes.BadMesh, match="not finite"):
        meshes.of(np.full((4, 3), np.nan), [[0, 1, 2]])


def test_what_is_mended_is_said(url):
    whole = ball()
    inside_out = meshes.of(whole.vertices, whole.faces[:, ::-1])
    assert any("turned" in note for note in inside_out.notes)
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


def test_files_that_are_none_are_named(tmp_path, monkeypatch):
    (tmp_path / "a.stl").write_bytes(b"solid nothing\nendsolid\n")
    with pytest.raises(papilla.PapillaError, match=r"a\.stl"):
        meshes.load(tmp_path / "a.stl")
    with pytest.raises(papilla.BadInput, match=r"none of \.stl"):
        meshes.load(tmp_path / "a.step")
    with pytest.raises(papilla.BadInput, match="does not exist"):
        meshes.load(tmp_path / "b.stl")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(papilla.MissingExtra, match=r"papilla\[meshes\]"):
        meshes.load(tmp_path / "a.stl")
