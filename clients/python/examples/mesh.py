"""A mesh of one's own presses on the finger: a bolt head from an STL file. Needs `papilla[meshes]`.

python examples/mesh.py [FILE [UNIT]]      without FILE it makes one. Writes mesh.png (matplotlib)
"""

import os
import sys

import matplotlib.pyplot as plt
import numpy as np

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
if len(sys.argv) > 1:
    part = papilla.meshes.load(sys.argv[1], unit=sys.argv[2] if len(sys.argv) > 2 else None)
else:
    import trimesh

    head = trimesh.creation.cylinder(radius=5.0, height=4.0, sections=6)
    for _ in range(3):
        head = head.subdivide()
    head.export("bolt.stl")
    part = papilla.meshes.load("bolt.stl", unit="mm")
print(f"{part.triangles} triangles, {np.round(np.ptp(part.bounds_mm, axis=0), 1).ravel()} mm")
for note in part.notes:
    print(f"note: {note}")

depths_mm = np.linspace(0.0, 1.2, 13)
poses = np.array([part.under_pad(depth) for depth in depths_mm])
series = papilla.render(poses, url=url, input="objects", objects=[part.object()], pressure="map")
print(f"{series.force_n[-1, 2]:.2f} N at {depths_mm[-1]:.1f} mm")

figure, axes = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
axes[0].plot(depths_mm, series.force_n[:, 2], marker="o")
axes[0].set(xlabel="depth, mm", ylabel="force, N")
for axis, image, title in (
    (axes[1], series["pressure_pa"][-1], "pressure, kPa"),
    (axes[2], series.sed[-1], "SED, kJ/m³"),
):
    figure.colorbar(axis.imshow(1e-3 * image, cmap="magma" if "press" in title else "viridis"), ax=axis, shrink=0.9)
    axis.set(xticks=[], yticks=[], title=title)
figure.savefig("mesh.png", dpi=110)
