"""Round trips at a steady rate, as one line of JSON: `python -m papilla.bench` (docs/reports/clients.md).

`PAPILLA_URL` names the service.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from concurrent.futures import Future

import numpy as np

from .answer import Answer
from .http import DEFAULT_URL
from .sync import Session
from .wire import SIDE_PX


def main() -> None:
    parser = argparse.ArgumentParser(description="Round trips of the Python client.")
    parser.add_argument("--rate-hz", type=float, default=90.0)
    parser.add_argument("--duration-s", type=float, default=60.0)
    options = parser.parse_args()
    frames, warm_up = int(options.rate_hz * options.duration_s), int(options.rate_hz)
    v, u = np.mgrid[:SIDE_PX, :SIDE_PX]
    pressure_pa = (2e4 * np.exp(-((u - 112.0) ** 2 + (v - 112.0) ** 2) / 288)).astype(np.float32)
    times_us: list[float] = []
    with Session(os.environ.get("PAPILLA_URL", DEFAULT_URL), tier="half-space") as session:
        start = time.perf_counter() + 0.02
        for frame in range(warm_up + frames):
            due = start + frame / options.rate_hz
            time.sleep(max(0.0, due - time.perf_counter()))

            def done(sent: Future[Answer], due: float = due, counts: bool = frame >= warm_up) -> None:
                if counts and sent.result().status == "ok":
                    times_us.append(1e6 * (time.perf_counter() - due))

            session.send(pressure_pa).add_done_callback(done)
        time.sleep(1.0)
    p50, p99, most = np.percentile(times_us, [50, 99, 100]) if times_us else (0.0, 0.0, 0.0)
    report = {
        "client": "python",
        "rate_hz": options.rate_hz,
        "frames": len(times_us),
        "p50_us": round(float(p50)),
        "p99_us": round(float(p99)),
        "max_us": round(float(most)),
        "missing": frames - len(times_us),
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
