"""A hard case and its typed error: a press through a slab, the states up to its limit, and what a program is told.

Needs Papilla's wheel, and no service. Writes hard_case.png (matplotlib).
"""

import matplotlib.pyplot as plt

import papilla
from papilla import fe

# A slab of dermis 2 mm thick, into which a ball is to go 2.6 mm.
scene = {
    "geometry": {"kind": "block", "size_mm": [6.0, 6.0], "elements": [4, 4],
                 "layers": [{"tissue": "dermis", "thickness_mm": 2.0, "elements": 2}]},
    "indenter": {"shape": "sphere", "radius_mm": 4.0},
}  # fmt: skip
found = []
try:
    with fe.Scene(scene | {"motion": {"depth_mm": 2.6, "increments": 13}}).solve(fields=False) as solve:
        for state in solve:
            found[state.number :] = [state]
except papilla.NotSolved as error:
    failed = error
    print(f"NotSolved: {error}\nkind {error.kind}, aimed at {error.depth_mm:.2f} mm, {error.states} states kept")

# What makes no sense is refused before anything is solved, with its place.
try:
    fe.Scene(scene | {"indenter": {"shape": "sphere", "radius_mm": -4.0}, "motion": {"depth_mm": 1.0}})
except papilla.BadScene as error:
    refused = error
    print(f"BadScene: {error.field}: {error}")

depths_mm, forces_n = zip(*[(state.depth_mm, state.force_n[2]) for state in found], strict=True)
figure, axis = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
axis.plot(depths_mm, forces_n, "o-", label="states in equilibrium")
axis.axvspan(2.0, 2.8, color="0.9")
axis.axvline(failed.depth_mm, color="tab:red", linestyle=":", label=f"NotSolved, kind {failed.kind!r}")
axis.annotate("the slab ends at 2 mm", (2.02, 0.0), fontsize=9)
axis.set(xlabel="depth, mm", ylabel="force, N", xlim=(0, 2.8))
axis.legend(fontsize=9, loc="upper left")
figure.savefig("hard_case.png", dpi=110)
