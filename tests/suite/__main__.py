"""Runs the tests: ./test --help."""

import argparse
import json
import os
import sys
import time
from pathlib import Path

import report
import steps
from schedule import Run, Step

ROOT = Path(__file__).resolve().parents[2]
EPILOG = """\
Installs what the parts need beyond the Rust toolchain, Python 3.11, Node 20 and gcc, and says so
first. Parts run two at a time; the output of each goes to target/test-logs. The last line counts
parts that passed, failed and were skipped, with the reason of each skip above it.
docs/guides/testing.md says what each part is for.

exit codes: 0 no part failed, 1 a part failed, 2 wrong usage
examples:   ./test --fast
            ./test --only rust
            ./test --all --record
"""

# Minutes of the wall, the build among them.
MINUTES = {"fast": "15 min", "full": "25 min", "all": "some hours"}


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./test",
        description="Runs the tests: all but the long forms, without options.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--fast", action="store_true", help="Rust alone: build, tests, data, lints")
    which.add_argument("--all", action="store_true", help="the long forms as well")
    parser.add_argument(
        "--only", action="append", default=[], metavar="PART", help="this part and what it needs"
    )
    parser.add_argument("--list", action="store_true", help="name the parts and end")
    parser.add_argument("--lanes", type=int, default=2, metavar="N", help="parts at a time [2]")
    parser.add_argument("--json", metavar="FILE", help="write the outcome to this file as well")
    parser.add_argument(
        "--record", action="store_true", help=f"note the outcome in {report.PAGE} as well"
    )
    return parser.parse_args()


def chosen(only: list[str], all_steps: list[Step]) -> list[Step]:
    """The named steps and all that they come after."""
    by_name = {step.name: step for step in all_steps}
    unknown = [name for name in only if name not in by_name]
    if unknown:
        print(f"no part {', '.join(unknown)}; there are {', '.join(by_name)}", file=sys.stderr)
        sys.exit(2)
    due, left = set(), list(only)
    while left:
        name = left.pop()
        if name not in due:
            due.add(name)
            left.extend(by_name[name].after)
    return [step for step in all_steps if step.name in due]


def environment(asks_anew: bool) -> dict[str, str]:
    """What the steps see: where things are built, and nothing of a developer's colours."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
    return os.environ | {
        "CARGO_TARGET_DIR": str(target),
        "TARGET": str(target),
        "BIN": str(target / "debug"),
        "PAPILLA_SERVER": str(target / "debug" / "papilla-server"),
        "FEATURES": steps.FEATURES,
        "CARGO_INCREMENTAL": "0",
        "CARGO_TERM_COLOR": "never",
        "NO_COLOR": "1",
        "PYTHONUNBUFFERED": "1",
        # Property tests ask the same each time, so that a change is judged and not its luck; other
        # questions: PROPTEST_RNG_SEED=... ./test, and the long form asks new ones itself.
        **({"PROPTEST_RNG_SEED": os.environ.get("PROPTEST_RNG_SEED", "1")} if not asks_anew else {}),
    } | steps.lints()


def main() -> int:
    chosen_options = options()
    extent = "fast" if chosen_options.fast else "all" if chosen_options.all else "full"
    everything = steps.extent("all")
    suite = chosen(chosen_options.only, everything) if chosen_options.only else steps.extent(extent)
    if chosen_options.list:
        for step in suite:
            print(f"{step.name:<16} {step.does}")
        return 0
    for step in suite:
        if step.installs:
            print(f"installs: {step.installs}")
    print(f"takes {MINUTES[extent]} where measured (two cores), and the installs once", flush=True)
    begun = time.monotonic()
    surroundings = environment(asks_anew=extent == "all")
    logs = Path(surroundings["TARGET"]) / "test-logs"
    run = Run(suite, ROOT, logs, surroundings, chosen_options.lanes)
    if chosen_options.record:
        extents = [("./test --fast", "fast"), ("./test", "full"), ("./test --all", "all")]
        belongs = {s.name: of for of, name in reversed(extents) for s in steps.extent(name)}
        order = {step.name: belongs[step.name] for step in everything}
        run.note = lambda outcome: report.record(outcome, ROOT, order)
    outcomes = run.go()
    wall_s = time.monotonic() - begun
    if chosen_options.json:
        text = json.dumps(report.as_json(outcomes, wall_s), indent=1)
        Path(chosen_options.json).write_text(text + "\n")
    print("\n" + report.summary(outcomes, wall_s), flush=True)
    return 1 if any(o.verdict == "failed" for o in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main())
