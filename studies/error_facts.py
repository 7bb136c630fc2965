"""Would other facts of an answer narrow the errors that the service states?

    cp -r models out/models
    cargo run --release -p papilla-model-export -- calibrate --models out/models --out out --states out/states.json \\
        --network nano-maps nano small-maps small
    python studies/error_facts.py out/states.json [--write]

The file has the answers of networks and contact about simulations that no training saw. Laws are fitted to them by
the rules of `model-export calibrate`, which docs/reports/expected-error.md describes, with the facts that ship and
with others. The first law of each table has to be that of the report, or the script fails. --write makes
studies/reports/error-facts.md of it. Needs numpy.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "studies/reports/error-facts.md"
REPORT = ROOT / "docs/reports/expected-error.json"
BEGIN, END = "<!-- begin: studies/error_facts.py writes this -->", "<!-- end -->"
# The facts of a case, in the order of the file.
NAMES = ("peak", "concentration", "load", "length", "roughness", "inside", "strange", "energy", "tip", "side", "heel")
LOAD, ENERGY = NAMES.index("load"), NAMES.index("energy")
GROUPS = {
    "broad-graded": "trained",
    "more-graded": "trained",
    "fidelity": "trained",
    "heldout-graded": "unseen",
    "pressed-graded": "hard",
    "hard-graded": "hard",
    "proximal-graded": "hard",
    "deep-graded": "hard",
    "s1-graded": "tilted",
    "final": "aside",
    "final-anew": "aside",
}
# Rules of the calibration.
FOLDS, INNER, RIDGE, MARGIN, GROUP_LEAST, ERROR_LEAST, BOUND_LEAST = 5, 8, 3.0, 0.1, 15, 1e-3, 0.05
SIMULATIONS_MAX = {"s1-graded": 15.0}
# Two forces that are equal have no logarithm of their difference: what is added to it.
APART_FORCE, APART_ENERGY = 0.01, 0.003


def conformal(values, share):
    """The value that another one of its kind exceeds with a chance of 1 - share at most."""
    ordered = sorted(values)
    return ordered[min(max(math.ceil(share * (len(ordered) + 1) - 1e-9), 1), len(ordered)) - 1]


def quantile(rows, values, weights, share):
    """Coefficients of the linear quantile: reweighted least squares on a rounded pinball loss."""
    found = np.zeros(rows.shape[1])
    found[0] = conformal(values, share)
    ridge = np.diag([1e-9] + [2 * RIDGE] * (rows.shape[1] - 1))
    for rounded in (0.3, 0.1, 0.03, 0.01):
        for _ in range(12):
            square = 0.5 * weights / np.hypot(values - rows @ found, rounded)
            right = rows.T @ (square * values + weights * (share - 0.5))
            found = np.linalg.solve(ridge + (rows * square[:, None]).T @ rows, right)
    return found


def place(case):
    """Which state of which simulation it is about."""
    return case["set"], case["simulation"], case["state"]


def number(value):
    """A fact, which is null where it is not known."""
    return math.nan if value is None else value


class Cases:
    """The answers of one series: facts by name, errors, sets and weights."""

    def __init__(self, states, network, method):
        known = {(case["network"], case["method"], *place(case)): case["facts"] for case in states}
        cases = [case for case in states if (case["network"], case["method"]) == (network, method)]

        def of(name, by, case, fact):
            facts = known.get((name, by, *place(case)))
            return math.nan if facts is None else number(facts[fact])

        self.facts = {name: np.array([number(c["facts"][i]) for c in cases]) for i, name in enumerate(NAMES)}
        self.facts["depth"] = np.log([case["depth_mm"] for case in cases])
        forces = [[of(None, by, case, LOAD) for case in cases] for by in ("pixels", "second_order", "coarse_pixels")]
        pixels, vertices, coarse = map(np.array, forces)
        self.facts["vertices"] = np.log(abs(pixels - vertices) + APART_FORCE)
        self.facts["coarse"] = np.log(abs(pixels - coarse) + APART_ENERGY)
        pair = ("nano-maps", "small-maps") if method is None else ("nano", "small")
        nano, small = (np.array([of(name, method, case, ENERGY) for case in cases]) for name in pair)
        self.facts["networks"] = np.log(abs(nano - small) + APART_ENERGY)
        for i, name in enumerate(NAMES):
            self.facts[f"map {name}"] = np.array([of("small", method, case, i) for case in cases])
        self.error = np.array([case["error"] for case in cases])
        self.log = np.log(np.maximum(self.error, ERROR_LEAST))
        self.flagged = np.array([case["is_flagged"] for case in cases])
        self.sets = [case["set"] for case in cases]
        self.group = np.array([GROUPS[name] for name in self.sets])
        self.simulation = np.array([case["simulation"] for case in cases])
        each = list(zip(self.sets, self.simulation.tolist(), strict=True))
        simulations = {name: len({one for one in each if one[0] == name}) for name in set(self.sets)}
        share = [min(SIMULATIONS_MAX.get(s, math.inf) / simulations[s], 1.0) / each.count((s, n)) for s, n in each]
        self.weight = np.array(share) / np.mean(share)


class Law:
    """Logarithms of the median and of the bound over it, linear in facts."""

    def __init__(self, cases, on, median, bound):
        self.median, self.at_bound = median, [0] + [1 + median.index(name) for name in bound]
        values = {name: cases.facts[name][on] for name in median}
        self.scale = {name: (v.mean(), v.std() + 1e-9) for name, v in values.items()}
        room = {name: MARGIN * np.ptp(v) + 1e-6 for name, v in values.items()}
        self.range = {name: (v.min() - room[name], v.max() + room[name]) for name, v in values.items()}
        rows, log, weight = self.rows(cases)[on], cases.log[on], cases.weight[on]
        self.of_median = quantile(rows, log, weight, 0.5)
        self.of_bound = quantile(rows[:, self.at_bound], log - rows @ self.of_median, weight, 0.9)
        self.raised = 0.0

    def rows(self, cases):
        scaled = [(cases.facts[name] - self.scale[name][0]) / self.scale[name][1] for name in self.median]
        return np.column_stack([np.ones(len(cases.error)), *scaled])

    def stated(self, cases):
        """Logarithms of median and bound of all cases; NaN out of range."""
        rows = self.rows(cases)
        median = rows @ self.of_median
        bound = median + np.maximum(rows[:, self.at_bound] @ self.of_bound + self.raised, BOUND_LEAST)
        within = [(cases.facts[n] >= self.range[n][0]) & (cases.facts[n] <= self.range[n][1]) for n in self.median]
        known = np.all(within, axis=0)
        return np.where(known, median, math.nan), np.where(known, bound, math.nan)


def raised(cases, on, median, bound, groups):
    """A law whose bound holds in each group for what its fit did not see."""
    law, above = Law(cases, on, median, bound), {}
    part = cases.simulation // FOLDS % INNER
    for which in range(INNER):
        if not (on & (part != which)).any():
            continue
        other = Law(cases, on & (part != which), median, bound)
        rows = other.rows(cases)
        due = rows @ other.of_median + np.maximum(rows[:, other.at_bound] @ other.of_bound, BOUND_LEAST)
        for i in np.flatnonzero(on & (part == which)):
            above.setdefault(groups[cases.group[i]], []).append(cases.log[i] - due[i])
    law.raised = max([0.0] + [conformal(v, 0.9) for v in above.values() if len(v) >= GROUP_LEAST])
    return law


def checked(cases, median, bound, groups):
    """Bound over median, the bound, and the shares below it, each by a law of other simulations."""
    aside = cases.group == "aside"
    usable = ~aside & ~cases.flagged & np.isfinite([cases.facts[name] for name in median]).all(axis=0)
    middle, upper = np.full(len(aside), math.nan), np.full(len(aside), math.nan)
    for fold in range(FOLDS + 1):
        mine = aside if fold == FOLDS else ~aside & (cases.simulation % FOLDS == fold)
        law = raised(cases, usable & ~mine, median, bound, groups)
        for to, of in zip((middle, upper), law.stated(cases), strict=True):
            to[mine] = of[mine]
    told = np.isfinite(upper) & ~cases.flagged
    below = cases.error <= np.exp(upper)
    share = {group: 100 * below[told & (cases.group == group)].mean() for group in set(cases.group[told])}
    kept = told & ~aside
    return {
        "stated": int(kept.sum()),
        "ratio": float(np.median(np.exp(upper - middle)[kept])),
        "bound": 100 * float(np.median(np.exp(upper)[kept])),
        "below": 100 * float(below[kept].mean()),
        "least": min(of for group, of in share.items() if group != "aside"),
        "aside": share["aside"],
        "aside ratio": float(np.median(np.exp(upper - middle)[told & aside])),
    }


TWO = {"trained": "ordinary", "unseen": "ordinary", "hard": "off", "tilted": "off", "aside": "off"}
FOUR = {group: group for group in TWO}
MAP = ["map peak", "map concentration", "map length", "map roughness"]
OF_FORCE, OF_SED = ["load", "tip", "side", "heel"], list(NAMES)
# Title; network and method; groups; facts that ship, of the median and of the bound; what is added to either.
SERIES = [
    ("Force by `pixels`", None, "pixels", TWO, OF_FORCE, ["load"], [
        ("as shipped", [], []),
        ("depth", ["depth"], []),
        ("length of the contact", ["map length"], []),
        ("peak, concentration, length and roughness of the pressure", MAP, []),
        ("disagreement with `coarse_pixels`", ["coarse"], []),
        ("disagreement with `second_order`", ["vertices"], []),
        ("the same, also for the bound", ["vertices"], ["vertices"]),
        ("disagreement with `second_order`, and the four of the pressure", [*MAP, "vertices"], []),
        ("the same, also for the bound", [*MAP, "vertices"], ["vertices"]),
    ]),
    ("SED by `small` from `pixels`", "small", "pixels", FOUR, OF_SED, ["strange"], [
        ("as shipped", [], []),
        ("depth", ["depth"], []),
        ("disagreement of `nano` and `small`", ["networks"], []),
        ("the same, also for the bound", ["networks"], ["networks"]),
        ("disagreement of the forces by `pixels` and `second_order`", ["vertices"], []),
        ("the same, also for the bound", ["vertices"], ["vertices"]),
    ]),
    ("SED by `small-maps` from FE's pressure", "small-maps", None, FOUR, OF_SED, ["strange"], [
        ("as shipped", [], []),
        ("depth", ["depth"], []),
        ("disagreement of `nano-maps` and `small-maps`", ["networks"], []),
        ("the same, also for the bound", ["networks"], ["networks"]),
    ]),
]  # fmt: skip


def table(states, report, series):
    title, network, method, groups, median, bound, added = series
    cases = Cases(states, network, method)
    text = (
        f"\n**{title}**\n\n| facts beside those that ship | answers | bound over median | bound, median, % | "
        "below the bound, % | least of a group, % | sets set aside: below, % | sets set aside: bound over median |\n"
        "|---|---|---|---|---|---|---|---|\n"
    )
    for name, of_median, of_bound in added:
        found = checked(cases, median + of_median, bound + of_bound, groups)
        if not of_median:
            (shipped,) = (of for of in report["fitted"] if (of["network"], of["method"]) == (network, method))
            due = shipped["rows"][-1]["bound_over_median"]
            if abs(found["ratio"] / due - 1) > 0.01:
                sys.exit(f"{title}: bound over median {found['ratio']:.3f}, but {REPORT.name} has {due:.3f}")
        text += (
            f"| {name} | {found['stated']} | {found['ratio']:.2f} | {found['bound']:.1f} | {found['below']:.0f} | "
            f"{found['least']:.0f} | {found['aside']:.0f} | {found['aside ratio']:.2f} |\n"
        )
    return text


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    states, report = json.loads(Path(sys.argv[1]).read_text())["cases"], json.loads(REPORT.read_text())
    text = "".join(table(states, report, series) for series in SERIES)
    print(text)
    if "--write" in sys.argv:
        page = PAGE.read_text()
        start = page.index(BEGIN) + len(BEGIN)
        PAGE.write_text(page[:start] + "\n" + text + "\n" + page[page.index(END, start) :])


if __name__ == "__main__":
    main()
