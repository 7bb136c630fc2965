"""What pushes back on a finger, by depth and by method, without a service: force.csv."""

import csv

import numpy as np

import papilla

BALL = {"shape": {"shape": "sphere", "radius_mm": 10}}
DEPTHS_MM = np.linspace(0.0, 0.8, 9)

finger = papilla.Finger()
poses = np.tile([11.25, 0, -16.53, 0, 0, 0, 1], (len(DEPTHS_MM), 1, 1))
poses[:, 0, 2] += DEPTHS_MM
found = {}
for method in ("springs", "small_strain", "second_order", "pixels"):
    contact = papilla.Finger(finger, method=method).touch(BALL, poses)
    found[method] = contact.force_n[:, 2]
    flags = sorted({flag for each in contact.flags for flag in each})
    print(f"{method:12} {found[method][-1]:.3f} N at {DEPTHS_MM[-1]} mm, {contact.rounds.sum()} rounds, {flags}")
with open("force.csv", "w", newline="") as file:
    rows = csv.writer(file)
    rows.writerow(["depth_mm", *found])
    rows.writerows(zip(DEPTHS_MM, *found.values(), strict=True))
