"""Runs steps, two at a time at most, and takes down what each cost and counted."""

import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

# How the test runners that are used here say how many tests passed.
COUNTS = [
    re.compile(r"^test result: ok\. (\d+) passed", re.MULTILINE),  # cargo test
    re.compile(r"^(?:=+ )?(\d+) passed", re.MULTILINE),  # pytest
    re.compile(r"^(?:ℹ|#) pass (\d+)", re.MULTILINE),  # node --test
    re.compile(r"^\S+: (\d+) cases, conforms", re.MULTILINE),  # clients/conformance/run
    re.compile(r"^checks: (\d+)$", re.MULTILINE),  # steps of our own
]
# A note that a step is still at work, for logs that nobody would otherwise see move.
STILL_S = 60.0
# A step that takes longer hangs; the slowest machine known takes a sixth of it for the slowest step.
LIMIT_S = 3000.0
# Of a failed step's output, the part that is printed; the log has the rest.
TAIL_LINES = 150


@dataclass(frozen=True)
class Step:
    """One part of the suite: a command that passes or fails as a whole."""

    name: str
    does: str
    command: str  # for bash, from the repository's root
    # What it needs: these have to pass.
    after: tuple[str, ...] = ()
    # Fewest tests that have to be counted in the output; fewer is a failure.
    tests_min: int = 0
    # These end before it, however they end, so that both do not wait for the same lock or core.
    behind: tuple[str, ...] = ()
    # What is installed, in words, with what it took where it was measured.
    installs: str = ""
    limit_s: float = LIMIT_S
    # Why the step cannot run here, or None.
    missing: Callable[[], str | None] = lambda: None


@dataclass
class Outcome:
    """What became of a step."""

    step: Step
    verdict: str  # passed, failed, skipped
    reason: str = ""
    wall_s: float = 0.0
    processor_s: float = 0.0
    tests: int = 0


@dataclass
class Run:
    """A run of steps, in the order given where `after` and `behind` leave a choice."""

    steps: list[Step]
    root: Path
    logs: Path
    environment: dict[str, str]
    lanes: int = 2
    # What is told each outcome as soon as it is known, one at a time.
    note: Callable[[Outcome], None] = lambda _: None
    outcomes: dict[str, Outcome] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.lock = threading.Condition()
        self.waiting = list(self.steps)
        self.begun = time.monotonic()

    def go(self) -> list[Outcome]:
        """Runs everything; a step that needs one which failed is failed unrun."""
        self.logs.mkdir(parents=True, exist_ok=True)
        lanes = [threading.Thread(target=self.lane) for _ in range(self.lanes)]
        for lane in lanes:
            lane.start()
        for lane in lanes:
            lane.join()
        return [self.outcomes[step.name] for step in self.steps]

    def lane(self) -> None:
        while (step := self.next_step()) is not None:
            try:
                outcome = self.run_step(step)
            except Exception as error:  # The other lane may wait for this step.
                self.say(f"FAIL  {step.name}: {error!r}")
                outcome = Outcome(step, "failed", repr(error))
            with self.lock:
                self.outcomes[step.name] = outcome
                self.note(outcome)
                self.lock.notify_all()

    def next_step(self) -> Step | None:
        """The first step that is ready; waits while only others' ends can make one ready."""
        names = {step.name for step in self.steps}
        with self.lock:
            while self.waiting:
                for step in self.waiting:
                    if all(a in self.outcomes for a in step.after + step.behind if a in names):
                        self.waiting.remove(step)
                        return step
                self.lock.wait()
        return None

    def run_step(self, step: Step) -> Outcome:
        reason = step.missing()
        if reason is not None:
            self.say(f"skip  {step.name}: {reason}")
            return Outcome(step, "skipped", reason)
        for name in step.after:
            before = self.outcomes.get(name)
            if before is not None and before.verdict == "failed":
                self.say(f"FAIL  {step.name}: not run, since {name} failed")
                return Outcome(step, "failed", f"not run, since {name} failed")
        self.say(f"start {step.name}: {step.does}")
        log = self.logs / f"{step.name}.log"
        wall_s, processor_s, code = self.execute(step, log)
        text = log.read_text(errors="replace")
        tests = sum(int(n) for pattern in COUNTS for n in pattern.findall(text))
        outcome = Outcome(step, "passed", "", wall_s, processor_s, tests)
        if code != 0:
            outcome.verdict, outcome.reason = "failed", f"exit code {code}"
        elif tests < step.tests_min:
            outcome.verdict = "failed"
            outcome.reason = f"{tests} tests ran, {step.tests_min} are due"
        self.report(outcome, log, text)
        return outcome

    def execute(self, step: Step, log: Path) -> tuple[float, float, int]:
        """Wall and processor seconds (of all its processes) and the exit code."""
        start = time.monotonic()
        with log.open("wb") as out:
            child = subprocess.Popen(
                ["bash", "-euo", "pipefail", "-c", step.command],
                cwd=self.root,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            done = threading.Event()

            def still() -> None:
                while not done.wait(STILL_S):
                    took_s = time.monotonic() - start
                    self.say(f"still {step.name}: {took_s:.0f} s")
                    if took_s > step.limit_s:
                        self.say(f"{step.name}: killed, it took more than {step.limit_s:.0f} s")
                        os.killpg(child.pid, signal.SIGKILL)

            threading.Thread(target=still, daemon=True).start()
            _, status, usage = os.wait4(child.pid, 0)
            done.set()
        child.returncode = os.waitstatus_to_exitcode(status)
        return time.monotonic() - start, usage.ru_utime + usage.ru_stime, child.returncode

    def report(self, outcome: Outcome, log: Path, text: str) -> None:
        word = {"passed": "ok   ", "failed": "FAIL "}[outcome.verdict]
        tests = f", {outcome.tests} tests" if outcome.tests else ""
        cost = f"{outcome.wall_s:.0f} s, {outcome.processor_s:.0f} s of processor"
        reason = f": {outcome.reason}" if outcome.reason else ""
        lines = [f"{word} {outcome.step.name}{tests} ({cost}){reason}"]
        if outcome.verdict == "failed":
            lines += ["", f"-- the end of {log}:", *text.splitlines()[-TAIL_LINES:], "--", ""]
        self.say("\n".join(lines))

    def say(self, text: str) -> None:
        with self.lock:
            print(f"[{time.monotonic() - self.begun:5.0f} s] {text}", flush=True)

