"""A plate's pressure is held for four seconds: the skin gives way, and fibres that adapt slowly go on firing.

Writes hold.png (matplotlib).
"""

import os

import matplotlib.pyplot as plt
import numpy as np

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
times_s = np.concatenate([np.linspace(0, 0.1, 11), np.linspace(0.15, 4.0, 78)])
# A plate's face lies 3 mm above its origin, the pad's lowest point at z = -6.53 mm: 2 mm deep, 1.9 N.
plate, pose = {"shape": {"shape": "plate"}}, [11.25, 0.0, -9.53 + 2.0, 0, 0, 0, 1]
pressed = papilla.render([pose], url=url, input="objects", objects=[plate], pressure="map", map=False)
press = pressed["pressure_pa"][0]
frames = np.minimum(times_s / 0.1, 1.0)[:, None, None] * press
held = {}
for tissue in (None, "skin", "subcutaneous"):
    creep = (
        {} if tissue is None else {"effects": ["relaxation", "summary", "afferents"], "relaxation": {"tissue": tissue}}
    )
    held[tissue] = papilla.render(frames, times_s, url=url, **(creep or {"effects": ["summary", "afferents"]}))

figure, axes = plt.subplots(2, 1, figsize=(7, 5.5), sharex=True, layout="constrained")
for tissue, series in held.items():
    label = "without relaxation" if tissue is None else f"relaxation of {tissue} tissue"
    axes[0].plot(times_s, 1e-3 * series["summary_sed_max_j_per_m3"], label=label)
    axes[1].plot(times_s, series["summary_sa1_rate_hz"], label=label)
axes[0].set(ylabel="greatest SED, kJ/m³", ylim=(0, None))
axes[1].set(xlabel="time, s", ylabel="all SA1 afferents, spikes/s", yscale="log", ylim=(10, None))
axes[0].legend()
figure.savefig("hold.png", dpi=110)
grown = held["subcutaneous"]["summary_sed_max_j_per_m3"]
share = 100 * (grown[-1] / grown[10] - 1)
print(f"SED grows by {share:.0f} % in {times_s[-1] - times_s[10]:.1f} s under a held pressure")
