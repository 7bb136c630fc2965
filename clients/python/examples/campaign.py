"""Many simulations in one call: a campaign, its dataset as arrays, and how force depends on depth and pose.

Needs Papilla's wheel, and no service. Run it again, and it goes on where it was: what is solved stays solved. Writes
the folder balls and campaign.png (matplotlib).
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from papilla import fe

campaign = fe.Campaign({
    "name": "balls", "seed": 5, "presses": int(os.environ.get("PRESSES", "8")),
    "depths_mm": [0.2, 0.4, 0.6, 0.8], "test_fraction": 0.25,
    # Coarse, to be quick; leave both out for the mesh on which SED is good.
    "density": "coarse", "order": "linear",
    "indenters": [
        {"name": "ball of 3 mm", "indenter": {"shape": "sphere", "radius_mm": 3.0}},
        {"name": "ball of 8 mm", "indenter": {"shape": "sphere", "radius_mm": 8.0}},
    ],
    "pose": {"pitch_deg": [0.0, 40.0], "roll_deg": [-15.0, 15.0], "yaw_deg": [0.0, 0.0]},
})  # fmt: skip
print(campaign.explain())
print(campaign.run("balls", progress=True))
dataset = campaign.dataset("balls")

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for press in dataset.presses():
    small = "3" in press.entry["indenter"]
    force_n = np.linalg.norm(press.arrays["force_n"], axis=1)
    left.plot(press.arrays["depth_mm"], force_n, "o-", ms=3, color="tab:blue" if small else "tab:orange")
left.plot([], [], color="tab:blue", label="ball of 3 mm")
left.plot([], [], color="tab:orange", label="ball of 8 mm")
left.set(xlabel="depth, mm", ylabel="force, N", title=f"{len(dataset)} states in random poses")
left.legend(fontsize=8)
states = dataset.arrays(maps=["sed_dermis_j_per_m3"])
right.imshow(1e-3 * states["sed_dermis_j_per_m3"].max(axis=0))
right.set(xticks=[], yticks=[], title="greatest SED of all states, by place")
figure.savefig("campaign.png", dpi=110)
