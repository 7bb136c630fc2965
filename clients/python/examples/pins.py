"""Actuators: what an array of pins has to do so that a finger feels a ring, by a formula and by a fit.

Needs Papilla's wheel, and no service. Writes pins.png (matplotlib).
"""

import matplotlib.pyplot as plt
import numpy as np

import papilla

# The end of a tube, 6 mm across, touches the pad.
finger = papilla.Finger()
ring = {"shape": {"shape": "ring", "outer_radius_mm": 3.5, "inner_radius_mm": 2.5}}
touched = finger.touch(ring, [11.25, 0.0, -6.53 + 0.7, 0, 0, 0, 1])
sed = papilla.Model().sed(touched.pressure_pa)

# Pins 1.5 mm apart, wherever the skin over them is near.
atlas = finger.atlas()
places = [(11.25 + 1.5 * i, 1.5 * j) for i in range(-4, 5) for j in range(-4, 5)]
pad = atlas.places_mm[:, 2] < 0
skin, pixels = atlas.places_mm[pad], atlas.pixels[pad]
own = [int(np.argmin((skin[:, 0] - x) ** 2 + (skin[:, 1] - y) ** 2)) for x, y in places]
px = [[float(pixels[at] % 224) + 0.5, float(pixels[at] // 224) + 0.5] for at in own]
layout = {"radius_mm": 0.5, "gain": 1.0, "actuators": [{"at": {"px": place}} for place in px]}
# The formula drives each pin by the SED over it; the fit finds pressures whose SED is the wanted one.
driven = {
    "formula": papilla.actuators.intensities(sed, layout=layout | {"drive": "formula", "max": 1e9}),
    "fit": papilla.actuators.intensities(sed, layout=layout | {"drive": "fitted", "max": 1e9}),
}
for name, values in driven.items():
    print(f"by the {name} {(values > 0.5 * values.max()).sum()} of {len(px)} pins are driven by more than a half")

figure, axes = plt.subplots(1, 3, figsize=(10, 3.4), layout="constrained")
figure.colorbar(axes[0].imshow(1e-3 * sed), ax=axes[0], shrink=0.85, label="kJ/m³")
axes[0].set_title("SED of the ring", fontsize=10)
for axis, (name, values) in zip(axes[1:], driven.items(), strict=True):
    axis.imshow(1 - sed / sed.max(), cmap="gray", vmin=-1.5, vmax=1)
    pins = axis.scatter(*np.array(px).T, s=60, c=values / values.max(), cmap="viridis", vmin=0, vmax=1)
    axis.set_title(f"pins, by the {name}", fontsize=10)
figure.colorbar(pins, ax=axes[1:], shrink=0.85, label="intensity over the greatest")
for axis in axes:
    axis.set(xticks=[], yticks=[], xlim=(55, 165), ylim=(172, 66))
figure.savefig("pins.png", dpi=110)
