"""`python -m papilla`: what a sensor felt, from a file to a file."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from .errors import BadInput, PapillaError
from .http import DEFAULT_URL

_TEACH = """\
The record has a header and a line for each moment: a column of times, then one for each taxel.

    time_ms,t0,t1,t2,t3
    0,0.0,0.0,0.1,0.0
    10,0.2,4.1,3.9,0.0

The sensor is described in TOML. Lengths are in mm, in the finger's frame: x runs from the fingertip back, y to
the right as the finger points ahead with the nail up, z out of the nail.

    [sensor]
    unit = "kPa"        # Pa, kPa, MPa, or N, mN: of (reading - offset) * gain
    noise = 0.1         # standard deviation of a reading
    dead = [3]          # taxels that say nothing

    [grid]              # a flat array; row 0 at the fingertip, column 0 at the least y
    rows = 2
    columns = 2
    pitch_mm = 2.0
    centre_mm = [11.25, 0, -6.53]    # the lowest point of the pad

Then, beside a running papilla-server (or with --url local, where Papilla's wheel is installed):

    python -m papilla sense record.csv --sensor glove.toml --out result.nc --picture result.png

The result has, for each moment: the map of pressure that reproduces the readings, and how well; strain energy
density (SED) and firing rates under the skin; force, contact area and other numbers; with --spikes, who fired when.
The error to expect of such a sensor, against finite elements, is printed. docs/guides/sensors.md has it all.
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m papilla", description="Papilla on files.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    sense = commands.add_parser(
        "sense",
        help="a record of a pressure sensor to SED, firing rates and spikes over time",
        description="Reads a record of a pressure sensor on a finger and writes what the finger felt.",
        epilog=_TEACH,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sense.add_argument("record", type=Path, help="CSV with a header, NPZ with times_s and readings, or a bag of ROS")
    sense.add_argument("--sensor", type=Path, required=True, metavar="TOML", help="what the sensor is and where")
    sense.add_argument("--out", type=Path, metavar="FILE", help="result: .nc, .npz, .csv or .nwb")
    sense.add_argument("--picture", type=Path, metavar="FILE", help="a picture of it: .png, .svg or .pdf")
    sense.add_argument("--spikes", action="store_true", help="simulated touch units and their spikes too")
    sense.add_argument("--no-maps", action="store_true", help="numbers alone; a map takes 0.2 MB a frame")
    sense.add_argument("--tier", help="model, as /v1/tiers lists them (default: the service's)")
    sense.add_argument(
        "--url",
        default=DEFAULT_URL,
        help="the service, or 'local' for none: this process computes (default: %(default)s)",
    )
    sense.add_argument("--token", help="a token of the service's, if it asks for one")
    sense.add_argument("--topic", help="topic of a bag of ROS that carries the readings")
    sense.add_argument("--rate-hz", type=float, help="frames a second, for a record without times")
    sense.add_argument("--json", action="store_true", help="print the summary as JSON")
    sense.set_defaults(run=_sense)
    _add_scenes(commands)
    return parser


def _add_scenes(commands: Any) -> None:
    words = "what a scene of finite elements would simulate, what it leaves out and why, and what it costs"
    explain = commands.add_parser("explain", help=words, description=f"Says {words}. Needs Papilla's wheel.")
    explain.add_argument("scene", type=Path, help="scene file (docs/reference/scenes.md)")
    explain.add_argument("--json", action="store_true", help="print it as JSON")
    explain.set_defaults(run=_explain)
    words = "solves a scene of finite elements"
    solve = commands.add_parser("solve", help=words, description=f"{words.capitalize()}. Needs Papilla's wheel.")
    solve.add_argument("scene", type=Path, help="scene file (docs/reference/scenes.md)")
    solve.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="folder for the results")
    solve.add_argument("--no-fields", action="store_true", help="no fields of the whole body (.vtu)")
    solve.set_defaults(run=_solve)


def _explain(options: argparse.Namespace) -> None:
    from .fe import Scene

    explanation = Scene(options.scene).explain()
    print(json.dumps(explanation) if options.json else str(explanation))


def _solve(options: argparse.Namespace) -> None:
    from .fe import Scene

    states = Scene(options.scene).run(fields=not options.no_fields, out=options.out, progress=sys.stderr.isatty())
    for state in states:
        flags = f", {', '.join(state.flags)}" if state.flags else ""
        force_n = " ".join(f"{value:.4f}" for value in state.force_n)
        print(f"state {state.number}: {state.depth_mm:.3f} mm deep, force {force_n} N{flags}")
    print(f"written to {options.out}")


def _sense(options: argparse.Namespace) -> None:
    from . import sensors
    from .sensors.sense import writer

    if options.out is not None:
        writer(options.out)
    if options.out is None and options.picture is None and not options.json:
        raise BadInput("out", "nothing would be kept: give --out, --picture or --json")
    how = sensors.describe_record(options.sensor)
    if options.rate_hz is not None:
        how["rate_hz"] = options.rate_hz
    if options.topic is not None:
        how["topic"] = options.topic
    record = sensors.read_record(options.record, **how)
    sensor = sensors.describe(options.sensor, url=options.url, token=options.token)
    effects = ["summary", "afferents", *(["spikes"] if options.spikes else [])]
    sensed = sensors.sense(
        record, sensor, url=options.url, token=options.token, tier=options.tier, effects=effects,
        maps=not options.no_maps, progress=sys.stderr.isatty(),
    )  # fmt: skip
    if options.picture is not None:
        from .sensors.plots import overview

        overview(options.picture, record, sensor, sensed)
    if options.out is not None:
        sensed.save(options.out)
    found = sensed.summary()
    if options.json:
        print(json.dumps(found))
        return
    print(f"{found['frames']} frames over {found['duration_s']:.3g} s, model {found['tier']}")
    print(f"force at most {found['force_max_n']:.3g} N, SED at most {found['sed_max_j_per_m3']:.0f} J/m3")
    print(f"all SA1 afferents at most {found['sa1_rate_max_hz']:.0f} spikes a second")
    print(f"where it presses, the maps miss the readings by {100 * found['reproduction_error_max']:.1f} % at most")
    due = sensed.expected
    print(
        f"expected error against finite elements (median): SED {100 * due.sed_relative_l2:.0f} %, "
        f"force {100 * due.force_relative:.0f} %, SA1 {100 * due.sa1_relative:.0f} %"
    )
    for words in sensed.warnings:
        print(f"note: {words}", file=sys.stderr)


def main() -> int:
    options = _parser().parse_args()
    try:
        options.run(options)
    except PapillaError as error:
        print(f"papilla: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
