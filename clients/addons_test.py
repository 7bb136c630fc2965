#!/usr/bin/env python3
"""Checks the folders that Godot's asset library and Unreal's plugin folder take as they are."""

import configparser
import json
import re
import sys
from pathlib import Path

CLIENTS = Path(__file__).resolve().parent


def godot(project: Path) -> list[str]:
    """An add-on lies in addons/NAME with plugin.cfg, and names no file outside of itself."""
    folder = project / "addons" / "papilla"
    plugin = configparser.ConfigParser()
    plugin.read(folder / "plugin.cfg")
    found = []
    for member in ("name", "description", "author", "version", "script"):
        if not plugin.get("plugin", member, fallback=""):
            found.append(f"{folder / 'plugin.cfg'}: no {member}")
    if not (folder / plugin["plugin"]["script"].strip('"')).is_file():
        found.append(f"{folder / 'plugin.cfg'}: no script")
    for script in folder.rglob("*.gd"):
        for path in re.findall(r'"res://([^"]+)"', script.read_text()):
            if not path.startswith("addons/papilla/") or not (project / path).is_file():
                found.append(f"{script}: res://{path} is not of the add-on")
    return found


def unreal(folder: Path) -> list[str]:
    """A plugin has its descriptor beside Source, and each module a build file and a type."""
    file = folder / f"{folder.name}.uplugin"
    plugin = json.loads(file.read_text())
    found = []
    if plugin["FileVersion"] != 3 or not re.fullmatch(r"\d+\.\d+\.\d+", plugin["VersionName"]):
        found.append(f"{file}: FileVersion or VersionName")
    for module in plugin["Modules"]:
        build = folder / "Source" / module["Name"] / f"{module['Name']}.Build.cs"
        if not build.is_file() or f"class {module['Name']} " not in build.read_text():
            found.append(f"{file}: no module {module['Name']} in {build}")
        if module["Type"] != "Runtime":
            found.append(f"{file}: {module['Name']} is not there in a game")
    return found


if __name__ == "__main__":
    wrong = [fault for version in (3, 4) for fault in godot(CLIENTS / "godot" / f"godot{version}")]
    wrong += unreal(CLIENTS / "unreal" / "Papilla")
    print("\n".join(wrong) or "ok addons: Godot 3, Godot 4, Unreal")
    sys.exit(1 if wrong else 0)
