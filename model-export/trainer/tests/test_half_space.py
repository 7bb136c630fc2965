from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from papilla_trainer.cli import main
from papilla_trainer.comparison.atlas import Atlas
from papilla_trainer.comparison.half_space import HalfSpace
from papilla_trainer.dataset import Dataset


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.48])
def test_a_uniform_disc_has_its_closed_form_on_the_axis(nu: float) -> None:
    """Timoshenko & Goodier: stresses on the axis under a uniform circular pressure."""
    body, radius = HalfSpace(80e3, nu, 0.2), 1.3
    rings, turns = 4000, 8
    r = (np.arange(rings) + 0.5) * radius / rings
    angle = 2 * np.pi * np.arange(turns) / turns
    x, y = r[:, None] * np.cos(angle), r[:, None] * np.sin(angle)
    area = r[:, None] * (radius / rings) * (2 * np.pi / turns)
    xx, yy, zz, *shears = ((body.stress(x, y) * area[..., None]).sum(axis=(0, 1))).tolist()
    z, slant = body.depth_mm, np.hypot(radius, body.depth_mm)
    axial = -(1 - z**3 / slant**3)
    lateral = 0.5 * (-(1 + 2 * nu) + 2 * (1 + nu) * z / slant - z**3 / slant**3)
    assert zz == pytest.approx(axial, rel=1e-5)
    assert xx == pytest.approx(lateral, rel=1e-5, abs=1e-6)
    assert yy == pytest.approx(lateral, rel=1e-5, abs=1e-6)
    assert np.abs(shears).max() < 1e-12


def test_a_plane_below_the_surface_carries_the_load() -> None:
    body = HalfSpace(80e3, 0.48, 0.2)
    at = (np.arange(-400, 400) + 0.5) * 0.05
    stress = body.stress(*np.meshgrid(at, at))
    assert -stress[..., 2].sum() * 0.05**2 == pytest.approx(1.0, rel=1e-3)
    assert np.isfinite(body.stress(np.zeros(1), np.zeros(1))).all()


def test_squares_of_the_components_are_the_strain_energy() -> None:
    body = HalfSpace(80e3, 0.3)
    stress = np.random.default_rng(1).normal(size=(5, 6)) * 1e3
    diagonal, shear = stress[:, :3], stress[:, 3:]
    e, nu = body.youngs_modulus_pa, body.poissons_ratio
    trace = diagonal.sum(axis=1)
    squares = (diagonal**2).sum(axis=1) + 2 * (shear**2).sum(axis=1)
    energy = ((1 + nu) * squares - nu * trace**2) / (2 * e)
    np.testing.assert_allclose((body.components(stress) ** 2).sum(axis=1), energy, rtol=1e-12)


def test_the_operator_integrates_a_linear_pressure(tiny: Dataset) -> None:
    """Against a fine sum of the kernel over the patch, far finer than its triangles."""
    atlas = Atlas.read(tiny.directory / "atlas.json")
    body = HalfSpace()
    place = atlas.skin_px * atlas.mm_per_px
    low, high = place.min(axis=0), place.max(axis=0)
    step = 0.02
    axes = [np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True)]
    x, y = np.meshgrid(*axes, indexing="ij")
    pressure = 1e4 * (1 + 0.1 * place[:, 0] - 0.05 * place[:, 1])
    fine = 1e4 * (1 + 0.1 * x - 0.05 * y)
    g = body.operator(atlas)
    for v in (len(place) // 2, 3):
        kernel = body.components(body.stress(place[v, 0] - x, place[v, 1] - y))
        expected = (fine[..., None] * kernel).sum(axis=(0, 1)) * step**2
        found = g[v] @ pressure
        # Components of either sign cancel: what counts is the energy and each one beside it.
        assert np.abs(found - expected).max() < 0.02 * np.linalg.norm(expected)


def test_untrained_models_from_the_command_line(
    tiny: Dataset, operator_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = str(tiny.directory)
    half_space, operator = str(tmp_path / "half-space.onnx"), str(tmp_path / "fe-operator.onnx")
    shape = ["--rank", "8", "--near", "5", "--json"]
    assert main(["half-space", "--dataset", data, "--onnx", half_space, *shape]) == 0
    assert (
        main(["operator", str(operator_file), "--dataset", data, "--onnx", operator, *shape]) == 0
    )
    assert Path(half_space).read_bytes() != Path(operator).read_bytes()
    capsys.readouterr()
    for model in (half_space, operator):
        assert main(["check", model, "--dataset", data, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["zero_gives_zero"] is True
    odd = ["half-space", "--dataset", data, "--onnx", half_space, "--rank", "7"]
    assert main(odd) == 2
