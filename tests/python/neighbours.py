"""Sessions that step without a pause while others do what they like, and how long their steps take.

What a neighbour costs is a ratio of two rounds of one run, one quiet and one beside it, in turn:
whatever else the machine does is in both.
"""

import statistics
import threading
import time
from dataclasses import dataclass

import causeway

#: So much longer than a look may somebody wait for a step.
STANDSTILL_SECS = 10.0


@dataclass(frozen=True)
class Round:
    """Steps that ended within one span of time, in seconds."""

    steps_secs: list[float]

    def quantile(self, share: float) -> float:
        ordered = sorted(self.steps_secs)
        return ordered[min(int(share * len(ordered)), len(ordered) - 1)]

    def __str__(self) -> str:
        median, p99 = 1e3 * self.quantile(0.5), 1e3 * self.quantile(0.99)
        count, most = len(self.steps_secs), 1e3 * max(self.steps_secs)
        return f"{count} steps, median {median:.2f}, p99 {p99:.2f}, longest {most:.1f} ms"


class Neighbour(threading.Thread):
    """Steps one session until told to end; keeps when each step ended and how long it took."""

    def __init__(self, base_url: str, over: threading.Event) -> None:
        super().__init__(daemon=True)
        self.base_url, self.over = base_url, over
        self.steps: list[tuple[float, float]] = []
        self.error: Exception | None = None

    def run(self) -> None:
        try:
            with causeway.Session(self.base_url, connect_timeout_secs=60.0) as session:
                while not self.over.is_set():
                    session.reset("trolley_saves", seed=1)
                    for _ in range(1_000):
                        begun = time.monotonic()
                        session.step()
                        now = time.monotonic()
                        self.steps.append((now, now - begun))
                        if self.over.is_set():
                            return
        except Exception as error:  # The thread's end is judged by whoever looks.
            self.error = error


class Neighbours:
    """So many sessions, beside which others are noisy."""

    def __init__(self, base_url: str, count: int) -> None:
        self._over = threading.Event()
        self._all = [Neighbour(base_url, self._over) for _ in range(count)]

    def __enter__(self) -> "Neighbours":
        for one in self._all:
            one.start()
        deadline = time.monotonic() + 120.0
        while not all(one.steps for one in self._all):
            assert time.monotonic() < deadline, self.errors()
            time.sleep(0.01)
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        for one in self._all:
            one.join(timeout=30.0)
        assert not any(one.is_alive() for one in self._all), "a step never ended"

    def look(self, secs: float) -> Round:
        """What they do from now on, for so long; none of them may fail or stand still."""
        begun = time.monotonic()
        time.sleep(secs)
        done = self._done(begun, secs)
        # A machine that is busy with something else may leave somebody no turn in so short a time.
        while not all(done) and time.monotonic() < begun + secs + STANDSTILL_SECS:
            time.sleep(0.1)
            done = self._done(begun, secs)
        assert not self.errors()
        counts = [len(one) for one in done]
        assert all(done), f"somebody did no step in {secs + STANDSTILL_SECS} s: {counts}"
        for one in self._all:
            del one.steps[: len(one.steps) // 2]
        return Round([secs for one in done for secs in one])

    def _done(self, begun: float, secs: float) -> list[list[float]]:
        """How long the steps took that each ended in a span of time, or else the first after it."""
        found = []
        for one in self._all:
            since = [step for step in list(one.steps) if step[0] >= begun]
            within = [step for step in since if step[0] < begun + secs] or since[:1]
            found.append([took_secs for _, took_secs in within])
        return found

    def errors(self) -> list[Exception]:
        return [one.error for one in self._all if one.error is not None]


def median_ratio(beside: list[Round], quiet: list[Round], share: float) -> float:
    """How much longer steps take beside a neighbour: the median over pairs of rounds."""
    pairs = zip(beside, quiet, strict=True)
    return statistics.median(b.quantile(share) / q.quantile(share) for b, q in pairs)
