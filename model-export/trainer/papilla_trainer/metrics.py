"""Errors of predicted SED maps against the finite-element truth.

Every metric is taken per sample over the pixels of the interface patch, then summarised over the
samples by median and 95th percentile. The definitions are those of `model-export evaluate`, which
repeats the measurement in the engine that serves the model.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

FAR_FIELD_FRACTION = 0.1
_SSIM_SIGMA_PX = 1.5
_SSIM_RADIUS_PX = 5
_SSIM_C1 = 0.01**2
_SSIM_C2 = 0.03**2

METRICS = ("relative_l2", "far_field_relative_l2", "peak_error", "total_energy_error", "ssim")


def relative_l2(prediction: F64, truth: F64) -> float:
    """Norm of the error over the norm of the truth."""
    return float(np.linalg.norm(prediction - truth) / np.linalg.norm(truth))


def sample_metrics(prediction: F32, truth: F32, mask: F32) -> dict[str, float] | None:
    """All metrics of one ``[H, W]`` map; ``None`` where the truth is zero everywhere.

    The far field (truth below 10 % of its maximum) is NaN where it is empty or zero.
    """
    inside = mask > 0
    p, t = prediction[inside].astype(np.float64), truth[inside].astype(np.float64)
    peak = float(t.max())
    if peak <= 0.0:
        return None
    far = t < FAR_FIELD_FRACTION * peak
    far_norm = float(np.linalg.norm(t[far]))
    return {
        "relative_l2": relative_l2(p, t),
        "far_field_relative_l2": (
            float(np.linalg.norm((p - t)[far]) / far_norm) if far_norm > 0.0 else float("nan")
        ),
        "peak_error": abs(float(p.max()) - peak) / peak,
        "total_energy_error": abs(float(p.sum()) - float(t.sum())) / float(t.sum()),
        "ssim": ssim(prediction / np.float32(peak), truth / np.float32(peak), mask),
    }


def ssim(a: F32, b: F32, mask: F32) -> float:
    """Mean structural similarity (Wang 2004) over the mask, of maps in units of the true peak.

    Gaussian window of 11 x 11 px, sigma 1.5 px, data range 1, zeros outside the image.
    """
    x, y = a.astype(np.float64), b.astype(np.float64)
    mean_x, mean_y = _blur(x), _blur(y)
    var_x = _blur(x * x) - mean_x**2
    var_y = _blur(y * y) - mean_y**2
    covariance = _blur(x * y) - mean_x * mean_y
    similarity = ((2 * mean_x * mean_y + _SSIM_C1) * (2 * covariance + _SSIM_C2)) / (
        (mean_x**2 + mean_y**2 + _SSIM_C1) * (var_x + var_y + _SSIM_C2)
    )
    return float(similarity[mask > 0].mean())


def summarise(per_sample: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Median and 95th percentile of each metric (for SSIM the 5th: the bad end)."""
    summary: dict[str, dict[str, float]] = {}
    for name in METRICS:
        values = np.array([sample[name] for sample in per_sample], dtype=np.float64)
        values = values[np.isfinite(values)]
        if not values.size:
            continue
        bad_end = ("p5", 5.0) if name == "ssim" else ("p95", 95.0)
        summary[name] = {
            "median": float(np.median(values)),
            bad_end[0]: float(np.percentile(values, bad_end[1])),
        }
    return summary


def evaluate(
    predict: Callable[[F32], F32], pressure_pa: F32, sed_j_per_m3: F32, mask: F32, batch: int = 8
) -> list[dict[str, float] | None]:
    """Metrics of every sample; ``predict`` maps ``[B, H, W]`` Pa to ``[B, H, W]`` J/m3."""
    results: list[dict[str, float] | None] = []
    for start in range(0, len(pressure_pa), batch):
        truth = sed_j_per_m3[start : start + batch]
        for p, t in zip(predict(pressure_pa[start : start + batch]), truth, strict=True):
            results.append(sample_metrics(p, t, mask))
    return results


def _blur(image: F64) -> F64:
    offsets = np.arange(-_SSIM_RADIUS_PX, _SSIM_RADIUS_PX + 1)
    window = np.exp(-0.5 * (offsets / _SSIM_SIGMA_PX) ** 2)
    window /= window.sum()
    for axis in (0, 1):
        padding = [(0, 0), (0, 0)]
        padding[axis] = (_SSIM_RADIUS_PX, _SSIM_RADIUS_PX)
        padded = np.pad(image, padding)
        length = image.shape[axis]
        image = sum(
            weight * np.take(padded, range(k, k + length), axis=axis)
            for k, weight in enumerate(window)
        )
    return image
