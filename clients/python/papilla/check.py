"""What a map or a series has to be, and words for each way in which it is not."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import BadInput
from .wire import SIDE_PX, WHOLE, Map, Window

SIDE: Final = (SIDE_PX, SIDE_PX)
UNITS: Final[dict[str, dict[str, float]]] = {
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6},
    "objects": {"mm": 1.0, "m": 1e3},
    "gaps": {"mm": 1.0, "m": 1e3},
    "sed": {"J m-3": 1.0, "J/m3": 1.0, "J m^-3": 1.0, "J/m^3": 1.0, "kJ m-3": 1e3, "kJ/m3": 1e3, "kJ/m^3": 1e3},
    "times": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
"""Units that values may come in, of what they are (for a series the hello's `input`): the first is the protocol's."""
_SPELLED: Final = {
    "pascal": "Pa", "pascals": "Pa", "kilopascal": "kPa", "megapascal": "MPa", "kPA": "kPa", "millimeter": "mm",
    "millimetre": "mm", "meter": "m", "metre": "m", "second": "s", "seconds": "s", "millisecond": "ms",
    "milliseconds": "ms", "microsecond": "us", "microseconds": "us", "nanoseconds": "ns",
}  # fmt: skip
_PLACES: Final = {
    "time": 0, "times": 0, "t": 0, "frame": 0, "frames": 0, "row": 2, "rows": 2, "column": 3, "columns": 3, "col": 3,
}  # fmt: skip
"""Order of axes that have names; others stay where they are, after time and before rows."""
_SLOW_S: Final = 1.0
# Below these a series in the protocol's unit is asked about: no touch is so weak, no scene so small.
_ASKED_BELOW: Final = {"pressure": 150.0, "objects": 0.2, "gaps": 0.2}
# Numbers that are looked at together, so that they are still in a processor's cache at the second look, and numbers
# that are worth a thread.
_TOGETHER: Final = 2**17
_OF_A_THREAD: Final = 2**22


def numbers(values: Any, member: str) -> NDArray[Any]:
    """The values as an array of real numbers.

    Of an array with named axes, as xarray has them, time comes first, and rows and columns last. Raises BadInput for
    a masked value, whose number means nothing.
    """
    if isinstance(values, np.ma.MaskedArray) and np.ma.getmaskarray(values).any():
        hidden = int(np.ma.getmaskarray(values).sum())
        raise BadInput(member, f"{hidden} values are masked: give .filled(...) with what they are to count as")
    if _is_labelled(values):
        order = sorted(values.dims, key=lambda name: _PLACES.get(str(name).lower(), 1))
        values = values.transpose(*order)
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise BadInput(member, f"its rows are not equally long ({error})") from error
    if array.dtype.kind not in "fiu":
        raise BadInput(member, f"it is of type {array.dtype}; real numbers are due, such as np.float32")
    return array


def _is_labelled(values: Any) -> bool:
    """Whether an array names its axes and has attributes, as those of xarray."""
    return all(hasattr(values, name) for name in ("dims", "attrs", "transpose"))


def unit_of(values: Any, member: str, kind: str, unit: str | None = None) -> str | None:
    """The unit that values are said to be in, by an argument or by themselves; raises BadInput for an unknown one."""
    if unit is not None:
        unit_factor(unit, kind)
    own = written_unit(values)
    if own is None:
        return unit
    if own not in UNITS[kind]:
        raise BadInput(member, f"its attribute says the unit {own!r}, none of {', '.join(UNITS[kind])}: convert it")
    if unit is not None and UNITS[kind][unit] != UNITS[kind][own]:
        raise BadInput("unit", f"{unit!r} is given, and the array's own attribute says {own!r}")
    return own


def written_unit(values: Any) -> str | None:
    """The unit that an array with attributes, as those of xarray, says itself."""
    if not _is_labelled(values):
        return None
    written = next((str(values.attrs[name]).strip() for name in ("units", "unit") if values.attrs.get(name)), None)
    return None if written is None else _SPELLED.get(written, written)


def given(values: Any, member: str, kind: str, unit: str | None = None) -> tuple[NDArray[Any], bool]:
    """The values in the protocol's unit, and whether their unit was said."""
    said = unit_of(values, member, kind, unit)
    array, factor = numbers(values, member), unit_factor(said, kind)
    if factor != 1.0:
        # Times need more digits than float32 has.
        array = array * factor if kind == "times" else in_unit(array, kind, factor)
    return array, said is not None


def rows(kind: str, values: ArrayLike) -> Map:
    """Rows of poses or gaps of one frame, mm; raises BadInput with what to do."""
    array, _ = given(values, "poses" if kind == "objects" else "depth_mm", kind)
    result: Map = np.atleast_2d(array.astype(np.float32, copy=False))
    return result


def number(value: Any, member: str, due: str) -> float:
    """One finite number; `due` says which."""
    try:
        found = float(value) if isinstance(value, int | float | np.number) else math.nan
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found):
        raise BadInput(member, f"{value!r}; {due} is due")
    return found


def samples(pressure_pa: ArrayLike, window: Window) -> Map:
    """The samples of a window as float32; raises BadInput with what to do."""
    array, _ = given(pressure_pa, "pressure_pa", "pressure")
    due = (window[3], window[2])
    if array.shape != due:
        if window != WHOLE:
            raise BadInput("pressure_pa", f"{array.shape} samples for a window of {due}")
        raise BadInput("pressure_pa", f"it has shape {array.shape}; {_cure(array.shape)}")
    return array.astype(np.float32, copy=False)


def pressure(pressure_pa: ArrayLike | None, window: Window | None) -> tuple[Map, Window]:
    """Samples and window of a frame of pressure: without a window the whole map, without pressure no contact."""
    if pressure_pa is None:
        pressure_pa, window = np.zeros((0, 0), np.float32), window or (0, 0, 0, 0)
    window = window or WHOLE
    return samples(pressure_pa, window), window


def _cure(shape: tuple[int, ...]) -> str:
    """What to do with an array that is no map."""
    whole = f"a map of the finger has {SIDE_PX} x {SIDE_PX} pixels"
    if shape == (SIDE_PX * SIDE_PX,):
        return f"{whole}: call .reshape({SIDE_PX}, {SIDE_PX})"
    if len(shape) == 3 and shape[1:] == SIDE:
        return "this is a series of maps: papilla.render(frames, times) takes it as it is"
    if len(shape) == 3:
        return f"{whole}, and a series of them goes to papilla.render(frames, times)"
    return (
        f"{whole}. For readings of a sensor describe it, and let it make the map: "
        "papilla.sensors.Taxels.grid(rows, columns, pitch_mm=...).pressure(readings). "
        "For points of contact: papilla.Atlas.load().contacts([...]). "
        "For a part of a map: Session.render(part, window=(column, row, width, height))"
    )


def shape_of_frames(got: tuple[int, ...], due: tuple[int, ...], kind: str) -> None:
    """Raises BadInput, with a cure, unless an array of shape `got` is a series of frames of shape `due`."""
    if len(got) == len(due) + 1 and got[1:] == due:
        return
    series = "(" + ", ".join(["frames", *map(str, due)]) + ")"
    said = f"the array has shape {got}; {series} is due"
    if len(due) == 2 and got == due:
        cure = "this is one frame: give frames[None], or call Session.render or touch"
    elif len(got) == len(due) + 1 and got[: len(due)] == due:
        cure = "time seems to come last: give np.moveaxis(frames, -1, 0)"
    elif kind == "pressure" and got[-1:] == (7,):
        cure = "these seem to be poses: name input='objects' and objects=[...]"
    elif kind == "pressure":
        cure = "for readings of a sensor see papilla.sensors.Taxels"
    elif kind == "objects" and got[-1:] == (7,):
        cure = f"the hello names {due[0]} object(s), and each frame has a row of seven numbers for each of them"
    elif kind == "objects" and got[-2:] == (4, 4):
        cure = "papilla.frames.from_matrices makes poses of 4 x 4 matrices"
    else:
        cure = "see the method's text for what a frame holds"
    raise BadInput("frames", f"{said}; {cure}")


def frame(values: ArrayLike, due: tuple[int, ...], kind: str, number: int, factor: float) -> Map:
    """One frame of a series as float32 in the protocol's unit; raises BadInput naming frame and place."""
    array = numbers(values, "frames")
    if kind == "objects" and due[0] == 1 and array.shape == due[1:]:
        array = array[None]
    if array.shape != due:
        raise BadInput("frames", f"it has shape {array.shape}; {due} is due", number)
    result = in_unit(array, kind, factor)
    if not result.size:
        return result
    # A NaN among the values is the least and the greatest of them.
    least, greatest = float(result.min()), float(result.max())
    if not (math.isfinite(least) and math.isfinite(greatest)):
        raise BadInput("frames", f"{first(~np.isfinite(result), array)}; find out why, or leave the frame out", number)
    if least < 0.0 and _is_pressed(due, kind):
        why = "skin is pressed, never pulled: take the sensor's offset away, then np.maximum(frames, 0)"
        raise BadInput("frames", f"{first(result < 0, array)}; {why}", number)
    return result


def _is_pressed(due: tuple[int, ...], kind: str) -> bool:
    """Whether the values are pressure, and none of them is a part of a traction."""
    return kind == "pressure" and len(due) == 2


def every_frame(frames: NDArray[Any], due: tuple[int, ...], kind: str, factor: float, threads: int) -> float:
    """Looks at all frames of an array, and gives their greatest size; raises BadInput as `frame`."""
    step = max(1, _TOGETHER // max(1, math.prod(due)))
    is_pressed = _is_pressed(due, kind)

    def greatest(first: int, end: int) -> float:
        found = 0.0
        for at in range(first, end, step):
            some = in_unit(frames[at : min(at + step, end)], kind, factor)
            if not some.size:
                continue
            least, most = float(some.min()), float(some.max())
            if not (math.isfinite(least) and math.isfinite(most)) or (is_pressed and least < 0.0):
                for number in range(at, min(at + step, end)):
                    frame(frames[number], due, kind, number, factor)
            found = max(found, size_of(some, kind) if kind == "objects" else max(most, -least))
        return found

    count = len(frames)
    threads = min(threads, count * max(1, math.prod(due)) // _OF_A_THREAD)
    if threads <= 1:
        return greatest(0, count)
    with ThreadPoolExecutor(threads, "papilla-check") as pool:
        # In order, so that the first frame that is wrong is told.
        ends = [count * part // threads for part in range(threads + 1)]
        return max(pool.map(greatest, ends[:-1], ends[1:]))


def size_of(values: NDArray[np.float32], kind: str) -> float:
    """The greatest size of what has a unit."""
    if kind == "objects":
        values = values[..., :3]
    return max(float(values.max()), -float(values.min())) if values.size else 0.0


def in_unit(array: NDArray[Any], kind: str, factor: float) -> Map:
    """The values of a frame as float32 in the protocol's unit."""
    if factor != 1.0:
        # Of a pose the place has a unit, the quaternion has none.
        array = array.astype(np.float64)
        array[..., : 3 if kind == "objects" else None] *= factor
    result: Map = array.astype(np.float32, copy=False)
    return result


def first(wrong: NDArray[np.bool_], array: NDArray[Any]) -> str:
    """Where the first wrong value is."""
    place = tuple(int(i) for i in np.unravel_index(int(np.argmax(wrong)), wrong.shape))
    return f"{array[place]} at {list(place)} ({int(wrong.sum())} such values)"


def unit_factor(unit: str | None, kind: str) -> float:
    """The factor to the protocol's unit."""
    known = UNITS[kind]
    if unit is not None and unit not in known:
        raise BadInput("unit", f"{unit!r} is none of {', '.join(known)}")
    return 1.0 if unit is None else known[unit]


def ask_unit(greatest: float, kind: str, whose: str = "") -> None:
    """Raises BadInput where values are so small that another unit was probably meant."""
    doubt = unit_doubt(greatest, kind, whose)
    if doubt is None:
        return
    first, *others = UNITS[kind]
    meant = " or ".join(f"unit={other!r}" for other in others)
    raise BadInput("unit", f"{doubt}: give {meant} if that is meant, or unit={first!r} if the values are right")


def unit_doubt(greatest: float, kind: str, whose: str = "") -> str | None:
    """Words for values that are so small that another unit was probably meant."""
    if not 0.0 < greatest < _ASKED_BELOW[kind]:
        return None
    return f"the greatest value{whose} is {greatest:.3g}, which is little for {next(iter(UNITS[kind]))}"


def times_doubt(times_s: NDArray[np.float64]) -> str | None:
    """Words for times that are probably in another unit than s."""
    if len(times_s) < 3 or np.median(np.diff(times_s)) < _SLOW_S:
        return None
    step = f"{np.median(np.diff(times_s)):g}"
    return f"times: half of the frames are {step} s apart or more; were ms or numbers of frames meant?"


def times(values: ArrayLike, count: int | None) -> NDArray[np.float64]:
    """Times of frames, s: finite, rising by 1 us at least, as many as frames."""
    array = np.atleast_1d(given(values, "times", "times")[0].astype(np.float64))
    if array.ndim != 1 or (count is not None and len(array) != count):
        raise BadInput("times", f"shape {array.shape} for {count} frames; one time for each frame is due, in s")
    if not np.isfinite(array).all():
        raise BadInput("times", f"{first(~np.isfinite(array), array)}; each frame needs its time, in s")
    steps = np.diff(array)
    if (steps < 1e-6).any():
        at = int(np.argmax(steps < 1e-6))
        cure = "they have to rise by 1 us at least: sort the frames, and drop those that stand twice"
        raise BadInput("times", f"{array[at + 1]:.9g} s follows {array[at]:.9g} s; {cure}", at + 1)
    return array
