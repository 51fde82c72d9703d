"""The program that steps worlds, and the memory that it shares with this one.

:class:`causeway.rollout.Batch` is what to use; this is what it is made of.
"""

from __future__ import annotations

import contextlib
import json
import mmap
import os
import socket
import struct
import subprocess
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from causeway.messages import encode
from causeway.program import find, folder
from causeway.waiting import Waiting

Array = NDArray[Any]

#: How long an engine that is told to end may take.
END_SECS = 5.0
#: Bytes of its last words that an error repeats.
LAST_WORDS = 2000


class EngineError(RuntimeError):
    """The engine has gone, or does not answer, or the batch is closed."""


class Engine:
    """One batch of worlds in a process beside this one, over a socket and a block of memory."""

    def __init__(
        self,
        request: dict[str, Any],
        *,
        address: str | None,
        program: str,
        folders: Mapping[str, str | Path | None],
    ) -> None:
        """Opens a batch.

        Args:
            request: what to open, as the engine reads it.
            address: socket of a running `causeway rollout --listen`; else one is started.
            program: the command `causeway`, found as :func:`causeway.program.find` does.
            folders: by flag, e.g. `maps`, of an engine that is started.

        Raises:
            FileNotFoundError: there is no such program or socket.
            ValueError: the request was refused, or folders were given for an engine that runs; the
                text says what was wanted and what was found.
            EngineError: the engine ended meanwhile.
        """
        self._process: subprocess.Popen[bytes] | None = None
        self._log: IO[bytes] | None = None
        self._descriptors: list[int] = []
        self._closed = False
        given = {flag: place for flag, place in folders.items() if place is not None}
        if address and given:
            raise ValueError(
                f"{' and '.join(given)}: wanted no folders with address=, found "
                f"{', '.join(map(str, given.values()))}: give them to the engine that runs, "
                f"`causeway rollout --listen {address} --{next(iter(given))} DIR`"
            )
        self._socket = self._connect(address) if address else self._start(program, given)
        try:
            self.opened = self._open(request)
        except BaseException:
            self.close()
            raise
        block, self._go, self._ready = self._descriptors
        size = self.opened["layout"]["bytes"]
        self._memory = mmap.mmap(block, size, mmap.MAP_SHARED, mmap.PROT_READ | mmap.PROT_WRITE)
        self._waiting = Waiting([self._ready, self._socket.fileno()])

    def _connect(self, address: str) -> socket.socket:
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            sock.connect(address)
        except OSError as error:
            sock.close()
            raise type(error)(
                f"no engine at {address} ({error.strerror or error}): start one with "
                f"`causeway rollout --listen {address}`"
            ) from None
        return sock

    def _start(self, program: str, folders: Mapping[str, str | Path]) -> socket.socket:
        path = find(program)
        flags = [
            part for flag, place in folders.items() for part in (f"--{flag}", folder(flag, place))
        ]
        own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self._log = tempfile.TemporaryFile()
        with theirs:
            # A session of its own: Ctrl-C here is not for the engine, which ends with the socket.
            self._process = subprocess.Popen(
                [path, "rollout", "--stdin", *flags],
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=self._log,
                start_new_session=True,
            )
        return own

    def _open(self, request: dict[str, Any]) -> dict[str, Any]:
        self._send({"open": request})
        try:
            length, descriptors, _, _ = socket.recv_fds(self._socket, 4, 3)
        except ConnectionError:
            raise self._gone() from None
        self._descriptors = list(descriptors)
        length += self._read(4 - len(length))
        reply = self._reply(length)
        return dict(reply["opened"])

    def processor_secs(self) -> float:
        """Processor time of a process that was started here.

        Raises:
            EngineError: there is none.
        """
        self._want_open()
        if self._process is None:
            raise EngineError("the engine was not started by this program")
        try:
            told = Path(f"/proc/{self._process.pid}/stat").read_text()
        except FileNotFoundError:
            raise self._gone() from None
        # Behind the name, which is in parentheses: user and system time are the 12th and 13th.
        fields = told.rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def array(self, name: str, slot: int) -> Array:
        """One array of a slot, without a copy."""
        layout = self.opened["layout"]
        found = next(array for array in layout["arrays"] if array["name"] == name)
        start = layout["first_slot"] + slot * layout["slot_bytes"] + found["offset"]
        kind = np.bool_ if found["dtype"] == "uint8" else np.dtype(found["dtype"])
        count = int(np.prod(found["shape"]))
        array = np.frombuffer(self._memory, dtype=kind, count=count, offset=start)
        return array.reshape(found["shape"])

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Sends a message and returns its reply.

        Raises:
            ValueError: it was refused.
            EngineError: the engine has gone, or the batch is closed.
        """
        self._want_open()
        self._send(request)
        return self._reply(self._read(4))

    def read(self, count: int) -> bytes:
        """Bytes that follow a reply.

        Raises:
            EngineError: the engine has gone.
        """
        return self._read(count)

    def _send(self, request: dict[str, Any]) -> None:
        text = encode(request).encode()
        try:
            self._socket.sendall(struct.pack("<I", len(text)) + text)
        except OSError:
            raise self._gone() from None

    def _read(self, count: int) -> bytes:
        parts = bytearray()
        while len(parts) < count:
            try:
                part = self._socket.recv(count - len(parts))
            except ConnectionError:
                part = b""
            if not part:
                raise self._gone()
            parts += part
        return bytes(parts)

    def _reply(self, length: bytes) -> dict[str, Any]:
        (size,) = struct.unpack("<I", length)
        reply: dict[str, Any] = json.loads(self._read(size))
        refused = reply.get("refused")
        if refused is not None:
            raise ValueError(_sentence(refused))
        return reply

    def ring(self) -> None:
        """Tells the engine that actions are there.

        Raises:
            EngineError: the batch is closed.
        """
        self._want_open()
        os.eventfd_write(self._go, 1)

    def wait(self, timeout_secs: float) -> None:
        """Waits until a step is done.

        Raises:
            ValueError: the step was refused, and nothing has changed.
            EngineError: the engine has gone, or the batch is closed.
            TimeoutError: it takes longer.
        """
        self._want_open()
        deadline = time.monotonic() + timeout_secs
        while True:
            left = deadline - time.monotonic()
            events = self._waiting.wait(left)
            if any(descriptor == self._ready for descriptor, _ in events):
                break
            if events:
                raise self._gone()
            if left <= 0.0:
                raise TimeoutError(f"the engine took longer than {timeout_secs} s for a step")
        os.eventfd_read(self._ready)
        status_at, length_at, text_at, _ = self.opened["header"]
        if self._number(status_at):
            text = self._memory[text_at : text_at + self._number(length_at)]
            raise ValueError(text.decode(errors="replace"))

    def _number(self, at: int) -> int:
        return int(struct.unpack_from("<I", self._memory, at)[0])

    def _gone(self) -> EngineError:
        """Why there is no answer, with the last words of an engine that was started here."""
        if self._process is None:
            return EngineError("the engine closed the connection; its log says why")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(END_SECS)
        code = self._process.returncode
        how = "does not answer" if code is None else f"ended with exit code {code}"
        if code is not None and code < 0:
            how = f"was killed by signal {-code}"
        words = ""
        if self._log is not None:
            size = self._log.seek(0, os.SEEK_END)
            self._log.seek(max(size - LAST_WORDS, 0))
            words = self._log.read().decode(errors="replace").strip()
        said = f"; it said:\n{words}" if words else ""
        return EngineError(f"the engine (process {self._process.pid}) {how}{said}")

    def _want_open(self) -> None:
        if self._closed:
            raise EngineError("the batch is closed")

    def close(self) -> None:
        """Ends the batch; its worlds are freed. Arrays stay readable while they are held."""
        self._closed = True
        self._socket.close()
        for descriptor in self._descriptors:
            os.close(descriptor)
        self._descriptors = []
        if self._process is not None:
            try:
                self._process.wait(END_SECS)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._log is not None:
            self._log.close()
            self._log = None


def _sentence(refused: dict[str, str]) -> str:
    text = refused["message"]
    if refused["wanted"]:
        text += f"; wanted {refused['wanted']}"
    if refused["found"]:
        text += f", found {refused['found']}"
    return text
