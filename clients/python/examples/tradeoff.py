"""Accuracy against time on this machine: every model of the service, its errors and its time here.

The errors are those that the service lists, against finite elements: one from maps of pressure, and one from poses,
whose pressure the service finds. Which of the two a model learnt is printed beside them. The times are of the networks
alone, measured now, each the least of several runs. Writes tradeoff.png (matplotlib).
"""

import os

import matplotlib.pyplot as plt
import numpy as np

import papilla
from papilla.http import get_json

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
runs = int(os.environ.get("RUNS", "15"))
listed = get_json(url, "/v1/tiers")
press = papilla.indentation(0, url=url).pressure_pa
frames = np.repeat(press[None], runs, axis=0)
names = [tier["name"] for tier in listed["tiers"]]
times_ms = [1e-3 * papilla.render(frames, url=url, tier=name, lanes=1)["infer_us"].min() for name in names]
# Not a number where the service does not know the error.
of_maps, of_poses = (
    100 * np.array([tier[member] for tier in listed["tiers"]], dtype=float)
    for member in ("relative_l2_median", "relative_l2_median_from_poses")
)
for tier, time_ms, of_map, of_pose in zip(listed["tiers"], times_ms, of_maps, of_poses, strict=True):
    print(
        f"{tier['name']:20} learnt {tier['learnt']:8} {of_map:5.1f} % of SED from maps, "
        f"{of_pose:5.1f} % from poses, {time_ms:6.2f} ms"
    )

figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
order = np.argsort(times_ms)
kinds = [
    (of_maps, "o", f"from maps of pressure (set {listed['judged_on']})"),
    (of_poses, "s", "from poses (set poses)"),
]
for errors, marker, label in kinds:
    if np.isnan(errors).all():
        continue
    (dots,) = axis.plot(times_ms, errors, marker, label=label)
    # Nothing that is faster errs less.
    best = np.fmin.accumulate(errors[order])
    axis.step(np.sort(times_ms), best, where="post", color=dots.get_color(), alpha=0.4, zorder=0)
axis.vlines(times_ms, np.fmin(of_maps, of_poses), np.fmax(of_maps, of_poses), color="0.8", zorder=0)
for rank, i in enumerate(order):
    side = "right" if times_ms[i] > 100 else "left"
    place = (-6 if side == "right" else 6, 6 if rank % 2 else -12)
    at = (times_ms[i], np.fmax(of_maps, of_poses)[i])
    axis.annotate(names[i], at, textcoords="offset points", xytext=place, ha=side, fontsize=9)
axis.set(xscale="log", ylim=(0, None), xlabel="time of the network for one map on this machine, ms")
axis.set_ylabel("median error of SED, %")
axis.legend(fontsize=9)
axis.margins(x=0.2)
figure.savefig("tradeoff.png", dpi=110)
