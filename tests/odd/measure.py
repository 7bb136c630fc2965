"""How far odd maps lie from the presses that the shipped networks learnt: five numbers of a pressure map.

    PYTHONPATH=model-export/trainer python tests/odd/measure.py     from the root of the repository; numpy, and fe-datagen
    in PATH or FE_DATAGEN, which draws the maps when they are first needed; then ten seconds

Roughness: squared steps between neighbouring pixels over four times the squared pressures, 0 (flat) to 1 (every
pixel against its neighbours). Load: sum of pressure times pixel, near the force in another unit. Their product. Area:
square of the sum of the pressures over the sum of their squares, in pixels. Contrast: roughness of the steps between
pixels that are both pressed, times the area, in pixels.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from papilla_trainer.dataset import Dataset

SIDE_PX = 224
DATA = Path("data")
# Fitted to; only looked at.
TRAINED, OTHERS = ("more-graded", "broad-graded", "pressed-graded", "hard-graded", "proximal-graded"), ("heldout-graded", "final")
# Room beyond the greatest of the training, as proto/src/input_statistics.rs has it.
HEADROOM = np.array([1.05, 1.05, 2.0, 1.5, 1.5])
WORDS = ("rougher", "heavier", "rougher for its load", "wider", "richer in contrast")
ODD_PA = 10_000.0

Map = NDArray[np.float32]


def presses(name: str) -> Iterator[Map]:
    """Every pressure map of a dataset."""
    dataset = Dataset(DATA / name)
    yield from dataset.load(sorted(dataset.presses)).pressure_pa.reshape(-1, SIDE_PX, SIDE_PX)


def numbers(pressure_pa: Map) -> tuple[float, float, float, float, float]:
    """Roughness, load in MPa px, their product, area in px, contrast in px."""
    is_pressed = pressure_pa > 0
    steps = inner = 0.0
    for axis in (0, 1):
        squared = np.square(np.diff(pressure_pa, axis=axis), dtype=np.float64)
        rows = np.moveaxis(is_pressed, axis, 0)
        steps += squared.sum()
        inner += (squared * np.moveaxis(rows[1:] & rows[:-1], 0, axis)).sum()
    total, squares = pressure_pa.sum(dtype=np.float64), np.square(pressure_pa, dtype=np.float64).sum()
    rough, load = steps / (4.0 * squares), float(total) * 1e-6
    return rough, load, rough * load, total**2 / squares, inner / (4.0 * squares) * total**2 / squares


def odd_maps() -> Iterator[tuple[str, Map]]:
    """Maps within the range of pressure that no press makes."""
    skin = np.zeros(SIDE_PX * SIDE_PX, np.float32)
    skin[np.load(DATA / "broad-graded" / "raster.npz")["skin_pixel"]] = ODD_PA
    skin = skin.reshape(SIDE_PX, SIDE_PX)
    rows, columns = np.mgrid[:SIDE_PX, :SIDE_PX]
    for square_px in (1, 2, 4, 8, 16, 32):
        yield f"checkerboard, {square_px} px", skin * ((rows // square_px + columns // square_px) % 2).astype(np.float32)
    yield "noise", skin * np.random.default_rng(0).random(skin.shape, np.float32)
    yield "all skin alike", skin
    for block_px in (15, 29, 58):
        side = SIDE_PX // block_px + 1
        blocks = np.random.default_rng(0).random((side, side), np.float32).repeat(block_px, 0).repeat(block_px, 1)
        yield f"random blocks, {block_px} px", skin * blocks[:SIDE_PX, :SIDE_PX]
        part = np.maximum(abs(rows - SIDE_PX // 2), abs(columns - SIDE_PX // 2)) < 45
        yield f"random blocks, {block_px} px, on 90 x 90", skin * part * blocks[:SIDE_PX, :SIDE_PX]
    from_centre_px = np.hypot(rows + 0.5 - SIDE_PX / 2, columns + 0.5 - SIDE_PX / 2)
    for radius_px in (3, 8, 20):
        yield f"disc, {radius_px} px", (ODD_PA * (from_centre_px <= radius_px)).astype(np.float32)


def main() -> None:
    """Prints a table."""
    found = {name: np.array([numbers(one) for one in presses(name)]) for name in TRAINED + OTHERS}
    most = HEADROOM * np.concatenate([found[name] for name in TRAINED]).max(axis=0)
    print("| maps | number | greatest roughness | greatest load, MPa px | greatest rough load, MPa px | greatest area, px | greatest contrast, px | flagged |")
    print("|---|---|---|---|---|---|---|---|")
    for name, rows in found.items():
        rough, load, both, area, contrast = rows.max(axis=0)
        flagged = f"{100 * np.mean((rows > most).any(axis=1)):.1f} %"
        print(f"| `{name}` | {len(rows)} | {rough:.3f} | {load:.1f} | {both:.2f} | {area:.0f} | {contrast:.1f} | {flagged} |")
    for name, drawn in odd_maps():
        rough, load, both, area, contrast = numbers(drawn)
        words = [word for word, is_beyond in zip(WORDS, (rough, load, both, area, contrast) > most, strict=True) if is_beyond]
        print(f"| {name}, {ODD_PA / 1000:.0f} kPa | 1 | {rough:.3f} | {load:.1f} | {both:.2f} | {area:.0f} | {contrast:.1f} | {', '.join(words) or 'no'} |")


if __name__ == "__main__":
    main()
