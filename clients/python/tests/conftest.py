"""The tests run against the real service.

`clients/conformance/run --only-serve python python -m pytest clients/python`
"""

import os

import pytest


@pytest.fixture(scope="session")
def url() -> str:
    """The service that the runner started."""
    return os.environ["PAPILLA_URL"]
