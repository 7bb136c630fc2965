#!/usr/bin/env python3
"""Holds the documents to their rules: links, length of lines, plots.

    tests/suite/documents.py [--words]

In every tracked Markdown file each relative link leads to a file or folder of the repository and
each anchor to a heading. Hand-written files keep to LINE_MAX columns outside of tables, code and
links. Reports (docs/reports, studies/reports) are written by commands: of them only links are
looked at. No text of a plot (an .svg of docs or studies) is cut off by the picture's edge. The
number of words has no limit; --words prints each file's. A word is anything between blanks that
holds a letter; tables count, fenced code, comments and the targets of links do not.
No line is left over from a merge. A page that shows SED says in which finger. Exit code 1 if a rule is broken.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]
LINE_MAX = 100
# Files that a command writes.
GENERATED = re.compile(r"(docs|studies)/reports/")
# Heads of such files; they are looked at where they end up.
HEADS = re.compile(r".*/(introduction|head)\.md$")
FENCE = re.compile(r"^\s*(```+|~~~+)")
LINK = re.compile(r"\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\)")
# Mean width of a letter over its height.
LETTER = 0.5
# Marks of a merge, also shortened ones. A heading is never underlined here.
MERGE = re.compile(r"(<{3,}|={3,}|>{3,}|\|{7})( |$)")
# A page that shows SED: as often as this it names it, and gives a figure.
FIGURES_MIN = 5
OUTSIDE = re.compile(r"^[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def prose(text: str) -> Iterator[tuple[int, str]]:
    """The lines outside of fenced code, with their numbers."""
    fence = ""
    for number, line in enumerate(text.splitlines(), 1):
        found = FENCE.match(line)
        if fence:
            if found and found[1].startswith(fence) and not line.strip().strip(found[1][0]):
                fence = ""
        elif found:
            fence = found[1]
        else:
            yield number, line


def anchors(text: str) -> set[str]:
    """The anchors that GitHub gives to the headings."""
    found: set[str] = set()
    for _, line in prose(text):
        if heading := re.match(r"#{1,6}\s+(.*?)\s*#*$", line):
            title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading[1])
            slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
            name, repeat = slug, 0
            while name in found:
                repeat += 1
                name = f"{slug}-{repeat}"
            found.add(name)
    return found


def without_code(text: str) -> str:
    """The text with code left empty, line by line as it was."""
    lines = [""] * len(text.splitlines())
    for number, line in prose(text):
        lines[number - 1] = re.sub(r"(`+)(?!`).*?\1", "", line)
    return "\n".join(lines)


def broken_links(path: Path, text: str) -> Iterator[str]:
    """A line for each link that leads nowhere."""
    shown = without_code(text)
    for link in LINK.finditer(shown):
        target = link[1]
        if OUTSIDE.match(target):
            continue
        number = shown.count("\n", 0, link.start()) + 1
        name, _, anchor = unquote(target).partition("#")
        there = path.parent / name if name else path
        if not there.exists():
            yield f"{number}: no such file: {target}"
        elif anchor and there.suffix == ".md" and anchor not in anchors(there.read_text()):
            yield f"{number}: no such heading: {target}"


def long_lines(text: str) -> Iterator[str]:
    """A line for each line of prose that is too long, without addresses of links and comments."""
    for number, line in prose(text):
        shown = re.sub(r"\]\([^)]*\)|<!--.*?-->", "]", line)
        if not line.lstrip().startswith(("|", "![")) and len(shown) > LINE_MAX:
            yield f"{number}: {len(shown)} columns, {LINE_MAX} are the most"


def merge_lines(text: str) -> Iterator[str]:
    """A line for each line outside of code that a merge has left behind."""
    for number, line in prose(text):
        if MERGE.match(line):
            yield f"{number}: left over from a merge: {line}"


def unnamed_finger(text: str) -> Iterator[str]:
    """A page with figures of SED says in which finger; a reader may take it for a person's."""
    figures = len(re.findall(r"\d (?:%|J/m3)", text))
    if min(len(re.findall(r"\bSED\b", text)), figures) >= FIGURES_MIN and not re.search(r"default\s+finger", text):
        yield "1: shows SED, and does not say in which finger: name the default finger, or another one"


def words(text: str) -> int:
    """Words outside of fenced code, comments and the targets of links."""
    shown = "\n".join(line for _, line in prose(text))
    shown = re.sub(r"<!--.*?-->", "", shown, flags=re.DOTALL)
    shown = re.sub(r"\]\([^)]*\)", "]", shown)
    return sum(1 for word in shown.split() if re.search(r"[^\W\d_]", word))


def cut_off(svg: str) -> Iterator[str]:
    """A line for each level text that reaches beyond the picture."""
    width = re.search(r"<svg width=\"(\d+)\"", svg)
    # matplotlib draws letters as paths, and sees to this itself.
    for tag, said in re.findall(r"<text ([^>]*)>\s*([^<]*?)\s*</text>", svg) if width else ():
        of = dict(re.findall(r"([\w-]+)=\"([^\"]*)\"", tag))
        if "transform" in of:
            continue
        x, long = float(of["x"]), LETTER * float(of["font-size"]) * len(said)
        left = x - long * {"start": 0.0, "middle": 0.5, "end": 1.0}[of.get("text-anchor", "start")]
        if left < 0 or left + long > float(width[1]):
            yield f"'{said}' reaches from {left:.0f} to {left + long:.0f} px of {width[1]}"


def main() -> int:
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = sorted(name for name in listed.split("\0") if name and (ROOT / name).exists())
    wrong, counts = [], {}
    for name in files:
        path = ROOT / name
        text = path.read_text()
        if HEADS.match(name):
            continue
        rules = [*broken_links(path, text), *merge_lines(text), *unnamed_finger(text)]
        if not GENERATED.match(name):
            rules += long_lines(text)
            counts[name] = words(text)
        wrong += [f"{name}:{rule}" for rule in rules]
    if "--words" in sys.argv[1:]:
        print("\n".join(f"{count:6} {name}" for name, count in counts.items()))
    for path in sorted(plot for folder in ("docs", "studies") for plot in (ROOT / folder).rglob("*.svg")):
        wrong += [f"{path.relative_to(ROOT)}: {fault}" for fault in cut_off(path.read_text())]
    total = sum(counts.values())
    print("\n".join(wrong))
    print(f"{len(files)} documents, {total} words by hand, {len(wrong)} faults")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
