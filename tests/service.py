"""What the runs in tests/*/run share: a papilla-server with the shipped models, a look at it, and at the processor."""

import os
import platform
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
RELEASE = TARGET / "release"


def start(command: list, url: str, **how) -> subprocess.Popen:
    """A service, once it answers at URL; HOW goes to Popen."""
    service = subprocess.Popen(command, cwd=ROOT, **how)
    end = time.monotonic() + 60
    while time.monotonic() < end and service.poll() is None:
        try:
            urllib.request.urlopen(url)
            return service
        except OSError:
            time.sleep(0.1)
    service.kill()
    log = getattr(how.get("stdout"), "name", None)
    sys.exit(f"{command[0]} does not answer at {url}" + (f": see {log}" if log else ""))


def papilla(server: str, *arguments: str, **how) -> subprocess.Popen:
    """target/release/papilla-server at SERVER (host and port), ready."""
    command = [RELEASE / "papilla-server", "--bind", server, *arguments]
    return start(command, f"http://{server}/readyz", stdout=subprocess.DEVNULL, **how)


def resident_kib(pid: int) -> int:
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0])


def processor_entries() -> dict[str, str]:
    """What Linux says of the last processor, by name, such as `flags`."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    return {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}


def processor() -> str:
    """Its name, with family and model, since a virtual machine may name the maker alone; and the number of cores."""
    entries, cores = processor_entries(), f"{os.cpu_count()} cores"
    if not {"model name", "cpu family", "model"} <= entries.keys():
        return f"{platform.machine()}, {cores}"
    return "{model name} (family {cpu family}, model {model})".format_map(entries) + f", {cores}"
