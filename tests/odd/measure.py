"""How far odd maps lie from the presses that the shipped models were trained on: two numbers of a pressure map.

    python tests/odd/measure.py        from the root of the repository; numpy; a quarter of a minute

Roughness: squared steps between neighbouring pixels over four times the squared pressures, 0 (flat) to 1 (every
pixel against its neighbours). Load: sum of pressure times pixel, near the force in another unit.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIDE_PX = 224
DATA = Path("data")
# Fitted to; only looked at.
TRAINED, OTHERS = ("s1", "broad"), ("heldout", "deep")
ODD_PA = 10_000.0

Map = NDArray[np.float32]


def presses(name: str) -> Iterator[Map]:
    """Every pressure map of a dataset, drawn as its table of pixels says."""
    table = np.load(DATA / name / "raster.npz")
    pixels, corners, weights = (table[f"skin_{part}"] for part in ("pixel", "vertex", "weight"))
    for shard in sorted((DATA / name / "shards").glob("*.npz")):
        for values in np.load(shard)["pressure_pa"]:
            if values.max() > 0:
                drawn = np.zeros(SIDE_PX * SIDE_PX, np.float32)
                drawn[pixels] = (values[corners] * weights).sum(axis=1)
                yield drawn.reshape(SIDE_PX, SIDE_PX)


def numbers(pressure_pa: Map) -> tuple[float, float]:
    """Roughness, and load in MPa px."""
    down, right = np.diff(pressure_pa, axis=0), np.diff(pressure_pa, axis=1)
    steps = np.square(down, dtype=np.float64).sum() + np.square(right, dtype=np.float64).sum()
    squares = np.square(pressure_pa, dtype=np.float64).sum()
    return steps / (4.0 * squares), float(pressure_pa.sum(dtype=np.float64)) * 1e-6


def odd_maps() -> Iterator[tuple[str, Map]]:
    """Maps within the range of pressure that no press makes."""
    skin = np.zeros(SIDE_PX * SIDE_PX, np.float32)
    skin[np.load(DATA / "s1" / "raster.npz")["skin_pixel"]] = ODD_PA
    skin = skin.reshape(SIDE_PX, SIDE_PX)
    rows, columns = np.mgrid[:SIDE_PX, :SIDE_PX]
    for square_px in (1, 2, 4, 8, 16, 32):
        yield f"checkerboard, {square_px} px", skin * ((rows // square_px + columns // square_px) % 2).astype(np.float32)
    yield "noise", skin * np.random.default_rng(0).random(skin.shape, np.float32)
    yield "all skin alike", skin
    from_centre_px = np.hypot(rows + 0.5 - SIDE_PX / 2, columns + 0.5 - SIDE_PX / 2)
    for radius_px in (3, 8, 20):
        yield f"disc, {radius_px} px", (ODD_PA * (from_centre_px <= radius_px)).astype(np.float32)


def main() -> None:
    """Prints a table."""
    found = {name: np.array([numbers(one) for one in presses(name)]) for name in TRAINED + OTHERS}
    most = np.concatenate([found[name] for name in TRAINED]).max(axis=0)
    print("| maps | | roughness, up to | load, up to (MPa px) | beyond the trained |")
    print("|---|---|---|---|---|")
    for name, rows in found.items():
        beyond = np.mean((rows > most).any(axis=1))
        rough, load = rows.max(axis=0)
        print(f"| `{name}` | {len(rows)} | {rough:.3f} | {load:.1f} | {100 * beyond:.1f} % |")
    for name, drawn in odd_maps():
        rough, load = numbers(drawn)
        words = [word for word, is_beyond in (("rougher", rough > most[0]), ("heavier", load > most[1])) if is_beyond]
        print(f"| {name}, {ODD_PA / 1000:.0f} kPa | 1 | {rough:.3f} | {load:.1f} | {', '.join(words) or 'no'} |")


if __name__ == "__main__":
    main()
