"""Input, truth and prediction of three indentations, and SED along a line.

After figure 4 of 'Toward Learning-Based Estimation of Strain Energy Density in a Fingertip from
Surface Pressure'.

Cells for Jupyter, VS Code or Spyder; also a script: `python figure4.py` writes figure4.png.
Needs matplotlib and a running papilla-server.
"""

# %% Indentations that the FE solver computed, and what the service makes of their pressure
import os

import matplotlib.pyplot as plt
import numpy as np

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
tier = "small-maps"
indentations = [papilla.indentation(number, url=url) for number in (0, 1, 2)]
predictions = [papilla.sed(indentation.pressure_pa, url=url, tier=tier) for indentation in indentations]


def error(found, truth):
    """Relative L2."""
    return np.linalg.norm(found - truth) / np.linalg.norm(truth)


# %% Figure 4: one row an indentation
figure, axes = plt.subplots(len(indentations), 4, figsize=(13, 3.1 * len(indentations)), layout="constrained")
inside = papilla.Atlas.load(url)  # the patch; everything else is no finger
mask = np.full(224 * 224, np.nan)
mask[inside.pixels] = 1.0
mask = mask.reshape(224, 224)
titles = ("pressure, kPa", "SED, FE (truth), kJ/m³", f"SED, {tier}, kJ/m³", "SED along the line, kJ/m³")
for axis, title in zip(axes[0], titles, strict=True):
    axis.set_title(title, fontsize=10)

for row, indentation, predicted in zip(axes, indentations, predictions, strict=True):
    truth = indentation.sed_j_per_m3
    top = 1e-3 * max(truth.max(), predicted.max())
    maps = ((indentation.pressure_pa, "magma", None), (truth, "viridis", top), (predicted, "viridis", top))
    line = int(np.unravel_index(truth.argmax(), truth.shape)[0])
    for axis, (map_, colours, most) in zip(row, maps, strict=False):
        image = axis.imshow(1e-3 * map_ * mask, cmap=colours, vmin=0, vmax=most)
        axis.axhline(line, color="white", linewidth=0.7, linestyle=":")
        axis.set_xticks([])
        axis.set_yticks([])
        figure.colorbar(image, ax=axis, shrink=0.8)
    row[0].set_xlabel(indentation.name, fontsize=8)
    row[2].set_xlabel(f"relative L2 {100 * error(predicted, truth):.1f} %", fontsize=8)
    row[3].plot(1e-3 * truth[line], color="black", label="FE")
    row[3].plot(1e-3 * predicted[line], color="tab:orange", linestyle="--", label=tier)
    row[3].set_xlim(0, 223)
    row[3].set_xlabel(f"column (row {line})", fontsize=8)
axes[0, 3].legend(fontsize=8)

# %% Keep it
figure.savefig("figure4.png", dpi=110)
