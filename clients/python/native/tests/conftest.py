"""The tests run against the real service and the installed wheel.

`clients/conformance/run --only-serve wheel target/venv-wheel/bin/python -m pytest clients/python/native/tests`
"""

import os

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
