"""The afferents of a hand: five fingers grip a bottle, and which fibres of which finger fire.

Thumb and fingers press with the forces of a grip that rises within .3 s and is held. Writes hand.png (matplotlib).
"""

import os

import matplotlib.pyplot as plt
import numpy as np

import papilla

url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
# Widths of the fingers over that of the default finger; the thumb opposes all others.
hand = {"thumb": (1.2, 1.6), "index": (1.0, 0.6), "middle": (1.0, 0.5), "ring": (0.95, 0.3), "little": (0.85, 0.2)}
# A bottle 66 mm across lies along the finger's y, its lowest point of contact under the pad.
bottle = {"shape": {"shape": "cylinder", "radius_mm": 33.0, "length_mm": 120.0}}
pose = [11.25, 0.0, -6.53 - 33.0, 0.0, 0.0, 0.0, 1.0]
hello = {
    "input": "objects", "objects": [bottle], "force_target": True, "effects": ["spikes"],
    "fingers": [{"width": width} for width, _ in hand.values()],
}  # fmt: skip
count = int(os.environ.get("FRAMES", "60"))
times_s = np.linspace(0.0, 0.6, count)
session = papilla.local(**hello) if url == "local" else papilla.Session(url, **hello)
with session:
    trains = [papilla.SpikeTrains(session.ready, finger) for finger in range(len(hand))]
    answers = []
    for time_s in times_s:
        share = min(1.0, time_s / 0.3)
        sent = [
            session.send_poses(pose, finger=finger, net=((0, 0, 1), max(share, 0.02) * force_n),
                               client_time_us=round(1e6 * time_s))
            for finger, (_, force_n) in enumerate(hand.values())
        ]  # fmt: skip
        answers.append([each.result() for each in sent])
        for finger, answer in enumerate(answers[-1]):
            trains[finger].add(answer)

figure = plt.figure(figsize=(9, 5.2), layout="constrained")
grid = figure.add_gridspec(2, len(hand), height_ratios=(1, 1.5))
most = 1e-3 * max(answer.sed.max() for answer in answers[-1])
for finger, (name, (_, force_n)) in enumerate(hand.items()):
    answer = answers[-1][finger]
    spikes, units = len(trains[finger].unit), len(np.unique(trains[finger].unit))
    print(f"{name:7} {answer.touch.force_n[2]:.2f} N, {spikes} spikes of {units} units")
    axis = figure.add_subplot(grid[0, finger])
    drawn = axis.imshow(1e-3 * answer.sed, vmin=0, vmax=most)
    axis.set(xticks=[], yticks=[], title=f"{name}, {force_n:g} N")
figure.colorbar(drawn, ax=figure.axes, shrink=0.8, label="SED, kJ/m³")
below = figure.add_subplot(grid[1, :])
for kind, colour in (("sa1", "tab:green"), ("ra", "tab:blue"), ("pc", "tab:orange")):
    for finger, own in enumerate(trains):
        mine = own.classes[own.unit] == kind
        height = len(hand) - finger - own.unit[mine] / len(own.classes)
        below.plot(1e-6 * own.time_us[mine], height, "|", ms=2, color=colour, label=None if finger else kind.upper())
below.set(xlabel="time, s", xlim=(0, times_s[-1]), ylim=(0, len(hand)))
below.set_yticks(np.arange(len(hand)) + 0.5, list(hand)[::-1])
below.legend(loc="lower right", fontsize=8)
figure.savefig("hand.png", dpi=110)
