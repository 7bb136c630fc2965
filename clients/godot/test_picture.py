#!/usr/bin/env python3
"""Looks whether a picture of the example shows its finger, its objects and the arrow, by their colours: test_picture.py FILE."""

import struct
import sys
import zlib
from pathlib import Path


def pixels(png: bytes) -> list[tuple[int, int, int]]:
    """Pixels of a PNG of 8 bits with three or four channels, row by row."""
    at, data, width, height, channels = 8, b"", 0, 0, 0
    while at < len(png):
        (length,), kind = struct.unpack_from(">I", png, at), png[at + 4 : at + 8]
        body = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack_from(">IIBB", body)
            channels = {2: 3, 6: 4}[colour]
            assert depth == 8
        data += body if kind == b"IDAT" else b""
        at += 12 + length
    raw, stride, found, above = zlib.decompress(data), width * channels, [], bytearray(width * channels)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            left = line[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            near = left + above[i] - corner
            paeth = min((abs(near - left), 0, left), (abs(near - above[i]), 1, above[i]), (abs(near - corner), 2, corner))[2]
            line[i] = line[i] + (0, left, above[i], (left + above[i]) // 2, paeth)[kind] & 255
        found += [tuple(line[i : i + 3]) for i in range(0, stride, channels)]
        above = line
    return found


def main(file: str) -> None:
    seen = pixels(Path(file).read_bytes())
    colours = {
        "skin": lambda r, g, b: r > g + 15 > b + 15 and r > 100,
        "SED": lambda r, g, b: r > 1.55 * g and b > 0.95 * g and r > 60,
        "rubber": lambda r, g, b: b > r + 30 and b > g + 20,
        "plate and bar": lambda r, g, b: max(r, g, b) - min(r, g, b) < 12 and 40 < r < 200,
        "arrow": lambda r, g, b: g > r + 40 and g > b + 30,
    }
    counts = {name: sum(is_it(*pixel) for pixel in seen) for name, is_it in colours.items()}
    print(f"{file}: " + ", ".join(f"{count} pixels of {name}" for name, count in counts.items()))
    missing = [name for name, count in counts.items() if count < 20]
    if missing:
        raise SystemExit(f"the picture shows no {', no '.join(missing)}")


if __name__ == "__main__":
    main(sys.argv[1])
