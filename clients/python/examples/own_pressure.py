"""A pressure that a sensor read: what finite elements and a network say of it, and which fibres fire.

Needs Papilla's wheel, and no service. Writes felt.npz, spikes.npz and own_pressure.png (matplotlib).
"""

import matplotlib.pyplot as plt
import numpy as np

import papilla
from papilla import afferents, fe, sensors

# In place of readings of your own: those of a virtual array of 13 x 12 taxels, under two bumps.
array = sensors.Taxels.grid(13, 12, pitch_mm=1.0, unit="kPa", url="local")
bumps = [papilla.Contact(at_mm=(11.25, y_mm, -6.5), force_n=0.05) for y_mm in (-1.5, 1.5)]
readings = np.nan_to_num(array.read(array.atlas.contacts(bumps)))
# A map of 224 x 224 that reproduces the readings.
pressure_pa = array.pressure(readings)

# A coarse mesh, to be quick; leave density and order out for one on which SED is good.
scene = {"geometry": {"kind": "fingertip", "density": "coarse", "order": "linear"}, "pressure": {"increments": 1}}
state = fe.Scene(scene, pressure=pressure_pa).run(fields=False)[-1]
network = papilla.Model().sed(pressure_pa)
print(f"{state.force_n[2]:.3f} N, {state.depth_mm:.2f} mm deep, flags {state.flags}")
print(f"SED at most {state.sed_j_per_m3.max():.0f} J/m3 by these elements, {network.max():.0f} J/m3 by the network")

times_s = 0.02 * np.arange(10)
share = np.minimum(times_s / 0.1, 1.0)[:, None, None]
# Linear in pressure, SED goes with the square.
trains = afferents.spikes(network * share**2, times_s, pressure_pa * share)
print(f"{len(trains.unit)} spikes of {len(np.unique(trains.unit))} units")
trains.save_npz("spikes.npz")
np.savez("felt.npz", pressure_pa=pressure_pa, fe=state.sed_j_per_m3, network=network)

figure, axes = plt.subplots(1, 4, figsize=(12, 3), layout="constrained", gridspec_kw={"width_ratios": (1, 1, 1, 1.1)})
maps = (
    ("pressure, kPa", pressure_pa, "magma"),
    ("SED by a coarse mesh, kJ/m³", state.sed_j_per_m3, "viridis"),
    ("SED by the network, kJ/m³", network, "viridis"),
)
for axis, (title, image, colours) in zip(axes, maps, strict=False):
    figure.colorbar(axis.imshow(1e-3 * image[40:160, 50:170], cmap=colours), ax=axis, shrink=0.8)
    axis.set(xticks=[], yticks=[])
    axis.set_title(title, fontsize=9)
for kind, colour in (("sa1", "tab:green"), ("ra", "tab:blue"), ("pc", "tab:orange")):
    mine = trains.classes[trains.unit] == kind
    axes[3].plot(1e-3 * trains.time_us[mine], trains.unit[mine], "|", color=colour, label=kind.upper())
axes[3].set(xlabel="time, ms", ylabel="nerve fibre")
axes[3].legend(fontsize=8)
figure.savefig("own_pressure.png", dpi=110)
