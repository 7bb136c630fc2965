"""Recorded touches as HJIF, the JSON form of MPEG's haptics coding (ISO/IEC 23090-31).

Levels over time become curves (force, pressure) or vibrations whose strength follows them. Files are of the profile
Simple Parametric with 1000 ticks a second, which the smallest players read. Which rules they keep, and who checked
what: docs/guides/devices.md.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime
from os import PathLike
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import BadInput
from .save import whole

if TYPE_CHECKING:
    from .series import Series

TICKS_PER_S: Final = 1000
# Places of keyframes in an effect have 16 bits, those of effects in a band 25 with their sign.
_EFFECT_TICKS: Final = 60_000
_LAST_TICK: Final = 2**24 - 1
_CHANNELS_LEVEL_1: Final = 128
_CHANNELS_LEVEL_2: Final = 65_535
_DESCRIPTION_BYTES: Final = 255
_FREQUENCY_HZ: Final = (1, 1000)
# A player may hold the last keyframe: each channel ends at 0, this long after the last frame.
_END_TICKS: Final = 20


def document(
    times_s: ArrayLike,
    levels: ArrayLike,
    *,
    unit: str = "force_n",
    frequency_hz: float | None = None,
    description: str = "",
    names: list[str] | None = None,
    finger: str | None = None,
    date: datetime | None = None,
) -> dict[str, Any]:
    """The file as an object.

    `times_s` rise, in s; the first is the file's beginning. `levels` are (frame,) or (frame, channel).
    `unit="force_n"`: forces in N, as curves of the modality Force. `unit="intensity"`: 0 to 1, as vibrations of
    `frequency_hz` of the modality Vibrotactile. `names` of the channels; `finger` is a body part of the
    standard, as Index. Raises BadInput.
    """
    times = _times(times_s)
    values = np.asarray(levels, np.float64)
    if values.ndim == 1:
        values = values[:, np.newaxis]
    if values.ndim != 2 or len(values) != len(times) or values.shape[1] == 0:
        raise BadInput("levels", f"shape {np.shape(levels)}, {len(times)} frames are due: (frame,) or (frame, channel)")
    if not np.isfinite(values).all():
        raise BadInput("levels", "not all are finite", int(np.argwhere(~np.isfinite(values))[0, 0]))
    if values.min() < 0.0:
        raise BadInput("levels", "negative; give the size of a force", int(np.argwhere(values < 0.0)[0, 0]))
    if names is not None and len(names) != values.shape[1]:
        raise BadInput("names", f"{len(names)} for {values.shape[1]} channels")
    if values.shape[1] > _CHANNELS_LEVEL_2:
        raise BadInput("levels", f"{values.shape[1]} channels; a file has {_CHANNELS_LEVEL_2} at most")
    band, modality = _band(unit, frequency_hz)
    if unit == "intensity" and values.max() > 1.0:
        raise BadInput("levels", "an intensity is above 1", int(np.argwhere(values > 1.0)[0, 0]))
    ticks = np.round((times - times[0]) * TICKS_PER_S).astype(np.int64)
    # Of frames in the same tick the last one counts.
    last = np.append(ticks[1:] != ticks[:-1], True)
    ticks, values = ticks[last], values[last]
    channels = []
    for number, column in enumerate(values.T):
        # Amplitudes are at most 1: a force is the gain times them.
        gain = float(column.max()) if unit == "force_n" and column.max() > 0.0 else 1.0
        channel: dict[str, Any] = {
            "id": number,
            "description": _short(names[number] if names else f"{unit} {number}"),
            "gain": gain,
            "mixing_coefficient": 1,
            "body_part_mask": 0,
            "bands": [{**band, "effects": _effects(ticks, column / gain, frequency_hz)}],
        }
        if finger is not None:
            channel["body_part_target"] = [finger]
        channels.append(channel)
    return {
        "version": "2023",
        "profile": "Simple Parametric",
        "level": 1 if len(channels) <= _CHANNELS_LEVEL_1 else 2,
        "date": _written(date or datetime.now(UTC)),
        "description": _short(description),
        "timescale": TICKS_PER_S,
        "avatars": [],
        "perceptions": [
            {
                "id": 0,
                "avatar_id": 0,
                "description": _short(description),
                "perception_modality": modality,
                "unit_exponent": -3,
                "perception_unit_exponent": 0,
                "reference_devices": [],
                "effect_library": [],
                "channels": channels,
            }
        ],
        "syncs": [],
    }


def _written(date: datetime) -> str:
    """Date and time as RFC 3339 has them; a date without a zone is one of UTC."""
    return (date if date.tzinfo is None else date.astimezone(UTC)).strftime("%Y-%m-%dT%H:%M:%SZ")


def write(path: str | PathLike[str], times_s: ArrayLike, levels: ArrayLike, **how: Any) -> None:
    """Writes `document` as a file, name.hjif; the arguments are the same."""
    text = json.dumps(document(times_s, levels, **how), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    with whole(path) as there:
        there.write_text(text + "\n", encoding="utf-8")


def write_series(path: str | PathLike[str], series: Series, *, frequency_hz: float | None = None, **how: Any) -> None:
    """Writes what came of `papilla.render` with times.

    With `frequency_hz` the intensities of the effect `actuators`, as vibrations; else the size of the force.
    """
    if series.times_s is None:
        raise BadInput("series", "it has no times; give them to papilla.render")
    if frequency_hz is not None:
        write(path, series.times_s, series["actuators"], unit="intensity", frequency_hz=frequency_hz, **how)
        return
    touched = "touch_force_n" in series.values
    force_n = np.linalg.norm(series.force_n, axis=1) if touched else series["summary_force_n"]
    write(path, series.times_s, np.maximum(force_n, 0.0), unit="force_n", **how)


def _times(times_s: ArrayLike) -> NDArray[np.float64]:
    times = np.asarray(times_s, np.float64)
    if times.ndim != 1 or times.size == 0:
        raise BadInput("times_s", f"shape {times.shape}; one time for each frame is due")
    if not np.isfinite(times).all():
        raise BadInput("times_s", "not all are finite")
    if (np.diff(times) <= 0.0).any():
        raise BadInput("times_s", "they have to rise", int(np.argmax(np.diff(times) <= 0.0)) + 1)
    most_s = (_LAST_TICK - _END_TICKS) / TICKS_PER_S
    if times[-1] - times[0] > most_s:
        raise BadInput("times_s", f"{times[-1] - times[0]:.0f} s; a file holds {most_s:.0f} s at most")
    return times


def _band(unit: str, frequency_hz: float | None) -> tuple[dict[str, Any], str]:
    """The band without its effects, and the modality."""
    least, most = _FREQUENCY_HZ
    if unit == "force_n":
        if frequency_hz is not None:
            raise BadInput("frequency_hz", "a force is a curve and has none; with unit='intensity' it vibrates")
        limits = {"lower_frequency_limit": 0, "upper_frequency_limit": most}
        return {"band_type": "Curve", "curve_type": "Linear", **limits}, "Force"
    if unit == "intensity":
        if frequency_hz is None or not least <= frequency_hz <= most:
            raise BadInput("frequency_hz", f"{frequency_hz!r}; a vibration needs one of {least} to {most} Hz")
        return {"band_type": "VectorialWave", "lower_frequency_limit": 0, "upper_frequency_limit": most}, "Vibrotactile"
    raise BadInput("unit", f"{unit!r}; force_n and intensity are known")


def _effects(
    ticks: NDArray[np.int64], amplitude: NDArray[np.float64], frequency_hz: float | None
) -> list[dict[str, Any]]:
    """Keyframes at the times, and one at 0 behind the last; a long record in several effects that meet."""
    ticks = np.append(ticks, ticks[-1] + _END_TICKS)
    amplitude = np.append(amplitude, 0.0)
    effects = []
    first = 0
    while first < len(ticks) - 1:
        end = int(np.searchsorted(ticks, ticks[first] + _EFFECT_TICKS, side="right"))
        # A gap longer than an effect is held by keyframes in between.
        if end == first + 1:
            between = ticks[first] + _EFFECT_TICKS
            share = (between - ticks[first]) / (ticks[end] - ticks[first])
            ticks = np.insert(ticks, end, between)
            amplitude = np.insert(amplitude, end, amplitude[first] + share * (amplitude[end] - amplitude[first]))
            end += 1
        effects.append(_effect(ticks[first:end], amplitude[first:end], frequency_hz))
        # The next one begins where this one ends.
        first = end - 1
    return effects


def _effect(ticks: NDArray[np.int64], amplitude: NDArray[np.float64], frequency_hz: float | None) -> dict[str, Any]:
    keyframes: list[dict[str, Any]] = [
        {"relative_position": int(tick - ticks[0]), "amplitude_modulation": round(float(value), 6)}
        for tick, value in zip(ticks, amplitude, strict=True)
    ]
    if frequency_hz is not None:
        for keyframe in keyframes:
            keyframe["frequency_modulation"] = round(frequency_hz)
    return {
        "effect_type": "Basis",
        "position": int(ticks[0]),
        "phase": 0,
        "base_signal": "Sine",
        "keyframes": keyframes,
    }


def _short(text: str) -> str:
    """At most as many bytes as a description may have."""
    return text.encode()[:_DESCRIPTION_BYTES].decode(errors="ignore")
