"""What an effect is worth: each effect of a scene left out by itself, and what that changes.

Needs Papilla's wheel, and no service. Writes effect_worth.png (matplotlib).
"""

import matplotlib.pyplot as plt

from papilla import fe

# A coarse mesh, to be quick: what an effect changes depends little on it.
scene = fe.Scene({
    "geometry": {"kind": "fingertip", "density": "coarse", "order": "linear"},
    "indenter": {"shape": "sphere", "radius_mm": 4.0},
    "motion": {"depth_mm": 0.8, "increments": 1},
    "effects": ["finite_strain", "layers", "nail"],
})  # fmt: skip
print(scene.explain())
found = scene.effects(solve=True, progress=True)
for effect in found:
    if effect.why_not is not None:
        print(f"{effect.name} cannot be left out: {effect.why_not}")
        continue
    print(f"without {effect.name:14} SED changes by {100 * effect.sed_change:5.1f} %, "
          f"force by {100 * effect.force_change:5.1f} %; {effect.seconds_without:.2f} s "
          f"in place of {effect.seconds_with:.2f} s")  # fmt: skip
found = [effect for effect in found if effect.why_not is None]

rows = range(len(found))
figure, axis = plt.subplots(figsize=(7, 2.8), layout="constrained")
axis.barh([row - 0.2 for row in rows], [100 * effect.sed_change for effect in found], 0.4, label="map of SED")
axis.barh([row + 0.2 for row in rows], [100 * effect.force_change for effect in found], 0.4, label="force")
axis.set_yticks(rows, [f"without {effect.name.replace('_', ' ')}" for effect in found])
axis.set(xlabel="change against the scene with all of them, % (relative L2)")
axis.legend(fontsize=9)
figure.savefig("effect_worth.png", dpi=110)
