"""How far SED of the influence operator is from finite elements at finite strain.

    fe-datagen operator --density medium --out out/operator
    python studies/operator_error.py out/operator data/rungs/medium-linear

The dataset has to be of the operator's mesh: an even one, with values at the atlas' vertices.
docs/reference/operator.md shows what this prints. Needs numpy.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np


def main(operator, dataset):
    arrays = np.load(f"{operator}/operator.npz")
    face_g, vertex_face, vertex_weight = arrays["face_g"], arrays["vertex_face"], arrays["vertex_weight"]
    raster = np.load(f"{dataset}/raster.npz")
    drawn = lambda values: (values[raster["interface_vertex"]] * raster["interface_weight"]).sum(1)
    rows, times_ms = [], []
    for press in json.loads(Path(dataset, "manifest.json").read_text())["presses"]:
        shard = np.load(f"{dataset}/{press['file']}")
        for depth_mm, pressure_pa, due in zip(shard["depth_mm"], shard["pressure_pa"], shard["sed_dermis_j_per_m3"]):
            begin = time.perf_counter()
            face_sed = ((face_g @ pressure_pa) ** 2).sum(axis=1)
            sed = (vertex_weight * face_sed[vertex_face]).sum(axis=1)
            times_ms.append(1e3 * (time.perf_counter() - begin))
            found, truth = drawn(sed), drawn(due)
            rows.append((float(depth_mm), np.linalg.norm(found - truth) / np.linalg.norm(truth), press["indenter"]))
    for depth_mm, error, indenter in sorted(rows):
        print(f"{depth_mm:.2f} mm  {error:6.1%}  {indenter}")
    depths, errors = np.array([row[:2] for row in rows]).T
    for low, high in [(0, 9), (0, 0.6), (0.6, 1.0), (1.0, 9)]:
        of = errors[(depths >= low) & (depths < high)]
        if of.size:
            print(f"{low} to {high} mm: {of.size} states, median {np.median(of):.1%}, greatest {of.max():.1%}")
    print(f"one map: {np.median(times_ms):.1f} ms (median)")


if __name__ == "__main__":
    main(*sys.argv[1:])
