"""Accuracy against time on this machine: every model of the service, its errors and its time here.

The errors are those that the service lists, against finite elements: one from maps of pressure, and one from poses,
whose pressure the service finds. Both are printed of every model; the picture has, of each, the models that learnt such
pressure. The times are of the networks alone, measured now, each the least of several runs. Writes tradeoff.png
(matplotlib).
"""

import logging
import os

import matplotlib.pyplot as plt
import numpy as np

import papilla
from papilla.http import get_json

# The service says of a model that it learnt something else than the maps by which times are measured: that is known.
logging.getLogger("papilla").setLevel(logging.ERROR)
url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
runs = int(os.environ.get("RUNS", "15"))
listed = get_json(url, "/v1/tiers")
press = papilla.indentation(0, url=url).pressure_pa
frames = np.repeat(press[None], runs, axis=0)
names = [tier["name"] for tier in listed["tiers"]]
learnt = [tier["learnt"] for tier in listed["tiers"]]
times_ms = [1e-3 * papilla.render(frames, url=url, tier=name, lanes=1)["infer_us"].min() for name in names]
# Not a number where the service does not know the error.
of_maps, of_poses = (
    100 * np.array([tier[member] for tier in listed["tiers"]], dtype=float)
    for member in ("relative_l2_median", "relative_l2_median_from_poses")
)
for name, what, time_ms, of_map, of_pose in zip(names, learnt, times_ms, of_maps, of_poses, strict=True):
    print(f"{name:20} learnt {what:8} {of_map:5.1f} % of SED from maps, {of_pose:5.1f} % from poses, {time_ms:6.2f} ms")

figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained", sharex=True, sharey=True)
panels = [
    (f"from maps of pressure (set {listed['judged_on']})", "contact", of_maps),
    ("from poses (set poses)", "fe", of_poses),
]
for axis, (title, other, errors) in zip(axes, panels, strict=True):
    shown = [i for i in np.argsort(times_ms) if learnt[i] != other and errors[i] > 0]
    at_ms, off = np.array(times_ms)[shown], errors[shown]
    # Nothing that is faster errs less.
    axis.step(at_ms, np.minimum.accumulate(off), where="post", color="0.7", zorder=0)
    axis.plot(at_ms, off, "o")
    for rank, i in enumerate(shown):
        side = "right" if times_ms[i] > 30 else "left"
        place = (-6 if side == "right" else 6, 6 if rank % 2 else -12)
        axis.annotate(names[i], (times_ms[i], errors[i]), textcoords="offset points", xytext=place, ha=side, fontsize=9)
    axis.set_title(title, fontsize=10)
    axis.set_xlabel("time of the network for one map on this machine, ms", fontsize=9)
axes[0].set(xscale="log", ylim=(0, None), ylabel="median error of SED, %")
axes[0].margins(x=0.2)
figure.savefig("tradeoff.png", dpi=110)
