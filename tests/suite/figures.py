#!/usr/bin/env python3
"""Fills measured figures into hand-written pages, so that a figure has one source.

    tests/suite/figures.py [--write | --list]

A page marks a figure with two comments, which a reader does not see:

    `small` errs by <!-- =small.reference -->7.5 %<!-- / -->.

Between the comments stands what the key's source says: models/ladder.json for networks, the first
table of docs/reports/contact.md for contact. Without an option exit code 1 names every figure that
is stale, every key that no source has, and where models/contact.json is not the report's. --write renews them, --list prints all keys with values.

Keys of networks and of finite-element rows: NAME.SET is the median relative L2 of strain energy
density (SED), NAME.SET.p95 its 95th percentile, NAME.SET.far the error away from the contact, NAME.SET.peak
that of the greatest SED, NAME.ms the time of a map on one core, NAME.s that of a state. Sets:
reference, reference-anew, reference-shapes, broad, unseen, pressed, s1, with the pressure of FE; poses, with the
pressure that contact finds from poses. reference.error and teacher.pressure are what
the truths err themselves. Keys of contact: contact.METHOD.SET.QUANTITY
and the same with .p95; quantities are pressure, force, sed, us (processor time of a warm frame).
frame.NAME.METHOD.SET.ms is a warm frame from poses: the network and the contact before it.
sessions.NAME.maps and sessions.NAME.poses are the sessions of 90 Hz that one core holds at half
load, from the two times above (docs/guides/operating.md).

Errors are rounded to what they are worth: one decimal below 10 %, none above. KEY.exact has two decimals.
KEY?AIM is `met` if the figure is at most AIM, which has the figure's unit, and `**missed**` if not; KEY?>AIM
if it is at least AIM.

Keys of stated errors, from docs/reports/expected-error: stated.sed.FROM.least, the least share of true errors below
the bound that a group of sets reaches with any network, and stated.sed.FROM.ratio, the greatest bound over median;
FROM is given (FE's pressure) or a method. The same of stated.force.METHOD. stated.sed.FROM.unseen is the least share
of the default network in a set of ten answers and more to which nothing was fitted. stated.cost is what an error
estimate takes of the time of `nano`.
"""

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MARK = re.compile(r"(<!-- =([\w.-]+)(?:\?(>?[\d.]+))? -->)([^<]*)(<!-- / -->)")
# The first cell of a row about stated errors: a network and how pressure was found, or the method of a force.
STATED = re.compile(r"SED by `[\w-]+` from (?:FE's pressure|`(\w+)`)|force by `(\w+)`")
SETS = {
    "reference": "reference",
    "reference-anew": "reference-anew",
    "reference-shapes": "reference-shapes",
    "heldout-presses": "broad",
    "heldout-shapes": "unseen",
    "pressed": "pressed",
    "s1": "s1",
    "poses": "poses",
}
METHODS = {
    "springs": "springs",
    "small strain": "small_strain",
    "second order": "second_order",
    "second order, coarse pixels": "coarse_pixels",
    "second order, pixels": "pixels",
    "second order, gaps": "gaps",
}
# Decoding, encoding and sending a map, ms (docs/guides/operating.md, Sizing).
BESIDE_MS = 0.12
# The load to plan for, and the rate of a session.
LOAD, RATE_HZ = 0.5, 90
QUANTITIES = {"pressure": "pressure_relative_l2", "force": "force_relative", "sed": "sed_relative_l2"}
CONTACT_SETS = {"final": "reference", "broad": "broad", "heldout": "unseen"}


class Figure(str):
    """A figure as a page shows it, which knows what it was rounded from, in the unit that is shown."""

    exact: float

    def __new__(cls, text: str, exact: float):
        made = super().__new__(cls, text)
        made.exact = exact
        return made


def percent(value: float) -> Figure:
    """An error in percent, rounded to what it is worth."""
    shown = 100 * value
    return Figure(f"{shown:.1f} %" if shown < 9.95 else f"{shown:.0f} %", shown)


def milliseconds(value: float) -> Figure:
    """A time, to two figures."""
    return Figure(f"{value:.1f}" if value < 9.95 else f"{value:.0f}", value)


def asked(key: str, aim: str | None, known: dict[str, Figure]) -> str | None:
    """What stands at a mark: the figure, its exact form, or whether it reaches the aim; none without a source."""
    figure = known.get(key.removesuffix(".exact"))
    if figure is None:
        return None
    if aim is not None:
        least = aim.startswith(">")
        reached = figure.exact >= float(aim[1:]) if least else figure.exact <= float(aim)
        return "met" if reached else "**missed**"
    if key.endswith(".exact"):
        return f"{figure.exact:.2f} %" if figure.endswith("%") else f"{figure.exact:.2f}"
    return figure


def of_ladder(text: str) -> dict[str, Figure]:
    """Figures of the ladder."""
    found = {}
    for rung in json.loads(text)["rungs"]:
        for name, errors in rung["errors"].items():
            error = errors["relative_l2"]
            found[f"{rung['name']}.{SETS[name]}"] = percent(error["median"])
            found[f"{rung['name']}.{SETS[name]}.p95"] = percent(error["p95"])
            found[f"{rung['name']}.{SETS[name]}.far"] = percent(errors["far_field_relative_l2"]["median"])
            found[f"{rung['name']}.{SETS[name]}.peak"] = percent(errors["peak_error"]["median"])
        if latency := (rung["latency_ms"] or {}).get("tract"):
            found[f"{rung['name']}.ms"] = milliseconds(latency["p50"])
        if seconds := rung["seconds"]:
            found[f"{rung['name']}.s"] = Figure(f"{seconds['p50']:.0f}", seconds["p50"])
    return found | of_truth(json.loads(text))


def of_truth(ladder: dict) -> dict[str, Figure]:
    """What the truths err themselves: the reference's SED, and the teacher's pressure against it."""
    pressure = ladder["readings"]["pressure"]
    return {
        "reference.error": percent(ladder["discretisation_error"]["sed_relative_l2"]),
        "teacher.pressure": percent(pressure["median"]),
        "teacher.pressure.p95": percent(pressure["p95"]),
    }


def of_contact(text: str) -> dict[str, Figure]:
    """Figures of the contact report."""
    found = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if len(cells) < 7 or cells[0] not in METHODS or cells[1] not in CONTACT_SETS:
            continue
        key = f"contact.{METHODS[cells[0]]}.{CONTACT_SETS[cells[1]]}"
        for quantity, cell in [("pressure", 2), ("force", 3), ("sed", 4), ("us", 6)]:
            median, p95 = (float(part) for part in cells[cell].split("/"))
            show = (lambda us: Figure(f"{us:.0f}", us)) if quantity == "us" else (lambda error: percent(error / 100))
            found[f"{key}.{quantity}"], found[f"{key}.{quantity}.p95"] = show(median), show(p95)
    return found


def differing(model: str, known: dict[str, Figure]) -> list[str]:
    """Where models/contact.json, which the service answers from, is not what the report says."""
    faults = []
    for method in json.loads(model)["methods"]:
        for errors in method["errors"]:
            key = f"contact.{method['name']}.{CONTACT_SETS[errors['set']]}"
            for quantity, member in QUANTITIES.items():
                for suffix, value in [("", errors[member]["median"]), (".p95", errors[member]["p95"])]:
                    due = known.get(f"{key}.{quantity}{suffix}")
                    # The report has a tenth of a per cent.
                    found = percent(round(100 * value, 1) / 100)
                    if found != due:
                        faults.append(f"models/contact.json: {key}.{quantity}{suffix} is {found}, the report says {due}")
    return faults


def of_sizing(text: str, contact_us: float) -> dict[str, Figure]:
    """Sessions that one core holds, by what a frame takes of it."""
    found = {}
    for rung in json.loads(text)["rungs"]:
        if latency := (rung["latency_ms"] or {}).get("tract"):
            for what, contact_ms in [("maps", 0.0), ("poses", contact_us / 1000)]:
                frame_ms = latency["p50"] + BESIDE_MS + contact_ms
                found[f"sessions.{rung['name']}.{what}"] = milliseconds(1000 * LOAD / RATE_HZ / frame_ms)
    return found


def of_frames(text: str, contact: dict[str, Figure]) -> dict[str, Figure]:
    """Times of frames from poses: contact, then a network."""
    found = {}
    for rung in json.loads(text)["rungs"]:
        if latency := (rung["latency_ms"] or {}).get("tract"):
            for key, us in contact.items():
                parts = key.split(".")
                if parts[-1] == "us":
                    time_ms = latency["p50"] + float(us) / 1000
                    found[f"frame.{rung['name']}.{parts[1]}.{parts[2]}.ms"] = milliseconds(time_ms)
    return found


def of_stated(page: str, text: str) -> dict[str, Figure]:
    """Figures of the errors that answers state."""
    found: dict[str, Figure] = {}

    def note(key: str, value: float, unit: str, pick: Callable[[float, float], float], digits: int = 0) -> None:
        value = pick(value, found[key].exact) if key in found else value
        found[key] = Figure(f"{value:.{digits}f}{unit}", value)

    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if len(cells) == 10 and (what := STATED.fullmatch(cells[0])):
            key = f"stated.force.{what[2]}" if what[2] else f"stated.sed.{what[1] or 'given'}"
            note(f"{key}.least", float(cells[9]), " %", min)
            note(f"{key}.ratio", float(cells[5]), "", max, 2)
    report = json.loads(text)
    for fitted in (of for of in report["fitted"] if of["network"] == "small" and of["method"] in (None, "pixels")):
        for row in (row for row in fitted["without_its_set"] if row["stated"] >= 10):
            note(f"stated.sed.{fitted['method'] or 'given'}.unseen", 100 * row["below_p90"], " %", min)
    cost = report["cost"]
    added_us = max(cost["peak_and_sum_us"] - cost["peak_us"], 0.0) + cost["laws_us"]
    note("stated.cost", 100 * added_us / cost["network_us"], " %", max, 1)
    return found


def figures() -> dict[str, Figure]:
    """All figures, by key."""
    ladder = (ROOT / "models/ladder.json").read_text()
    contact = of_contact((ROOT / "docs/reports/contact.md").read_text())
    sizing = of_sizing(ladder, float(contact["contact.pixels.broad.us"]))
    stated = [(ROOT / f"docs/reports/expected-error.{ending}").read_text() for ending in ("md", "json")]
    return of_ladder(ladder) | contact | sizing | of_frames(ladder, contact) | of_stated(*stated)


def filled(text: str, known: dict[str, Figure]) -> tuple[str, list[str]]:
    """The text with its figures renewed, and a line for each that was stale or has no source."""
    wrong = []

    def renew(mark: re.Match[str]) -> str:
        value = asked(mark[2], mark[3], known)
        if value is None:
            wrong.append(f"no source has '{mark[2]}' (--list)")
            return mark[0]
        if value != mark[4]:
            wrong.append(f"{mark[2]} is {value}, the page says {mark[4] or 'nothing'}")
        return mark[1] + value + mark[5]

    return MARK.sub(renew, text), wrong


def main() -> int:
    known = figures()
    if "--list" in sys.argv[1:]:
        print("\n".join(f"{key:45} {value}" for key, value in sorted(known.items())))
        return 0
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    count, faults = 0, differing((ROOT / "models/contact.json").read_text(), known)
    for name in sorted(filter(None, listed.split("\0"))):
        path = ROOT / name
        text = path.read_text() if path.exists() else ""
        new, wrong = filled(text, known)
        count += len(MARK.findall(text))
        if "--write" in sys.argv[1:] and new != text:
            path.write_text(new)
            wrong = [fault for fault in wrong if fault.startswith("no source")]
        faults += [f"{name}: {fault}" for fault in wrong]
    print("\n".join(faults + [f"{count} figures, {len(faults)} faults"]))
    if faults:
        print("renew them: tests/suite/figures.py --write")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
