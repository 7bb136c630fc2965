#!/usr/bin/env python3
"""Draws the workspace's crates and what each is built with, from `cargo metadata`; measures them.

    tests/suite/crates.py [--write | --sizes]

Without --write compares the picture in ARCHITECTURE.md with the workspace. Exit code 1 if the
picture is out of date, if crates need each other in a circle (dependencies of tests alone are not
drawn), if a crate builds on Unix alone (a crate of UNIX_ONLY that is not under `cfg(unix)`), or if
a crate outside of studies needs one of studies, be it for its tests.

Sizes have no limit, since a crate is cut by what one would use alone. --sizes prints each crate's
lines; a plain run names the largest crate and the largest file.
"""

import json
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from statistics import median_low

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "ARCHITECTURE.md"
UNIX_ONLY = {"nix", "rustix", "libc"}
# What was asked once: it uses the product, never the other way round.
STUDIES = "studies"
PLACE = re.compile(r"(<!-- tests/suite/crates\.py -->\n).*?(<!-- end -->\n)", re.DOTALL)
Arrows = dict[str, set[str]]
SOURCE = re.compile(r"\.(rs|py|pyi|c?js|mjs|ts|cs|gd|cpp|hpp|h|css|html|sh)$|/(run|wire|test|bench|docs-test|cycles|generate)$")


def folders(metadata: dict) -> Arrows:
    """The folder of each crate of the workspace, and the folders of the crates it is built with."""
    root = Path(metadata["workspace_root"])
    where = {p["name"]: str(Path(p["manifest_path"]).parent.relative_to(root)) for p in metadata["packages"]}
    return {
        where[p["name"]]: {where[d["name"]] for d in p["dependencies"] if d["name"] in where and d["kind"] != "dev"}
        for p in metadata["packages"]
    }


def unix_only(metadata: dict) -> list[str]:
    """A line for each dependency that keeps a crate from being built on Windows."""
    return [
        f"{p['name']} needs {d['name']} everywhere: put it under [target.'cfg(unix)'.dependencies]"
        for p in metadata["packages"]
        for d in p["dependencies"]
        if d["name"] in UNIX_ONLY and d["kind"] is None and not d["target"]
    ]


def on_studies(metadata: dict) -> list[str]:
    """A line for each dependency of the product on a study, of whatever kind."""
    root = Path(metadata["workspace_root"])
    where = {p["name"]: Path(p["manifest_path"]).relative_to(root).parts[0] for p in metadata["packages"]}
    return [
        f"{p['name']} needs {d['name']}: a study uses the product, which must do without it"
        for p in metadata["packages"]
        for d in p["dependencies"]
        if where[p["name"]] != STUDIES and where.get(d["name"]) == STUDIES
    ]


def direct(arrows: Arrows) -> Arrows:
    """The arrows that no longer way stands for."""

    def reached(start: str) -> set[str]:
        return arrows[start].union(*(reached(next_one) for next_one in arrows[start]))

    return {
        crate: {to for to in needs if not any(to in reached(other) for other in needs - {to})}
        for crate, needs in arrows.items()
    }


def circle(arrows: Arrows) -> list[str]:
    """Crates that need each other, or none."""
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def picture(arrows: Arrows) -> str:
    """The crates as a Mermaid graph."""
    name = {crate: re.sub(r"\W", "_", crate) for crate in arrows}
    lines = [f'    {name[crate]}["{crate}"]' for crate in sorted(arrows)]
    lines += [f"    {name[crate]} --> {name[to]}" for crate in sorted(arrows) for to in sorted(direct(arrows)[crate])]
    return "```mermaid\ngraph TD\n" + "\n".join(lines) + "\n```\n"


def lines() -> dict[str, int]:
    """Lines of every source file that is written by hand."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    files = sorted(name for name in listed if SOURCE.search(name) and (ROOT / name).is_file())
    return {name: len((ROOT / name).read_text().splitlines()) for name in files}


def table(crates: list[str], found: dict[str, int]) -> str:
    """Lines of each crate's Rust files as a Markdown table."""
    rows = ["| crate | lines in `src` | in its other targets | files | largest | median |", "|---|---|---|---|---|---|"]
    for crate in sorted(crates):
        rust = {name: n for name, n in found.items() if name.startswith(f"{crate}/") and name.endswith(".rs")}
        library = sum(n for name, n in rust.items() if name.startswith(f"{crate}/src/"))
        largest = max(rust, key=lambda name: rust[name])
        cells = [f"`{crate}`", library, sum(rust.values()) - library, len(rust)]
        cells += [f"{rust[largest]} `{largest.removeprefix(f'{crate}/')}`", median_low(rust.values())]
        rows.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(rows)


def largest(crates: list[str], found: dict[str, int]) -> str:
    """The largest crate, the largest file and the median Rust file, in words."""
    rust = {name: n for name, n in found.items() if name.endswith(".rs")}
    sizes = {c: sum(n for name, n in rust.items() if name.startswith(f"{c}/src/")) for c in crates}
    crate, file = max(sizes, key=lambda c: sizes[c]), max(found, key=lambda name: found[name])
    return (
        f"largest crate {crate} ({sizes[crate]} lines in src), largest file {file} ({found[file]} lines), "
        f"median Rust file {median_low(rust.values())} lines of {len(rust)}"
    )


def main() -> int:
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"]
    metadata = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout)
    arrows = folders(metadata)
    if found := circle(arrows):
        print(f"a circle of crates: {' -> '.join(found)}")
        return 1
    found = lines()
    if wrong := unix_only(metadata) + on_studies(metadata):
        print("\n".join(wrong))
        return 1
    if "--sizes" in sys.argv[1:]:
        print(table(list(arrows), found))
        return 0
    text = PAGE.read_text()
    new, count = PLACE.subn(lambda place: place[1] + picture(arrows) + place[2], text)
    if count != 1:
        print(f"{PAGE.name} has {count} places for the picture, one is due")
        return 1
    if "--write" in sys.argv[1:]:
        PAGE.write_text(new)
    elif new != text:
        print(f"the picture in {PAGE.name} is out of date: tests/suite/crates.py --write")
        return 1
    print(f"{len(arrows)} crates, no circle; {largest(list(arrows), found)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
