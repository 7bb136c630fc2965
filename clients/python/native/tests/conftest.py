"""The tests run against the real service and the installed wheel.

`clients/conformance/run --only-serve wheel target/venv-wheel/bin/python -m pytest clients/python/native/tests`
"""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest


@pytest.fixture(scope="session")
def url() -> str:
    """The service that the runner started."""
    return os.environ["PAPILLA_URL"]


@pytest.fixture
def pressure_pa():
    """A press of 8 kPa on a part of the pad."""
    pressure_pa = np.zeros((224, 224), np.float32)
    pressure_pa[95:115, 105:130] = 8e3
    return pressure_pa


@pytest.fixture
def interrupted():
    """Runs a program that prints "ready", and sends it Ctrl-C after some seconds; what it prints then."""

    def run(program: str, after_s: float, within_s: float = 60.0) -> str:
        # What a shell starts in the background ignores Ctrl-C, and so do its children.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            running = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        finally:
            signal.signal(signal.SIGINT, before)
        assert running.stdout.readline() == "ready\n"
        time.sleep(after_s)
        running.send_signal(signal.SIGINT)
        return running.communicate(timeout=within_s)[0]

    return run
