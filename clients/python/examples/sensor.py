"""What a finger feels under a glove's sensor: a record that a virtual glove writes, and what becomes of it.

Writes record.csv, glove.toml and sensor.png (matplotlib). docs/guides/sensors.md explains each step.
"""

import csv
import os
from pathlib import Path

import numpy as np

import papilla
from papilla import sensors
from papilla.sensors.plots import overview

GLOVE = """
[sensor]
name = "glove"
unit = "kPa"
noise = 0.1

[grid]
rows = 16
columns = 12
pitch_mm = 1.25
"""
url = os.environ.get("PAPILLA_URL", papilla.DEFAULT_URL)
Path("glove.toml").write_text(GLOVE)
glove = sensors.describe("glove.toml", url=url)

# Two taps, the second one beside the first, as the glove would read them.
times_s = 0.01 * np.arange(80)
taps = [(0.8 * np.sin(np.pi * np.clip(times_s / 0.35, 0, 1)), (11.25, 0.0, -6.53))]
taps += [(0.5 * np.sin(np.pi * np.clip((times_s - 0.42) / 0.35, 0, 1)), (8.5, 2.0, -6.0))]
pressure_pa = [
    sum(glove.atlas.contacts([papilla.Contact(at, force[i])]) for force, at in taps) for i in range(len(times_s))
]
readings = glove.read(np.stack(pressure_pa), np.random.default_rng(4)).reshape(len(times_s), -1)
with open("record.csv", "w", newline="") as file:
    writer = csv.writer(file)
    writer.writerow(["time_s", *(f"t{taxel}" for taxel in range(len(glove)))])
    for time_s, row in zip(times_s, np.nan_to_num(readings), strict=True):
        writer.writerow([f"{time_s:.3f}", *(f"{value:.3f}" for value in row)])

record = sensors.read_record("record.csv")
felt = sensors.sense(record, glove, url=url, effects=["summary", "afferents", "spikes"])
overview("sensor.png", record, glove, felt)
print(f"force {felt.series['summary_force_n'].max():.2f} N at most; {len(felt.series.spikes.unit)} spikes")
print(f"error of SED to expect: {100 * felt.expected.sed_relative_l2:.0f} %")
for note in felt.warnings:
    print(f"note: {note}")
