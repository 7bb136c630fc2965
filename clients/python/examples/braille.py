"""A finger reads a word in Braille: every spike of its nerve fibres, drawn where on the page it was fired.

A unit that fires is somewhere on the finger, and the finger somewhere on the page. If each spike is drawn at that
place, fibres that resolve the dots draw the dots again. Writes braille.png (matplotlib).
"""

import os

import matplotlib.pyplot as plt
import numpy as np

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
word = os.environ.get("WORD", "papilla")
letters = {"a": "1", "i": "24", "l": "123", "p": "1234"}
speed_mm_per_s, depth_mm, rate_hz = 30.0, 0.8, 100.0

# Standard cells: dots 1 to 3 down the left column, 4 to 6 down the right. On the page x runs to the right, y up.
dots_mm = np.array(
    [
        (6.2 * cell + 2.34 * ((dot - 1) // 3), -2.34 * ((dot - 1) % 3) + 2.34)
        for cell, letter in enumerate(word)
        for dot in map(int, letters[letter])
    ]
)
width_mm = 6.2 * len(word) - 3.9
# A dot is a cap .48 mm high and 1.44 mm wide: the top of this ball. The tops lie at z = 0.
radius_mm = (0.72**2 + 0.48**2) / (2 * 0.48)
# The finger points up the page: its y is the page's x, and its x runs down the page.
parts = [
    {"part": {"shape": "sphere", "radius_mm": radius_mm}, "at_mm": [-up, right, -radius_mm]} for right, up in dots_mm
]
page = {"part": {"shape": "plate", "size_mm": [30.0, width_mm + 60.0]}, "at_mm": [0, 0.5 * width_mm, -3.48]}
text = {"shape": {"shape": "union", "parts": [page, *parts]}}

# The text slides along -y under the finger.
way_mm = np.arange(-8.0, width_mm + 8.0, speed_mm_per_s / rate_hz)
times_s = np.arange(len(way_mm)) / rate_hz
poses = np.tile([11.25, 0.0, -6.53 + depth_mm, 0.0, 0.0, 0.0, 1.0], (len(way_mm), 1))
poses[:, 1] = -way_mm
series = papilla.render(
    poses, times_s, url=url, input="objects", objects=[text], effects=["spikes"], spikes={"noise": True}, map=False,
    method="pixels", progress=True,
)  # fmt: skip
trains, atlas = series.spikes, papilla.Atlas.load(url)
print(f"{len(series)} frames, {len(trains.unit)} spikes, {series.force_n[:, 2].mean():.2f} N")

# Where each unit is on the finger, and where the finger was on the page.
centres = np.stack([atlas.pixels % 224, atlas.pixels // 224], axis=1) + 0.5
nearest = [int(np.argmin(((centres - px) ** 2).sum(axis=1))) for px in trains.px]
units_mm = atlas.places_mm[nearest]
figure, axes = plt.subplots(3, 1, figsize=(8.5, 5.2), sharex=True, sharey=True, layout="constrained")
axes[0].scatter(*dots_mm.T, s=45, color="0.3")
axes[0].set_title(f"the page: “{word}”", fontsize=10)
for axis, kind, colour in zip(axes[1:], ("sa1", "ra"), ("tab:green", "tab:blue"), strict=True):
    mine = trains.classes[trains.unit] == kind
    at_mm = np.interp(1e-6 * trains.time_us[mine], times_s, way_mm)
    x_mm, y_mm = units_mm[trains.unit[mine], :2].T
    axis.plot(at_mm + y_mm, 11.25 - x_mm, ".", ms=1.5, color=colour, alpha=0.6)
    axis.set_title(f"{kind.upper()}: {mine.sum()} spikes of {np.unique(trains.unit[mine]).size} units", fontsize=10)
for axis in axes:
    axis.set(xlim=(-6, width_mm + 6), ylim=(-6, 6), ylabel="up the page, mm", aspect="equal")
axes[-1].set_xlabel("along the line, mm")
figure.savefig("braille.png", dpi=110)
