#!/usr/bin/env python3
"""Holds that third-party crates are compiled once, whichever of the programs is built.

    tests/suite/features.py

Compares the features with which cargo would compile each third-party crate for the service and for the
finite-element and model programs, without compiling anything. Exit code 1 names each difference;
`crates/same-features/Cargo.toml` is where the union has to stand.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ["papilla-server", "papilla-fe-datagen", "papilla-model-export", "papilla-studies", "papilla-python"]
Units = dict[tuple[str, str], set[str]]


def units(program: str) -> Units:
    """The features of every third-party library that is compiled for a program, by name and kind."""
    command = ["cargo", "build", "--release", "--offline", "-p", program, "--unit-graph", "-Zunstable-options"]
    # The graph of units is the only place where cargo says this; stable cargo hides it behind this variable.
    env = os.environ | {"RUSTC_BOOTSTRAP": "1"}
    graph = json.loads(subprocess.run(command, cwd=ROOT, env=env, capture_output=True, check=True).stdout)
    found: Units = {}
    for unit in graph["units"]:
        package = unit["pkg_id"]
        if unit["mode"] == "build" and package.startswith("registry+"):
            found.setdefault((package.split("#")[-1], unit["target"]["kind"][0]), set()).update(unit["features"])
    return found


def differences(one: Units, other: Units) -> list[str]:
    """A line for each crate that both need with other features."""
    return [
        f"{crate} ({kind}): " + ", ".join(sorted(one[crate, kind] ^ other[crate, kind]))
        for crate, kind in sorted(one.keys() & other.keys())
        if one[crate, kind] != other[crate, kind]
    ]


def main() -> int:
    first, *rest = [(program, units(program)) for program in PROGRAMS]
    wrong = [f"{first[0]} and {name}: {line}" for name, found in rest for line in differences(first[1], found)]
    print("\n".join(wrong))
    print(f"{len(PROGRAMS)} programs, {len(wrong)} crates would be compiled twice")
    if wrong:
        print("name these features in crates/same-features/Cargo.toml")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
