"""A running service with the shipped models, and one press to render."""

import json
import os
import subprocess
import urllib.request

import numpy as np
import pytest


class Service:
    """The binary on a free port of the loopback."""

    def __init__(self, *arguments):
        command = [os.environ["PAPILLA_SERVER"], "--bind", "127.0.0.1:0", "--json", "--log", "error",
                   "--calibration-ms", "1", *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.started = json.loads(self.process.stdout.readline())
        self.address = f"127.0.0.1:{self.started['port']}"

    def get(self, path, accept="*/*"):
        request = urllib.request.Request(f"http://{self.address}{path}", headers={"accept": accept})
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.read(), answer.headers

    def post(self, path, body):
        request = urllib.request.Request(f"http://{self.address}{path}", data=body,
                                         headers={"content-type": "application/octet-stream"})
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.read()

    def stop(self):
        """SIGTERM; returns the exit code."""
        self.process.terminate()
        return self.process.wait(timeout=60)


@pytest.fixture(scope="session")
def service():
    service = Service()
    yield service
    assert service.stop() == 0, "the service did not drain"


@pytest.fixture(scope="session")
def pressure_pa(service):
    """An FE press, Pa, shape (1, 1, 224, 224)."""
    raw, _ = service.get("/v1/presses/0/pressure")
    return np.frombuffer(raw, dtype="<f4").reshape(1, 1, 224, 224)


@pytest.fixture(scope="session")
def sed_j_per_m3(service, pressure_pa):
    """What POST /v1/sed makes of it, J/m3: what every other client must get as well."""
    raw = service.post("/v1/sed?tier=nano", pressure_pa.tobytes())
    return np.frombuffer(raw, dtype="<f4").reshape(1, 1, 224, 224)
