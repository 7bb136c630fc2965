"""Errors that a user can act on, each with the exit code of its kind."""

from __future__ import annotations


class TrainerError(Exception):
    """Base of all errors that are reported in one line, without a traceback."""

    exit_code = 1
    code = "error"


class CheckError(TrainerError):
    """A model failed its checks."""

    exit_code = 1
    code = "check_failed"


class UsageError(TrainerError):
    """The command line asks for something that does not exist."""

    exit_code = 2
    code = "usage"


class DatasetError(TrainerError):
    """The dataset is missing, damaged or of another format."""

    exit_code = 3
    code = "bad_dataset"


class RunError(TrainerError):
    """The run directory does not fit what was asked (exists already, other settings, no run)."""

    exit_code = 4
    code = "bad_run"
