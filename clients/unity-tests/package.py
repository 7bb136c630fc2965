#!/usr/bin/env python3
"""Checks a folder as Unity's package manager takes it from a git URL: package.py FOLDER.

Unity itself is not here. What it asks for: package.json with name and version, an assembly definition for
scripts, samples that exist, and one .meta file with a GUID of its own for each file and folder that it
imports (a package from git is read-only, so Unity cannot write a missing one and leaves the file out).
"""

import json
import re
import subprocess
import sys
from pathlib import Path


def imported(folder: Path) -> list[Path]:
    """The committed files and folders that Unity imports: all but hidden ones and those that end with ~."""
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "."], cwd=folder, capture_output=True, text=True, check=True)
    files = [Path(line) for line in listed.stdout.splitlines()]
    both = {part for file in files for part in (file, *file.parents) if part != Path(".")}
    return sorted(p for p in both if not any(n.startswith(".") or n.endswith("~") for n in p.parts))


def faults(folder: Path) -> list[str]:
    found = []
    package = json.loads((folder / "package.json").read_text())
    if not re.fullmatch(r"[a-z0-9-]+(\.[a-z0-9-]+){2,}", package["name"]):
        found.append(f"package.json: name {package['name']}")
    if not re.fullmatch(r"\d+\.\d+\.\d+", package["version"]):
        found.append(f"package.json: version {package['version']}")
    for sample in package.get("samples", []):
        if not any((folder / sample["path"]).glob("*.cs")):
            found.append(f"sample {sample['displayName']}: no script in {sample['path']}")
    paths = imported(folder)
    metas = {p for p in paths if p.suffix == ".meta"}
    guids: dict[str, Path] = {}
    for path in (p for p in paths if p.suffix != ".meta"):
        meta = path.with_name(path.name + ".meta")
        if meta not in metas:
            found.append(f"{path}: no {meta.name}")
            continue
        guid = re.search(r"^guid: ([0-9a-f]{32})$", (folder / meta).read_text(), re.M)
        if not guid:
            found.append(f"{meta}: no guid")
        elif guid[1] in guids:
            found.append(f"{meta}: the guid of {guids[guid[1]]}")
        else:
            guids[guid[1]] = path
        metas.discard(meta)
    found += [f"{meta}: there is no such file" for meta in sorted(metas)]
    scripts = [p for p in paths if p.suffix == ".cs"]
    for script in scripts:
        if not any(list((folder / parent).glob("*.asmdef")) for parent in script.parents):
            found.append(f"{script}: in no assembly")
    return found


if __name__ == "__main__":
    wrong = faults(Path(sys.argv[1]))
    print("\n".join(wrong) or "ok unity: package, assemblies, samples, meta files")
    sys.exit(1 if wrong else 0)
