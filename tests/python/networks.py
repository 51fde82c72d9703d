"""Networks of a test's own, joined to the one it runs in by a cable that can be cut."""

import contextlib
import itertools
import os
import subprocess
import time
from pathlib import Path

import pytest

NOBODY = 65_534
AS_NOBODY = ("setpriv", f"--reuid={NOBODY}", "--clear-groups")
_numbers = itertools.count(1)


def need_root() -> None:
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    if subprocess.run(["unshare", "--net", "true"], capture_output=True).returncode != 0:
        pytest.skip("no network namespaces can be made")


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


class Network:
    """A host elsewhere: what is started `within` it is reached at `address`."""

    def __init__(self, keeper: subprocess.Popen, number: int) -> None:
        self.within = ("nsenter", "--net", "--target", str(keeper.pid))
        self.cable = f"cable{number}"
        # Of the block that is for measurements between networks.
        self.here, self.address = f"198.18.{number}.1", f"198.18.{number}.2"

    def join(self) -> None:
        far = f"far{self.cable}"
        pid = self.within[-1]
        ip("link", "add", self.cable, "type", "veth", "peer", "name", far, "netns", pid)
        ip("addr", "add", f"{self.here}/24", "dev", self.cable)
        ip("link", "set", self.cable, "up")
        for words in (
            ("addr", "add", f"{self.address}/24", "dev", far),
            ("link", "set", far, "up"),
            ("link", "set", "lo", "up"),
        ):
            subprocess.run([*self.within, "ip", *words], check=True, capture_output=True)

    def cut(self) -> None:
        """From now on both sides hear silence, not that somebody has gone."""
        ip("link", "set", self.cable, "down")

    def heal(self) -> None:
        ip("link", "set", self.cable, "up")


@contextlib.contextmanager
def network():
    keeper = subprocess.Popen(["unshare", "--net", "sleep", "infinity"])
    ours, its = Path("/proc/self/ns/net"), Path(f"/proc/{keeper.pid}/ns/net")
    try:
        while os.readlink(ours) == os.readlink(its):
            assert keeper.poll() is None
            time.sleep(0.01)
        found = Network(keeper, next(_numbers) + os.getpid() % 100)
        found.join()
        yield found
    finally:
        keeper.kill()
        keeper.wait()
