"""What the example mujoco_hold.py comes to by each method of contact, for docs/reference/clients/python-inside.md.

    target/venv-mujoco/bin/python clients/python/native/mujoco/record.py [--write]

`clients/test mujoco` makes the environment. The ball rests for ten seconds and the block is held for ten. Prints the
table; --write puts it into the page.
"""

import importlib.util
import sys
from pathlib import Path

import mujoco

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "tests"))
from service import processor  # noqa: E402

EXAMPLE = ROOT / "clients/python/examples/mujoco_hold.py"
PAGE = ROOT / "docs/reference/clients/python-inside.md"
BEGIN, END = "<!-- begin: clients/python/native/mujoco/record.py writes this -->", "<!-- end -->"
METHODS = ("second_order", "coarse_pixels", "pixels")
REST_S = HOLD_S = 10.0
# The flag of a frame in which nothing touches, which is no fault.
NO_CONTACT = 0b10
# The ball has landed by then.
LANDING_S = 0.15


def example():
    """The module of the example."""
    spec = importlib.util.spec_from_file_location("mujoco_hold", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def row(of, method: str) -> str:
    """The figures of one method."""
    rested = of.rest(method, REST_S)
    found = of.figures(rested, of.pinch(method, HOLD_S), HOLD_S)
    flagged = rested[:, 3].astype(int) & ~NO_CONTACT != 0
    cells = [
        f"`{method}`",
        f"{found['rest_n']:.4f}",
        f"{100 * abs(found['rest_n'] / found['weight_n'] - 1):.3f}",
        f"{100 * found['ripple']:.2f}",
        f"{1e3 * abs(found['sagged_mm']):.1f}",
        f"{found['slips_at_share']:.3f}",
        str(int(flagged[rested[:, 0] < LANDING_S].sum())),
        str(int(flagged[rested[:, 0] >= LANDING_S].sum()) + found["flagged"]),
    ]
    return f"| {' | '.join(cells)} |\n"


def table() -> str:
    """What stands between the marks."""
    of = example()
    head = (
        f"\n\nMeasured on {processor()}, with MuJoCo {mujoco.__version__}.\n"
        f"The weight of the ball is {of.WEIGHT_N:.4f} N.\n\n"
        "| method | force on the ball at rest, N | off its weight, % | ripple, % | block moves in ten seconds, um | "
        "slips at this share of the greatest friction | flagged steps while the ball lands | flagged steps later |\n"
        "|---|---|---|---|---|---|---|---|\n"
    )
    return head + "".join(row(of, method) for method in METHODS) + "\n"


def main() -> int:
    text = table()
    print(text)
    if "--write" in sys.argv:
        page = PAGE.read_text()
        start = page.index(BEGIN) + len(BEGIN)
        PAGE.write_text(page[:start] + text + page[page.index(END, start) :])
    return 0


if __name__ == "__main__":
    sys.exit(main())
