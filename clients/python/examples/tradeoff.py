"""Accuracy against time on this machine: every model of the service, its error and its time here.

The errors are those that the service lists, against finite elements; the times are measured now, each the least of
several runs. Writes tradeoff.png (matplotlib).
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
names, errors, times_ms = [], [], []
for tier in listed["tiers"]:
    if tier["relative_l2_median"] is None:
        continue
    series = papilla.render(frames, url=url, tier=tier["name"], lanes=1)
    names.append(tier["name"])
    errors.append(100 * tier["relative_l2_median"])
    times_ms.append(1e-3 * series["infer_us"].min())
    print(f"{names[-1]:20} {errors[-1]:5.1f} % of SED, {times_ms[-1]:6.2f} ms")

best = np.minimum.accumulate(np.array(errors)[np.argsort(times_ms)])
figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
axis.step(np.sort(times_ms), best, where="post", color="0.7", zorder=0)
axis.plot(times_ms, errors, "o")
for rank, i in enumerate(np.argsort(times_ms)):
    side = "right" if times_ms[i] > 100 else "left"
    place = (-6 if side == "right" else 6, 6 if rank % 2 else -12)
    axis.annotate(names[i], (times_ms[i], errors[i]), textcoords="offset points", xytext=place, ha=side, fontsize=9)
axis.set(xscale="log", ylim=(0, None), xlabel="time of the network for one map on this machine, ms")
axis.set_ylabel(f"median error of SED on the set {listed['judged_on']}, %", fontsize=9)
axis.margins(x=0.2)
figure.savefig("tradeoff.png", dpi=110)
