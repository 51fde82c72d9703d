"""Services as processes of their own, with what watches over them."""

import contextlib
import os
import re
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from prometheus_client.openmetrics.parser import text_string_to_metric_families

from running_site import binary

#: Whatever is waited for comes by then also on a busy machine.
SOON_SECS = 60.0


def eventually(wanted: str, look):
    """The first value of `look` that is true."""
    deadline = time.monotonic() + SOON_SECS
    while True:
        value = look()
        if value:
            return value
        if time.monotonic() > deadline:
            pytest.fail(f"no {wanted} within {SOON_SECS} s", pytrace=False)
        time.sleep(0.02)


def ask(admin: str, path: str, method: str = "GET") -> httpx.Response:
    return httpx.request(method, f"http://{admin}{path}", timeout=30.0, trust_env=False)


def told(admin: str, path: str) -> int:
    """The status, or 0 where nobody answers."""
    try:
        return ask(admin, path).status_code
    except httpx.HTTPError:
        return 0


def figures(admin: str) -> dict[str, float]:
    """All figures by name and labels, e.g. `causeway_world_requests_total{outcome=done}`."""
    reply = ask(admin, "/metrics")
    assert reply.headers["content-type"].startswith("application/openmetrics-text")
    found = {}
    for family in text_string_to_metric_families(reply.text):
        for sample in family.samples:
            labels = ",".join(f"{name}={value}" for name, value in sorted(sample.labels.items()))
            name = f"{sample.name}{{{labels}}}" if labels else sample.name
            assert name not in found, f"{name} is there twice"
            found[name] = sample.value
    return found


@dataclass
class Service:
    """A process of `causeway`; `admin` is where it is asked how it is."""

    process: subprocess.Popen
    log: Path
    admin: str = ""

    def said(self) -> str:
        return self.log.read_text(errors="replace")

    def find(self, pattern: str) -> str:
        def look():
            found = re.search(pattern, self.said())
            if found is None and self.process.poll() is not None:
                pytest.fail(f"it has ended:\n{self.said()}", pytrace=False)
            return found and found[1]

        return eventually(f"{pattern} in the log", look)

    def until(self, path: str, status: int) -> httpx.Response:
        eventually(f"{status} of {path}", lambda: told(self.admin, path) == status)
        return ask(self.admin, path)

    def terminate(self) -> None:
        self.process.send_signal(signal.SIGTERM)

    def ended(self) -> int:
        """Its exit code, once it has ended by itself."""
        try:
            return self.process.wait(SOON_SECS)
        except subprocess.TimeoutExpired:
            pytest.fail(f"it does not end:\n{self.said()}", pytrace=False)


@contextlib.contextmanager
def services(folder: Path):
    """Starts services, e.g. `start("router", "--listen", "tcp/127.0.0.1:0")`, and ends them all.

    `by` runs them, e.g. as another user; `program` is what it runs; `at` is where it is asked."""
    running: list[Service] = []

    def start(*command: str, by: tuple = (), program=None, at: str = "127.0.0.1") -> Service:
        log = folder / f"{command[0]}-{len(running)}.log"
        with log.open("wb") as output:
            process = subprocess.Popen(
                [*by, program or binary(), *command, "--admin", f"{at}:0"],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "RUST_LOG": "info"},
            )
        service = Service(process, log)
        running.append(service)
        service.admin = service.find(r"probes and figures address=(\S+)")
        return service

    try:
        yield start
    finally:
        for service in running:
            service.process.kill()
            service.process.wait()


@contextlib.contextmanager
def bus(folder: Path):
    """A router and its address, and how further services on its bus are started."""
    with services(folder) as start:
        router = start("router", "--listen", "tcp/127.0.0.1:0")
        address = router.find(r"routing on (tcp/\S+)")
        yield lambda *command: start(*command, "--connect", address)
