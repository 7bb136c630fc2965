"""Taps a finger ten times a second for a second and writes who fired when: spikes.npz, spikes.png (matplotlib)."""

import os

import numpy as np

import papilla

row, column = np.mgrid[:224, :224]
shape = np.clip(1 - ((column - 118.0) ** 2 + (row - 105.0) ** 2) / 900, 0, None)
url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
hello = {"tier": "half-space", "effects": ["spikes"], "map": False}
with papilla.local(**hello) if url == "local" else papilla.Session(url, **hello) as session:
    trains = papilla.SpikeTrains(session.ready)
    for ms in range(1000):
        # 20 kPa at most, in touch for half of each 100 ms.
        pressure_pa = 2e4 * max(0.0, np.sin(2 * np.pi * ms / 100)) * shape
        trains.add(session.render(pressure_pa, client_time_us=1000 * ms))
trains.save_npz("spikes.npz")
print(f"{len(trains.unit)} spikes of {len(trains.classes)} units, {trains.lost} lost")

try:
    import matplotlib.pyplot as plt
except ImportError:
    raise SystemExit("spikes.png needs matplotlib") from None
figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
for kind, colour in (("sa1", "tab:green"), ("ra", "tab:blue"), ("pc", "tab:orange")):
    mine = trains.classes[trains.unit] == kind
    axes.plot(1e-3 * trains.time_us[mine], trains.unit[mine], "|", ms=2, c=colour, label=kind.upper())
axes.set(xlabel="time, ms", ylabel="unit", xlim=(0, 1000))
axes.legend(loc="upper right")
figure.savefig("spikes.png", dpi=150)
