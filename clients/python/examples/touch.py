"""First touch: a ball that goes down on a finger, what pushes back, and what lies under the skin.

Writes touch.png (matplotlib).
"""

import os

import matplotlib.pyplot as plt

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
ball = {"shape": {"shape": "sphere", "radius_mm": 10.0}}
hello = {"input": "objects", "objects": [ball], "pressure": "map"}
depths_mm, forces_n = [], []
with papilla.local(**hello) if url == "local" else papilla.Session(url, **hello) as session:
    for step in range(11):
        depth_mm = 0.1 * step
        # The pad's lowest point is at (11.25, 0, -6.53); a ball's origin is its centre.
        answer = session.touch([11.25, 0.0, -16.53 + depth_mm, 0, 0, 0, 1])
        if answer.touch is None:
            # Lost, late or refused: an actuator goes to zero, and the next frame is tried.
            print(f"{depth_mm:.1f} mm: no force, the frame is {answer.status}")
            continue
        print(f"{depth_mm:.1f} mm: {answer.touch.force_n[2]:.3f} N on {answer.touch.area_mm2:.1f} mm2")
        depths_mm.append(depth_mm)
        forces_n.append(answer.touch.force_n[2])

figure, axes = plt.subplots(1, 3, figsize=(10, 3.2), layout="constrained")
axes[0].plot(depths_mm, forces_n, "o-")
axes[0].set(xlabel="depth, mm", ylabel="force, N")
maps = (("pressure on the skin, kPa", answer.pressure_pa, "magma"), ("SED under it, kJ/m³", answer.sed, "viridis"))
for axis, (title, image, colours) in zip(axes[1:], maps, strict=True):
    figure.colorbar(axis.imshow(1e-3 * image, cmap=colours), ax=axis, shrink=0.9)
    axis.set(xticks=[], yticks=[], title=title)
figure.savefig("touch.png", dpi=110)
