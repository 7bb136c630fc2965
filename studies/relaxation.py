"""Holds the filter of the effect `relaxation` against a transient FE press.

    fe-datagen solve scenes/relaxation-hold.toml --out out/relaxing
    sed 's/, "viscoelastic"//' scenes/relaxation-hold.toml > out/elastic.toml
    fe-datagen solve out/elastic.toml --out out/elastic
    python studies/relaxation.py out/relaxing out/elastic [subcutaneous|skin]

Both presses go to the same depths. If the correspondence principle held exactly, the pressure of the
relaxing finger, filtered, would be the pressure of the elastic one at every instant: then the elastic
map of it is the elastic map of the strain that the finger has. Needs numpy.
"""

import json
import sys

import numpy as np

SERIES = {  # g, tau in s: docs/concepts/physics.md
    "skin": [(0.2566, 0.3834), (0.2225, 4.6731)],
    "subcutaneous": [(0.0864, 0.2136), (0.2136, 8.854)],
}


def creep(prony):
    """J(t) = 1/g_inf - sum j exp(-x t); the x lie where the modulus at s = -x vanishes."""
    at_rest = 1.0 - sum(g for g, _ in prony)
    modulus = lambda x: at_rest + sum(-g * x * tau / (1 - x * tau) for g, tau in prony)
    branches, low = [], 0.0
    for _, pole in sorted((1 / tau, 1 / tau) for _, tau in prony):
        below, above = low, pole
        for _ in range(200):
            middle = 0.5 * (below + above)
            below, above = (middle, above) if modulus(middle) > 0 else (below, middle)
        x = 0.5 * (below + above)
        branches.append((x, 1 / (x * sum(g * tau / (1 - x * tau) ** 2 for g, tau in prony))))
        low = pole
    return 1 / at_rest, branches


def filtered(times_s, pressure_pa, prony):
    long_term, branches = creep(prony)
    states = [np.zeros_like(pressure_pa[0]) for _ in branches]
    before_pa, before_s = np.zeros_like(pressure_pa[0]), 0.0
    for now_s, now_pa in zip(times_s, pressure_pa):
        for i, (x, _) in enumerate(branches):
            h = x * (now_s - before_s)
            states[i] = np.exp(-h) * states[i] - np.expm1(-h) / h * (now_pa - before_pa)
        before_pa, before_s = now_pa, now_s
        yield long_term * now_pa - sum(j * z for (_, j), z in zip(branches, states))


def stored_times_s(scene):
    """Instants of the stored states: `increments` equal steps to each point of the path."""
    times, start = [], 0.0
    for point in scene["motion"]["path"]:
        steps = scene["motion"]["increments"]
        times += [start + (point["time_s"] - start) * (n + 1) / steps for n in range(steps)]
        start = point["time_s"]
    return times


def main(relaxing, elastic, tissue="subcutaneous"):
    scene = json.load(open(f"{relaxing}/summary.json"))["scene"]
    found, due = np.load(f"{relaxing}/maps.npz"), np.load(f"{elastic}/maps.npz")
    off = lambda a, b: 100 * np.linalg.norm(a - b) / np.linalg.norm(b)
    print("time s | as sent % | filtered % | peak % | stored SED / elastic SED, peaks")
    times_s = stored_times_s(scene)
    filter_pa = filtered(times_s, found["pressure_pa"].astype(float), SERIES[tissue])
    for k, (time_s, pa) in enumerate(zip(times_s, filter_pa)):
        raw, elastic_pa = found["pressure_pa"][k], due["pressure_pa"][k]
        sed, elastic_sed = (file["sed_dermis_j_per_m3"][k].max() for file in (found, due))
        peak = 100 * (pa.max() / elastic_pa.max() - 1)
        print(f"{time_s:6.2f} | {off(raw, elastic_pa):5.1f} | {off(pa, elastic_pa):5.1f} | {peak:+5.1f} | {sed / elastic_sed:.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
