#!/usr/bin/env python3
"""Checks a folder as Unity's package manager takes it from a git URL: package.py FOLDER.

Unity itself is not here. What it asks for: package.json with name and version, an assembly definition for
scripts, samples that exist with a scene whose references lead somewhere, and one .meta file with a GUID of its own for each file and folder that it
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


# Meshes and materials that Unity has within itself.
BUILT_IN = {"0000000000000000e000000000000000", "0000000000000000f000000000000000"}


def guids_of(folder: Path) -> dict[str, Path]:
    """Files below a folder by the GUID of their meta files."""
    found = {}
    for meta in folder.rglob("*.meta"):
        guid = re.search(r"^guid: ([0-9a-f]{32})$", meta.read_text(), re.M)
        if guid:
            found[guid[1]] = meta.with_suffix("")
    return found


def sample_faults(sample: Path, package: Path) -> list[str]:
    """What of a sample's scene, materials and scripts leads nowhere once the sample lies in a project."""
    files = [path for path in sample.rglob("*") if path.is_file() and path.suffix != ".meta"]
    found = [f"{path}: no meta file" for path in files if not path.with_name(path.name + ".meta").is_file()]
    found += [] if any(path.suffix == ".unity" for path in files) else [f"{sample}: no scene"]
    known = guids_of(package / "Runtime") | guids_of(sample)
    if len(guids_of(sample)) != len(files):
        found.append(f"{sample}: two files have one GUID")
    for path in (p for p in files if p.suffix in (".unity", ".mat")):
        text = path.read_text()
        found += [f"{path}: there is no {guid}" for guid in set(re.findall(r"guid: ([0-9a-f]{32})", text)) - set(known) - BUILT_IN]
        objects = re.findall(r"^--- !u!\d+ &(\d+)$", text, re.M)
        if len(set(objects)) != text.count("\n--- "):
            found.append(f"{path}: an object's number is used twice, or cannot be read")
        found += [f"{path}: there is no object {i}" for i in set(re.findall(r"\{fileID: (\d+)\}", text)) - set(objects) - {"0"}]
        for block in text.split("\n--- ")[1:]:
            script = re.search(r"m_Script: \{fileID: 11500000, guid: ([0-9a-f]{32}), type: 3\}", block)
            if script and script[1] in known:
                found += script_faults(path, block, known[script[1]])
    return found


def script_faults(scene: Path, block: str, script: Path) -> list[str]:
    """Unity finds a script's class by the name of its file, and fills its fields by their names."""
    code = script.read_text()
    found = [] if re.search(rf"class {script.stem} : MonoBehaviour", code) else [f"{script}: no class {script.stem}"]
    fields = set(re.findall(r"\[SerializeField\] [\w.\[\]]+ (\w+)", code))
    said = {name for name in re.findall(r"^  (\w+):", block, re.M) if not name.startswith("m_")}
    return found + [f"{scene}: {script.name} and the scene differ in {', '.join(sorted(fields ^ said))}"] if fields != said else found


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
        found += sample_faults(folder / sample["path"], folder)
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
