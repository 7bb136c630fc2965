"""A ball rolls over a finger: a series of poses in one call, as numbers and as a file.

Writes series.csv and series.png (matplotlib); with `papilla[xarray]` also series.nc.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
ball = {"shape": {"shape": "sphere", "radius_mm": 4.0}}
count = 60
times_s = 0.01 * np.arange(count)
poses = np.tile([11.25, 0.0, -9.8, 0.0, 0.0, 0.0, 1.0], (count, 1))
poses[:, 0] = np.linspace(5.0, 17.0, count)
series = papilla.render(
    poses, times_s, url=url, input="objects", objects=[ball], pressure="map", effects=["summary", "afferents"]
)
series.to_csv("series.csv")
try:
    series.to_netcdf("series.nc")
except papilla.MissingExtra as error:
    print(error)
print(f"{len(series)} frames in {series.seconds:.2f} s, force {series.force_n[:, 2].max():.2f} N at most")

figure = plt.figure(figsize=(9, 5.4), layout="constrained")
grid = figure.add_gridspec(2, 4)
for column, frame in enumerate((14, 24, 34, 44)):
    axis = figure.add_subplot(grid[0, column])
    drawn = axis.imshow(1e-3 * series.sed[frame, 60:160, 60:160], vmin=0, vmax=1e-3 * series.sed.max())
    axis.set(xticks=[], yticks=[], title=f"{1e3 * times_s[frame]:.0f} ms")
figure.colorbar(drawn, ax=figure.axes, shrink=0.8, label="SED, kJ/m³")
axis = figure.add_subplot(grid[1, :])
axis.plot(times_s, series.force_n[:, 2], color="tab:blue")
axis.set(xlabel="time, s", ylabel="force, N", ylim=(0, None))
other = axis.twinx()
other.plot(times_s, series["summary_sa1_rate_hz"], color="tab:green")
other.set_ylabel("all SA1 afferents, spikes/s", color="tab:green")
other.set_ylim(0, None)
figure.savefig("series.png", dpi=110)
