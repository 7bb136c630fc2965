from __future__ import annotations

import numpy as np
import pytest

from papilla_trainer.metrics import sample_metrics, ssim, summarise


def bump() -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.mgrid[0:64, 0:64].astype(np.float32)
    truth = 5e3 * np.exp(-((rows - 30) ** 2 + (columns - 33) ** 2) / 200)
    mask = np.zeros((64, 64), dtype=np.float32)
    mask[4:60, 4:60] = 1
    return (truth * mask).astype(np.float32), mask


def test_a_perfect_prediction_has_no_error() -> None:
    truth, mask = bump()
    metrics = sample_metrics(truth.copy(), truth, mask)
    assert metrics is not None
    assert metrics.pop("ssim") == pytest.approx(1.0)
    assert all(value == 0.0 for value in metrics.values())


def test_ten_percent_too_much_is_ten_percent() -> None:
    truth, mask = bump()
    metrics = sample_metrics(truth * np.float32(1.1), truth, mask)
    assert metrics is not None
    assert 0.9 < metrics.pop("ssim") < 1.0
    assert all(value == pytest.approx(0.1, rel=1e-5) for value in metrics.values())


def test_far_field_sees_only_the_far_field() -> None:
    truth, mask = bump()
    near = truth >= 0.1 * truth.max()
    metrics = sample_metrics(np.where(near, 0, truth).astype(np.float32), truth, mask)
    assert metrics is not None
    assert metrics["far_field_relative_l2"] == 0.0
    assert metrics["relative_l2"] > 0.9


def test_pixels_outside_the_mask_do_not_count() -> None:
    truth, mask = bump()
    spoiled = np.where(mask > 0, truth, 1e6).astype(np.float32)
    metrics = sample_metrics(spoiled, truth, mask)
    assert metrics is not None
    assert metrics["relative_l2"] == 0.0
    assert metrics["peak_error"] == 0.0


def test_a_map_without_energy_has_no_relative_error() -> None:
    truth, mask = bump()
    assert sample_metrics(truth, np.zeros_like(truth), mask) is None


def test_ssim_of_two_constants_follows_its_formula() -> None:
    mask = np.zeros((64, 64), dtype=np.float32)
    mask[20:40, 20:40] = 1
    a, b = np.full((64, 64), 0.8, np.float32), np.full((64, 64), 0.4, np.float32)
    expected = (2 * 0.8 * 0.4 + 1e-4) / (0.8**2 + 0.4**2 + 1e-4)
    assert ssim(a, b, mask) == pytest.approx(expected, rel=1e-5)


def test_summary_takes_the_bad_end() -> None:
    names = ("relative_l2", "far_field_relative_l2", "peak_error", "total_energy_error", "ssim")
    samples = [dict.fromkeys(names, float(i)) for i in range(101)]
    samples[0]["far_field_relative_l2"] = float("nan")
    summary = summarise(samples)
    assert summary["relative_l2"] == {"median": 50.0, "p95": 95.0}
    assert summary["ssim"] == {"median": 50.0, "p5": 5.0}
    assert summary["far_field_relative_l2"]["median"] == 50.5
