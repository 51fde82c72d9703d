"""Everything at once on one site, for as long as wanted: nothing grows, and nobody waits longer.

Usage, with CAUSEWAY_BIN naming the program and `agents/python/src` on PYTHONPATH:

    python tests/python/endurance.py [--minutes 60] [--span-secs 60] [--hostile]

Sessions, subscribers, CARLA clients that load, spawn, measure and go, and bytes that mean nothing
come and go without end, beside one honest session that steps. After each span a line tells the
honest steps and the memory, open handles and threads of every process. With `--hostile` every other
span is quiet, and in the others sessions and CARLA clients that take all they can get are there as
well, a world that cannot keep its pace, subscribers of every kind that stand still, connections
that say half of something, numbers that are none, pages of other sites, services that are announced
and not there, and every few seconds a service is killed or stopped for a moment. Exits with 1 when
something failed or grew.
"""

import argparse
import contextlib
import itertools
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from neighbours import Neighbours, Round, median_ratio
from running_site import Site, child, memory_kib, start, stop, two_free_ports
from test_stopped_subscribers import KINDS as SUBSCRIBERS
from test_stopped_subscribers import stopped_subscriber

HERE = Path(__file__).parent
#: The processes of a site; the first has the others.
PROCESSES = ("up", "world", "scenario", "gateway", "render")
CHURN = ("sessions", "sessions", "subscribers", "pages", "visits", "floods")
#: Those of them who mean well.
VISITORS = ("sessions", "subscribers", "pages", "visits")
HOSTILE_CHURN = ("halves", "nonsense", "phantoms")
NOISY = ("crowd", "pictures")
#: In turn, as both have the same world.
NOISY_CARLA = ("carla_crowd", "film")
#: Killed in turn; the honest client is connected to the one that is only ever stopped.
KILLED = ("gateway", "render", "world")
STOPPED = (*KILLED, "scenario")
FAULT_PAUSE_SECS = 5.0
STOPPED_SECS = 0.5

#: A process may grow by so much between the middle and the end of a run...
GROWTH_SHARE = 0.10
GROWTH_KIB = 48 * 1024
#: ...and have so many handles and threads more.
GROWTH_COUNT = 24
#: An honest step at the end, beside one in the middle.
DRIFT_MAX = 2.0
HOSTILE_RATIO_MAX = 3.0


@dataclass(frozen=True)
class Size:
    """What a process takes."""

    kib: int
    handles: int
    threads: int

    @classmethod
    def of(cls, process: int) -> "Size":
        def count(what: str) -> int:
            return len(list(Path(f"/proc/{process}/{what}").iterdir()))

        return cls(memory_kib(process), count("fd"), count("task"))

    def __str__(self) -> str:
        return f"{self.kib / 1024:.0f} MiB, {self.handles} handles, {self.threads} threads"


@dataclass
class Seen:
    """What a run has shown, span by span."""

    steps: list[Round] = field(default_factory=list)
    hostile_steps: list[Round] = field(default_factory=list)
    sizes: dict[str, list[Size]] = field(default_factory=lambda: {name: [] for name in PROCESSES})
    done: Counter = field(default_factory=Counter)
    errors: list[str] = field(default_factory=list)

    def errors_of_visitors(self) -> str:
        """Of each kind that means well, how many failed of how many."""
        told = []
        for kind in VISITORS:
            failed = sum(error.startswith(f"error: {kind}:") for error in self.errors)
            told.append(f"{kind} {failed} of {failed + self.done[kind]}")
        return ", ".join(told)

    def faults(self, drift_max: float) -> list[str]:
        """What does not hold; needs at least six spans. Those who come and go beside the hostile
        may be too late for their own deadlines."""
        found = [] if self.hostile_steps else list(self.errors)
        for name, sizes in self.sizes.items():
            third = len(sizes) // 3
            before, after = sizes[third : 2 * third], sizes[-third:]

            def middle(part: list[Size], what: str) -> float:
                return statistics.median(getattr(size, what) for size in part)

            if middle(after, "kib") > middle(before, "kib") * (1 + GROWTH_SHARE) + GROWTH_KIB:
                found.append(f"{name} grows: {[size.kib for size in sizes]} KiB")
            for what in ("handles", "threads"):
                if middle(after, what) > middle(before, what) + GROWTH_COUNT:
                    counts = [getattr(size, what) for size in sizes]
                    found.append(f"{name} has more and more {what}: {counts}")
        if self.drift() > drift_max:
            found.append(f"honest steps take {self.drift():.1f} times as long as before")
        return found

    def drift(self) -> float:
        """Median steps of the last third beside those of the middle one."""
        third = len(self.steps) // 3
        middle = [one.quantile(0.5) for one in self.steps[third : 2 * third]]
        return statistics.median(one.quantile(0.5) for one in self.steps[-third:]) / (
            statistics.median(middle)
        )


@contextlib.contextmanager
def running(program: str, *arguments: object, noted=lambda line: None):
    """A process that does something again and again; killed at the end. It gives way to the site
    and to the honest client, as if it were on another machine."""
    command = ["nice", "-n", "15", sys.executable, HERE / program, *map(str, arguments)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def read() -> None:
        for line in process.stdout:
            noted(line.strip())

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        yield
    finally:
        process.kill()
        process.wait()
        reader.join()


def churn(site: Site, seen: Seen, seed: int, kinds: tuple[str, ...] = CHURN):
    """All who come and go."""

    def note(line: str) -> None:
        if line.startswith("error"):
            seen.errors.append(line)
        else:
            seen.done[line] += 1

    stack = contextlib.ExitStack()
    for index, kind in enumerate(kinds):
        where = (site.base_url, site.endpoint, site.carla_port)
        number = seed * len(kinds) + index
        stack.enter_context(running("churn.py", *where, kind, number, noted=note))
    return stack


def hostile(site: Site, seen: Seen, more_ports: list[int], seed: int):
    """All who take what they can get or harm what they can, beside those who come and go; with
    ports of two CARLA endpoints of their own."""
    stack = churn(site, seen, seed, CHURN + HOSTILE_CHURN)
    noisy_port, slow_port = more_ports
    for kind in (*NOISY, NOISY_CARLA[seed % len(NOISY_CARLA)]):
        stack.enter_context(running("noisy_neighbour.py", site.base_url, noisy_port, kind))
    stack.enter_context(running("noisy_neighbour.py", site.base_url, slow_port, "overload"))
    for kind in SUBSCRIBERS:
        # Its links end as its server's process does, too.
        stack.enter_context(stopped_subscriber(site.endpoint, *kind))
    stack.enter_context(faulty(site, seen, seed))
    return stack


@contextlib.contextmanager
def faulty(site: Site, seen: Seen, seed: int):
    """Kills a service, or stops it for a moment, again and again."""
    over, dice = threading.Event(), random.Random(seed)

    def harm() -> None:
        while not over.wait(FAULT_PAUSE_SECS):
            is_death = dice.random() < 0.5
            name = dice.choice(KILLED if is_death else STOPPED)
            # It may be between two lives.
            with contextlib.suppress(AssertionError, ProcessLookupError):
                victim = child(site, name)
                os.kill(victim, signal.SIGKILL if is_death else signal.SIGSTOP)
                seen.done[f"{name} {'killed' if is_death else 'stopped'}"] += 1
                if not is_death:
                    time.sleep(STOPPED_SECS)
                    os.kill(victim, signal.SIGCONT)

    harming = threading.Thread(target=harm, daemon=True)
    harming.start()
    try:
        yield
    finally:
        over.set()
        harming.join()


def sizes_of(site: Site) -> dict[str, Size]:
    """What each process takes; one that was killed comes back."""
    deadline = time.monotonic() + 60.0
    while True:
        try:
            return {
                name: Size.of(site.process.pid if name == "up" else child(site, name))
                for name in PROCESSES
            }
        except (AssertionError, OSError):
            assert time.monotonic() < deadline, "a service does not come back"
            time.sleep(0.1)


def endure(
    site: Site, more_ports: list[int], secs: float, span_secs: float, is_hostile: bool
) -> Seen:
    """A run of at least six spans."""
    seen = Seen()
    until = time.monotonic() + secs
    with Neighbours(site.base_url, 1) as honest, contextlib.ExitStack() as always:
        if not is_hostile:
            always.enter_context(churn(site, seen, 0))
        for number in itertools.count():
            if time.monotonic() + span_secs > until and number >= 6:
                return seen
            if is_hostile:
                with hostile(site, seen, more_ports, number):
                    seen.hostile_steps.append(honest.look(span_secs))
            seen.steps.append(honest.look(span_secs))
            sizes = sizes_of(site)
            for name, size in sizes.items():
                seen.sizes[name].append(size)
            if is_hostile:
                print(f"span {number}, hostile: {seen.hostile_steps[-1]}")
            print(f"span {number}: {seen.steps[-1]}")
            print("  " + "; ".join(f"{name} {size}" for name, size in sizes.items()), flush=True)


def ports_of_endpoints(count: int) -> list[int]:
    """Ports for CARLA endpoints, which take more than one each."""
    ports: list[int] = []
    while len(ports) < count:
        port = two_free_ports()
        if all(abs(port - other) > 2 for other in ports):
            ports.append(port)
    return ports


def run(
    secs: float, span_secs: float, is_hostile: bool = False, drift_max: float = DRIFT_MAX
) -> list[str]:
    """Starts a site, runs, prints, and gives what does not hold."""
    ports = ports_of_endpoints(3)
    with tempfile.TemporaryDirectory() as folder:
        site = start(Path(folder) / "log", "--carla", ",".join(map(str, ports)))
        try:
            seen = endure(site, ports[1:], secs, span_secs, is_hostile)
        finally:
            stop(site)
    print(f"done: {dict(seen.done)}; steps at the end / in the middle: {seen.drift():.2f}")
    faults = seen.faults(drift_max)
    if is_hostile:
        print(f"errors of those who mean well: {seen.errors_of_visitors()}")
        print(f"errors of all who come and go: {Counter(seen.errors)}")
        ratio = median_ratio(seen.hostile_steps, seen.steps, 0.99)
        print(f"p99 of hostile spans / quiet ones: {ratio:.2f}")
        if ratio > HOSTILE_RATIO_MAX:
            faults.append(f"honest p99 is {ratio:.1f} times as long beside the hostile")
    return faults


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--span-secs", type=float, default=60.0)
    parser.add_argument("--hostile", action="store_true")
    wanted = parser.parse_args()
    found = run(60.0 * wanted.minutes, wanted.span_secs, wanted.hostile)
    for fault in found:
        print(f"fault: {fault}")
    sys.exit(1 if found else 0)
