"""A real site for the tests: `causeway up` on free ports, as a user would start it."""

import contextlib
import os
import random
import re
import signal
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

PACKAGE = Path(__file__).parent.parent.parent / "agents" / "python"
CACHE = Path.home() / ".cache" / "causeway"

START_SECS = 60.0
# A site ends within three seconds; a busy machine gets ten times as long.
STOP_SECS = 30.0
# Below those that the system gives to whoever connects or asks for any port.
PORTS = range(10_000, 32_000)
_given: set[int] = set()


def binary() -> Path:
    """The program under test: CAUSEWAY_BIN, or the release build."""
    target = Path(os.environ.get("CAUSEWAY_TARGET_DIR", CACHE / "target"))
    path = Path(os.environ.get("CAUSEWAY_BIN", target / "release" / "causeway"))
    if not path.exists():
        pytest.fail(f"no causeway at {path}: build it, or set CAUSEWAY_BIN", pytrace=False)
    return path


@dataclass
class Site:
    """A running site. `log` holds what it and its services said."""

    base_url: str
    endpoint: str
    carla_port: int
    process: subprocess.Popen
    log: Path

    def said(self) -> str:
        return self.log.read_text(errors="replace")[-4000:]


def start(log: Path, *flags: str, within: tuple[str, ...] = (), **environment: str) -> Site:
    """Starts a site, by a command that runs another if `within` is one, and waits until it is
    healthy."""
    says_http = any(str(flag).split("=")[0] == "--http" for flag in flags)
    http = [] if says_http else ["--http", "127.0.0.1:0"]
    says_bus = any(str(flag).split("=")[0] == "--bus" for flag in flags)
    ports = [*http, *([] if says_bus else ["--bus", "tcp/127.0.0.1:0"])]
    says_port = any(str(flag).split("=")[0] in ("--carla", "-carla-rpc-port") for flag in flags)
    # A port of the system's choice may be somebody's by the time that a service binds it.
    carla = [] if says_port else ["--carla", str(two_free_ports())]
    keeps = any(str(flag).split("=")[0] == "--recordings" for flag in flags)
    recordings = [] if keeps else ["--recordings", log.parent / "recordings"]
    command = [*within, binary(), "up", *ports, *carla, *recordings, *flags]
    with log.open("wb") as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env={**os.environ, **environment},
        )
    site = Site("", "", 0, process, log)
    try:
        deadline = time.monotonic() + START_SECS
        site.base_url = wait_for(site, deadline, lambda: first(r"http://[\d.]+:\d+", site))
        site.endpoint = wait_for(site, deadline, lambda: first(r"t(?:cp|ls)/[\d.]+:\d+", site))
        carla_address = wait_for(site, deadline, lambda: first(r"CARLA +[\d.]+:\d+", site))
        site.carla_port = int(carla_address.rsplit(":", 1)[1])
        wait_for(site, deadline, lambda: healthy(site.base_url))
        # Cameras wait only a moment for a renderer that is still starting.
        while "--no-render" not in flags and not first(r"renderer .* up after", site):
            if time.monotonic() > deadline:
                break
            time.sleep(0.02)
    except BaseException:
        stop(site)
        raise
    return site


def stop(site: Site) -> None:
    site.process.send_signal(signal.SIGTERM)
    try:
        site.process.wait(STOP_SECS)
    except subprocess.TimeoutExpired:
        site.process.kill()
        site.process.wait(STOP_SECS)
        pytest.fail(f"the site did not end within {STOP_SECS} s:\n{site.said()}", pytrace=False)


def memory_kib(process_id: int) -> int:
    """Resident memory of a process."""
    status = Path(f"/proc/{process_id}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1])


def child(site: Site, service: str) -> int:
    """The process of a service of a site."""
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            status = (entry / "status").read_text()
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if f"PPid:\t{site.process.pid}\n" in status and service.encode() in words:
                return int(entry.name)
    raise AssertionError(f"no {service} runs: {site.said()}")


def wait_for(site: Site, deadline: float, condition):
    """The first true value of `condition`."""
    while True:
        value = condition()
        if value:
            return value
        if site.process.poll() is not None or time.monotonic() > deadline:
            pytest.fail(f"the site is not up:\n{site.said()}", pytrace=False)
        time.sleep(0.02)


def first(pattern: str, site: Site):
    found = re.search(pattern, site.log.read_text(errors="replace"))
    return found and found.group()


def healthy(base_url: str) -> bool:
    try:
        return httpx.get(f"{base_url}/health", timeout=2.0).json() == {"status": "healthy"}
    except httpx.HTTPError:
        return False


def two_free_ports() -> int:
    """A port that is free, as is the next one; nobody gets either without asking for it."""
    while True:
        # An even one, so that two pairs are the same or apart; clients of one that was given before
        # may still look for their server there.
        port = random.SystemRandom().choice(PORTS[::2])
        if port in _given:
            continue
        with socket.socket() as first, socket.socket() as second, contextlib.suppress(OSError):
            first.bind(("127.0.0.1", port))
            second.bind(("127.0.0.1", port + 1))
            _given.add(port)
            return port
