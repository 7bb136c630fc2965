#!/usr/bin/env python3
"""The index of the hand model that WebXR pages show, as a finger.

    npm pack @webxr-input-profiles/assets@1.0.20 && tar xzf webxr-input-profiles-assets-1.0.20.tgz
    python studies/hand_model.py package/dist/profiles/generic-hand/right.glb --out out/hand

Cuts the last two phalanges of the index out of the hand, by the joints to which the model's corners belong,
and fits a finger to them: `fe-datagen finger from-surface`. The joints say where the tip is, and the axis.
The model is of the package @webxr-input-profiles/assets (MIT licence, 1.0.20 was tried); any GLB with the
joints' names of WebXR will do. Writes OUT/index.obj and the bundle OUT/index.

Needs numpy and fe-datagen: FE_DATAGEN, or PATH.
"""

import argparse
import json
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np

TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
DISTAL, INTERMEDIATE = "index-finger-phalanx-distal", "index-finger-phalanx-intermediate"


def read(path: Path):
    """Corners (m), triangles, the joint that moves each corner most, and the joints' places (m)."""
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    document, binary = json.loads(data[20 : 20 + length]), data[20 + length + 8 :]

    def array(number: int):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        parts = PARTS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        kind = TYPES[accessor["componentType"]]
        return np.frombuffer(binary, kind, accessor["count"] * parts, start).reshape(-1, parts)

    (primitive,) = document["meshes"][0]["primitives"]
    of = {name: array(number) for name, number in primitive["attributes"].items()}
    nodes, skin = document["nodes"], document["skins"][0]
    names = [nodes[joint]["name"] for joint in skin["joints"]]
    strongest = of["WEIGHTS_0"].argmax(1)
    joints = [names[own[k]] for own, k in zip(of["JOINTS_0"].tolist(), strongest.tolist(), strict=True)]
    # Where a joint is at rest: the inverse of what takes the hand into its frame.
    rest = array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).astype(float)
    places = {name: np.linalg.inv(own)[3, :3] for name, own in zip(names, rest, strict=True)}
    corners = of["POSITION"].astype(float)
    return corners, array(primitive["indices"]).reshape(-1, 3), np.array(joints), places


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/hand"))
    options = parser.parse_args()
    datagen = shutil.which(os.environ.get("FE_DATAGEN", "fe-datagen"))
    if datagen is None:
        sys.exit("there is no program fe-datagen: build it, and name it by FE_DATAGEN")
    corners, triangles, joints, places = read(options.model)
    kept = np.isin(joints, [DISTAL, INTERMEDIATE, "index-finger-tip"])
    triangles = triangles[kept[triangles].all(1)]
    axis = places[INTERMEDIATE] - places[DISTAL]
    axis /= np.linalg.norm(axis)
    used = np.unique(triangles)
    along = (corners[used] - places[DISTAL]) @ axis
    tip = corners[used[along.argmin()]]
    # Nails look out of the plane of index and little finger, to the side where the thumb is not.
    index, little = places["index-finger-phalanx-proximal"], places["pinky-finger-phalanx-proximal"]
    nail = np.cross(little - index, axis)
    nail *= -np.sign(nail @ (places["thumb-tip"] - index))
    options.out.mkdir(parents=True, exist_ok=True)
    lines = ["v {} {} {}".format(*corner) for corner in corners.tolist()]
    lines += ["f {} {} {}".format(*triangle) for triangle in (triangles + 1).tolist()]
    surface = options.out / "index.obj"
    surface.write_text("\n".join(lines) + "\n")
    vectors = {"tip": tip, "axis": axis, "nail": nail / np.linalg.norm(nail)}
    words = ["finger", "from-surface", surface, "--unit", "m"]
    words += [f"--{name}=" + ",".join(f"{v:.6f}" for v in vector) for name, vector in vectors.items()]
    words += ["--who", "index of the WebXR generic hand", "--licence", "MIT", "--out", options.out / "index"]
    print("+", datagen, *words, file=sys.stderr)
    sys.exit(subprocess.run([datagen, *map(str, words)], check=False).returncode)


if __name__ == "__main__":
    main()
