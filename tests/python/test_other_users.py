"""Another user of this machine finds every shortcut of a site closed."""

import os
import socket
import time
from pathlib import Path

import pytest

from running_site import child, wait_for

NOBODY = 65_534
ANSWER_SECS = 30.0
LISTENING = "00010000"
WELCOME = b"\x01"


def shortcuts(process: int) -> list[str]:
    """Names of the abstract sockets on which a process listens."""
    links = [os.readlink(fd) for fd in Path(f"/proc/{process}/fd").iterdir()]
    inodes = {link[8:-1] for link in links if link.startswith("socket:[")}
    lines = [line.split() for line in Path("/proc/net/unix").read_text().splitlines()[1:]]
    own = [words for words in lines if words[3] == LISTENING and words[6] in inodes]
    return [words[7][1:] for words in own if words[7].startswith("@causeway-")]


def greeting(name: str) -> bytes:
    """What a shortcut says first; nothing when it hangs up."""
    with socket.socket(socket.AF_UNIX) as asker:
        asker.settimeout(ANSWER_SECS)
        asker.connect(f"\0{name}")
        return asker.recv(1)


def greeting_of_nobody(name: str) -> bytes:
    """The same for a user without rights, in a process that ends at once."""
    reader, writer = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            os.setuid(NOBODY)
            os.write(writer, b"heard " + greeting(name))
        finally:
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as told:
        heard = told.read()
    os.waitpid(process, 0)
    assert heard.startswith(b"heard "), heard
    return heard.removeprefix(b"heard ")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_the_shortcuts_of_a_site_hang_up_on_another_user(start_site):
    site = start_site("--no-render")
    names = shortcuts(child(site, "world"))
    assert names
    for name in names:
        assert greeting(name) == WELCOME
        assert greeting_of_nobody(name) == b""
    deadline = time.monotonic() + ANSWER_SECS
    wait_for(site, deadline, lambda: f"another user is refused uid={NOBODY}" in site.said())
