#!/usr/bin/env python3
"""Draws the workspace's crates and what each is built with, from `cargo metadata`.

    tests/suite/crates.py [--write]

Without --write compares the picture in ARCHITECTURE.md with the workspace. Exit code 1 if it is out
of date or if crates need each other in a circle; dependencies of tests alone are not drawn.
"""

import json
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "ARCHITECTURE.md"
PLACE = re.compile(r"(<!-- tests/suite/crates\.py -->\n).*?(<!-- end -->\n)", re.DOTALL)
Arrows = dict[str, set[str]]


def folders(metadata: dict) -> Arrows:
    """The folder of each crate of the workspace, and the folders of the crates it is built with."""
    root = Path(metadata["workspace_root"])
    where = {p["name"]: str(Path(p["manifest_path"]).parent.relative_to(root)) for p in metadata["packages"]}
    return {
        where[p["name"]]: {where[d["name"]] for d in p["dependencies"] if d["name"] in where and d["kind"] != "dev"}
        for p in metadata["packages"]
    }


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


def main() -> int:
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"]
    arrows = folders(json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout))
    if found := circle(arrows):
        print(f"a circle of crates: {' -> '.join(found)}")
        return 1
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
    print(f"{len(arrows)} crates, no circle")
    return 0


if __name__ == "__main__":
    sys.exit(main())
