#!/usr/bin/env python3
"""Prints the software bill of materials of a crate as CycloneDX 1.5: sbom.py PACKAGE TARGET.

The crates are those that `cargo tree` links into it: no tool of the build, nothing of tests. Versions,
licences and the graph come from `cargo metadata`, checksums from Cargo.lock.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path


def cargo(*arguments: str) -> str:
    return subprocess.run(["cargo", *arguments], capture_output=True, text=True, check=True).stdout


def linked(package: str, target: str) -> set[tuple[str, str]]:
    """Name and version of each crate that is linked."""
    options = ["--locked", "-e", "normal", "--prefix", "none", "--no-dedupe", "--format", "{p}"]
    lines = cargo("tree", "-p", package, "--target", target, *options).splitlines()
    words = (line.split() for line in lines if line)
    # A macro runs in the compiler.
    return {(w[0], w[1].removeprefix("v")) for w in words if "(proc-macro)" not in w}


def component(package: dict, checksums: dict[tuple[str, str], str]) -> dict:
    name, version = package["name"], package["version"]
    made = {
        "type": "library",
        "bom-ref": f"pkg:cargo/{name}@{version}",
        "name": name,
        "version": version,
        "purl": f"pkg:cargo/{name}@{version}",
        # Old crates write a slash for OR.
        "licenses": [{"expression": package["license"].replace("/", " OR ")}],
    }
    if checksum := checksums.get((name, version)):
        made["hashes"] = [{"alg": "SHA-256", "content": checksum}]
    return made


def main() -> None:
    package, target = sys.argv[1:]
    wanted = linked(package, target)
    metadata = json.loads(cargo("metadata", "--locked", "--format-version", "1", "--filter-platform", target))
    lock = tomllib.loads(Path("Cargo.lock").read_text())
    checksums = {(p["name"], p["version"]): p["checksum"] for p in lock["package"] if "checksum" in p}
    packages = {p["id"]: p for p in metadata["packages"] if (p["name"], p["version"]) in wanted}
    made = {id_: component(p, checksums) for id_, p in packages.items()}
    root = next(made[id_] for id_, p in packages.items() if p["name"] == package)
    graph = []
    for node in metadata["resolve"]["nodes"]:
        if node["id"] in made:
            normal = [d["pkg"] for d in node["deps"] if any(k["kind"] is None for k in d["dep_kinds"])]
            needs = sorted(made[id_]["bom-ref"] for id_ in normal if id_ in made)
            graph.append({"ref": made[node["id"]]["bom-ref"], "dependsOn": needs})
    sbom = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": root},
        "components": sorted((c for c in made.values() if c is not root), key=lambda c: c["bom-ref"]),
        "dependencies": sorted(graph, key=lambda g: g["ref"]),
    }
    print(json.dumps(sbom, indent=1))


if __name__ == "__main__":
    main()
