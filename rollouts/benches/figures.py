"""What batches and many sessions take, from Python: the figures of docs/benchmarks.md.

    python rollouts/benches/figures.py                # batches
    python rollouts/benches/figures.py --sessions 10000

Batches have one thread. With --sessions a site of its own is started, with further world services
where one is not enough, and sessions are forked from a few until there are so many.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import numpy as np

from causeway.program import find
from causeway.rollout import Batch

STEPS = 2_000
#: Worlds of one world service, and sessions that one request forks.
WORLDS, FORKS = 4_096, 1_024
#: As in groups of branches for learning.
GROUP = 64


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--sessions", type=int, default=0, help="so many, instead of batches"
    )
    parser.add_argument("--program", default="causeway", help="default: %(default)s")
    options = parser.parse_args()
    print("| what | figure |\n|---|---|")
    rows = (
        many_sessions(options.program, options.sessions)
        if options.sessions
        else batches(options.program)
    )
    for what, figure in rows:
        print(f"| {what} | {figure} |", flush=True)
    return 0


def batches(program: str) -> Iterator[tuple[str, str]]:
    bare = eventfds()
    yield "round trip of two processes with an eventfd each way", f"{bare:.1f} µs"
    with Batch(worlds=1, tier="kinematic", decision_ticks=1, program=program) as batch:
        took = median_micros(lambda: batch.step(np.zeros((1, 2), np.float32)))
        yield (
            "step of a batch of one kinematic world",
            f"{took:.1f} µs, {took - bare:.1f} more",
        )
    for tier, walkers, worlds in (
        ("physics", 3, 64),
        ("physics", 3, 256),
        ("kinematic", 0, 256),
    ):
        settings = {
            "tier": tier,
            "walkers": walkers,
            "worlds": worlds,
            "decision_ticks": 1,
        }
        yield (
            f"{worlds} worlds, {tier}, a car and {walkers} people",
            rate(settings, program),
        )
    for tier in ("kinematic", "physics"):
        for town in ("Town01", "Town03"):
            begun = time.perf_counter()
            with Batch(worlds=256, tier=tier, town=town, program=program):
                secs = time.perf_counter() - begun
            yield f"opening 256 worlds, {tier}, {town}", f"{secs:.2f} s"
    for tier in ("kinematic", "physics"):
        with Batch(worlds=256, tier=tier, threads=1, program=program) as batch:
            seeds = list(range(256))
            # Starts are made when they are first asked for.
            batch.reset(seeds)
            took = median_micros(lambda: batch.reset(seeds), 50) / 256
            yield f"reset of one of 256 worlds, {tier}", f"{took:.1f} µs"


def rate(settings: dict, program: str) -> str:
    """World-steps of a second, by the wall and by the processor time of the engine."""
    with Batch(**settings, threads=1, program=program) as batch:
        actions = np.tile(np.array([[0.0, 0.5]], np.float32), (batch.rows, 1))
        steps = max(STEPS // batch.worlds * 16, 50)
        for _ in range(steps):
            batch.step(actions)
        begun, used = time.perf_counter(), batch.engine_secs()
        for _ in range(steps):
            batch.step(actions)
        count = steps * batch.worlds
        wall, used = time.perf_counter() - begun, batch.engine_secs() - used
    return f"{count / wall:,.0f} steps/s, {count / used:,.0f} of one processor"


def median_micros(what: Callable[[], object], count: int = STEPS) -> float:
    taken = []
    for _ in range(count):
        begun = time.perf_counter_ns()
        what()
        taken.append(time.perf_counter_ns() - begun)
    return statistics.median(taken) / 1000.0


def eventfds() -> float:
    """A round trip between two processes that do nothing else."""
    go, ready = os.eventfd(0), os.eventfd(0)

    def answer() -> None:
        while os.eventfd_read(go) < 1_000_000:
            os.eventfd_write(ready, 1)

    other = multiprocessing.get_context("fork").Process(target=answer)
    other.start()
    took = median_micros(lambda: (os.eventfd_write(go, 1), os.eventfd_read(ready)))
    os.eventfd_write(go, 1_000_000)
    other.join()
    return took


def many_sessions(program: str, wanted: int) -> Iterator[tuple[str, str]]:
    with contextlib.ExitStack() as stack:
        up, base_url, endpoint = site(program, wanted, stack)
        processes = [up, *children(up)]
        for name in range(1, -(-wanted // WORLDS)):
            command = [
                find(program),
                "world",
                "--connect",
                endpoint,
                "--id",
                f"more-{name}",
            ]
            processes.append(started(command, stack).pid)
        time.sleep(2.0)
        empty = sum(map(memory_mb, processes))
        yield f"site of {len(processes)} processes without sessions", f"{empty:.0f} MB"
        http = stack.enter_context(httpx.Client(base_url=base_url, timeout=120.0))
        count, groups, forks = 0, [], []
        while count < wanted:
            reset = {"session_id": "", "scenario_name": "trolley_saves", "seed": count}
            origin = http.post("/reset", json=reset).raise_for_status().json()
            name = origin.get("session_id") or origin["metadata"]["session_id"]
            groups.append(fork(http, name, GROUP))
            rest = max(min(FORKS, wanted - count - 1 - GROUP), 1)
            forks.append((fork(http, name, rest), rest))
            count += 1 + GROUP + rest
        yield f"{GROUP} sessions forked from one", f"{statistics.median(groups):.3f} s"
        secs, of = forks[0]
        yield f"{of} sessions forked from one", f"{secs:.2f} s"
        full = sum(map(memory_mb, processes))
        each = (full - empty) * 1000.0 / count
        yield (
            f"the same with {count:,} idle sessions",
            f"{full:.0f} MB, {each:.0f} kB each",
        )


def fork(http: httpx.Client, session: str, count: int) -> float:
    begun = time.perf_counter()
    http.post("/fork", json={"session_id": session, "count": count}).raise_for_status()
    return time.perf_counter() - begun


def site(
    program: str, sessions: int, stack: contextlib.ExitStack
) -> tuple[int, str, str]:
    """A site on free ports: its process, its address, and that of its bus."""
    told = stack.enter_context(open("/dev/null"))
    read, write = os.pipe()
    ports = ["--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0", "--carla", "0"]
    command = [
        find(program),
        "up",
        "--no-render",
        "--recordings",
        "/tmp/figures",
        *ports,
    ]
    process = subprocess.Popen(
        command,
        stdin=told,
        stdout=write,
        stderr=write,
        env={**os.environ, "MAX_CONCURRENT_ENVS": str(sessions + FORKS)},
    )
    stack.callback(process.wait)
    stack.callback(process.terminate)
    os.close(write)
    said, found = "", {}
    while len(found) < 2:
        said += os.read(read, 65536).decode(errors="replace")
        for name, pattern in (
            ("http", r"http://[\d.]+:\d+"),
            ("bus", r"tcp/[\d.]+:\d+"),
        ):
            if one := re.search(pattern, said):
                found[name] = one.group()
    for _ in range(600):
        with contextlib.suppress(httpx.HTTPError):
            if httpx.get(f"{found['http']}/health", timeout=2.0).is_success:
                return process.pid, found["http"], found["bus"]
        time.sleep(0.1)
    raise RuntimeError(f"the site is not up:\n{said}")


def started(command: list[str], stack: contextlib.ExitStack) -> subprocess.Popen:
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    stack.callback(process.wait)
    stack.callback(process.terminate)
    return process


def children(process: int) -> list[int]:
    tasks = Path(f"/proc/{process}/task").glob("*/children")
    return [int(word) for task in tasks for word in task.read_text().split()]


def memory_mb(process: int) -> float:
    """Resident memory of a process."""
    told = Path(f"/proc/{process}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+) kB", told)[1]) * 1024 / 1e6


if __name__ == "__main__":
    sys.exit(main())
