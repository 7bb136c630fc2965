"""Campaigns: many simulations of one finger, solved into a dataset."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ..errors import BadInput
from ..model import native
from .datasets import Dataset
from .source import Explanation, Source, read

if TYPE_CHECKING:
    from .. import _native

Progress = bool | Callable[[int, int, str], None] | None
"""True draws a line on stderr; a function gets the simulations that are done, all of them, and a word for people."""

_STOPPING: Final = "stopping: each simulation is stored at its next state; Ctrl-C again leaves at once"


class Report(dict[str, Any]):
    """What came of a run: members of `fe-datagen generate --json`; `print` shows the text."""

    def __init__(self, members: dict[str, Any], text: str) -> None:
        super().__init__(members)
        self.text = text

    def __str__(self) -> str:
        return self.text

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Simulations that came to nothing: `id`, `indenter` and `error` of each."""
        found: list[dict[str, Any]] = self["slice"]["failed"]
        return found

    @property
    def left(self) -> int:
        """Simulations that this run did not come to, because it was stopped."""
        return int(self["slice"]["left"])


class Campaign:
    """A campaign: a distribution of simulations of one finger.

    `source` is the path of a TOML file, TOML text, or a dict with the members of such a file
    (docs/reference/dataset.md). Raises BadScene, whose `field` says where.
    """

    def __init__(self, source: Source) -> None:
        self._native: _native.Campaign = native().Campaign(*read(source, "campaign.toml"))

    def as_dict(self) -> dict[str, Any]:
        """The campaign as the manifest of its dataset holds it."""
        members: dict[str, Any] = json.loads(self._native.json())
        return members

    def explain(self) -> Explanation:
        """What its simulations take, by indenter, and which of them would fail; nothing is solved. Raises BadScene."""
        members, text = self._native.explain()
        return Explanation(json.loads(members), text)

    def run(
        self,
        folder: str | os.PathLike[str],
        *,
        threads: int | None = None,
        slice: tuple[int, int] = (1, 1),
        retry_failed: bool = True,
        progress: Progress = None,
    ) -> Report:
        """Solves the campaign into a folder, one simulation on each core, or goes on with what is there.

        `threads` simulations are solved at a time. `slice=(i, n)` solves the i-th of n parts, from 1; any number of
        processes may share the folder, and a run without a slice, after all of them, makes the dataset. A simulation
        that failed in an earlier run is tried again, unless `retry_failed` is False.

        Ctrl-C lets each simulation be stored at its next state, and then raises KeyboardInterrupt; a second one
        raises it at once. Either way the folder is good: the same call goes on from there, and the bytes of the
        dataset are those of a run that was never interrupted.

        Raises BadDataset where the folder is of another campaign or cannot be written, BadScene, and NotSolved if
        every simulation failed.
        """
        if threads is not None and threads < 1:
            raise BadInput("threads", f"{threads}; at least one simulation is solved at a time")
        run = self._native.run(Path(folder), threads, slice, retry_failed)
        told = _Told(progress)
        interrupt: KeyboardInterrupt | None = None
        while True:
            try:
                found = run.wait()
                told.tell(*run.counts(), _STOPPING if interrupt else "")
            except KeyboardInterrupt as first:
                run.stop()
                if interrupt is not None:
                    raise
                interrupt = first
                continue
            except BaseException:
                run.stop()
                told.end()
                raise
            if found is not None:
                told.end()
                if interrupt is not None:
                    raise interrupt
                return Report(json.loads(found[0]), found[1])

    def dataset(self, folder: str | os.PathLike[str]) -> Dataset:
        """The dataset that `run` made in a folder. Raises BadDataset, also if it is of another campaign."""
        return Dataset(folder).of_campaign(self.as_dict())


class _Told:
    """Tells of progress where it changed."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._last: tuple[int, int, str] | None = None

    def tell(self, due: int, done: int, failed: int, words: str) -> None:
        words = words or (f"{failed} failed" if failed else "")
        now = (done, due, words)
        if not due or now == self._last or not self._progress:
            return
        self._last = now
        if callable(self._progress):
            self._progress(done, due, words)
            return
        sys.stderr.write(f"\r{done} of {due} simulations{', ' if words else ''}{words}\x1b[K")
        sys.stderr.flush()

    def end(self) -> None:
        if self._progress is True and self._last is not None:
            sys.stderr.write("\n")
