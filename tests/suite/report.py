"""What a run came to: the last lines, JSON, and the page of reports."""

import json
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path

from schedule import Outcome

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from service import processor  # noqa: E402

RECORD = Path("docs/reports/tests.json")
PAGE = Path("docs/reports/tests.md")
INTRODUCTION = """# Tests: when each part last ran

`./test --record` writes this page, also together with `--fast` or `--all`. It notes each part that
it ran, and leaves all other rows as they are. A row tells how the part ended at the named commit.
If it failed there, it may work again by now: the messages of `git log docs/reports/tests.md` may
say so. `./test --all --list` says what the parts do that never ran.
[Testing](../guides/testing.md) explains the options. Processor seconds count all processes of a
part.

| part | of | last run | commit | processor | outcome | tests | wall, s | processor, s |
|---|---|---|---|---|---|---|---|---|
"""


def summary(outcomes: list[Outcome], wall_s: float) -> str:
    """The last lines; the very last one counts the parts."""
    count = {v: sum(o.verdict == v for o in outcomes) for v in ("passed", "failed", "skipped")}
    lines = [f"{'part':<16} {'':<8} {'tests':>6} {'wall, s':>8} {'processor, s':>13}"]
    for o in outcomes:
        tests = o.tests or ""
        lines.append(
            f"{o.step.name:<16} {o.verdict:<8} {tests:>6} {o.wall_s:>8.0f} {o.processor_s:>13.0f}"
            f"  {o.reason}".rstrip()
        )
    total_s = sum(o.processor_s for o in outcomes)
    lines.append(
        f"{sum(o.tests for o in outcomes)} tests in {wall_s / 60:.1f} min, "
        f"{total_s / 60:.1f} min of processor ({processor()})"
    )
    for o in outcomes:
        if o.verdict == "skipped":
            lines.append(f"skipped: {o.step.name}: {o.reason}")
    lines.append(
        f"parts: {count['passed']} passed, {count['failed']} failed, {count['skipped']} skipped"
    )
    return "\n".join(lines)


def as_json(outcomes: list[Outcome], wall_s: float) -> dict:
    """The same for programs."""
    return {
        "processor": processor(),
        "wall_s": round(wall_s, 1),
        "processor_s": round(sum(o.processor_s for o in outcomes), 1),
        "parts": [entry(o) for o in outcomes],
    }


def entry(o: Outcome) -> dict:
    return {
        "part": o.step.name,
        "does": o.step.does,
        "outcome": o.verdict,
        "reason": o.reason,
        "tests": o.tests,
        "wall_s": round(o.wall_s, 1),
        "processor_s": round(o.processor_s, 1),
    }


def record(o: Outcome, root: Path, belongs: dict[str, str]) -> None:
    """Notes a part that ended in the record and writes the page anew; other parts' rows stay."""
    path = root / RECORD
    rows = json.loads(path.read_text()) if path.exists() else {}
    git = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(git, cwd=root, capture_output=True, text=True, check=False).stdout.strip()
    when = datetime.now(timezone.utc).strftime("%Y-%m-%d")
    rows[o.step.name] = entry(o) | {"date": when, "commit": commit, "on": processor()}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({n: rows[n] for n in belongs if n in rows}, indent=1) + "\n")
    lines = [row(rows[n], of) if n in rows else never(n, of) for n, of in belongs.items()]
    (root / PAGE).write_text(INTRODUCTION + "".join(lines))


def never(name: str, of: str) -> str:
    return f"| `{name}` | {of} | never | | | | | | |\n"


def row(entry: dict, of: str) -> str:
    outcome = entry["outcome"] + (f": {entry['reason']}" if entry["reason"] else "")
    cells = [
        f"`{entry['part']}`: {entry['does']}",
        of,
        entry["date"],
        entry["commit"],
        entry["on"],
        outcome,
        entry["tests"] or "",
        f"{entry['wall_s']:.0f}",
        f"{entry['processor_s']:.0f}",
    ]
    return "| " + " | ".join(str(cell) for cell in cells) + " |\n"
