"""Frames of running worlds, as they are published.

Frames are dropped rather than awaited, first by the publisher, then by the small ring of each
subscription: a slow reader sees the newest frames and can count what it missed.
"""

from __future__ import annotations

import json
import logging
import math
import re
import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import zenoh

from causeway.frames import Frame, decode

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7460"
#: The tenant of a `causeway up` that was not told another.
DEFAULT_TENANT = "local"

#: After so long without a frame a reader is told, once, why there may be none.
SILENCE_SECS = 5.0

_log = logging.getLogger(__name__)

_TENANT = re.compile(r"[a-z0-9-]{1,32}")
#: The line of its own source with which zenoh ends what it says.
_BUILT_AT = re.compile(r" at \S+\.rs:\d+\.?")
_RESERVED = {"batch", "render", "alive", "draining", "load", "asset"}


def frame_key(tenant: str, *, world: int | None = None) -> str:
    """Key expression of one world's frames, or of all worlds of a tenant.

    Raises:
        ValueError: `tenant` is not 1 to 32 of a-z, 0-9 and '-', or `world` is not positive.
    """
    if not _TENANT.fullmatch(tenant) or tenant in _RESERVED:
        raise ValueError(f"a tenant is 1 to 32 of a-z, 0-9 and '-', not {tenant!r}")
    if world is not None and world < 1:
        raise ValueError(f"a world's number is 1 or more, not {world}")
    return f"causeway/{tenant}/world/{'*' if world is None else world}/frame"


@dataclass(frozen=True)
class Identity:
    """Files (PEM) by which a bus with TLS knows who subscribes, for addresses `tls/HOST:PORT`."""

    #: Certificates of those who sign for everybody on the bus.
    authority: str | Path
    #: Its common name is `tenant-NAME`.
    certificate: str | Path
    #: Of the certificate.
    key: str | Path


def subscribe(
    endpoint: str = DEFAULT_ENDPOINT,
    *,
    tenant: str = DEFAULT_TENANT,
    world: int | None = None,
    ring_frames: int = 4,
    connect_timeout_secs: float = 5.0,
    identity: Identity | None = None,
) -> FrameSubscription:
    """Subscribes to the frames of one world, or of all worlds of `tenant`.

    A world publishes a frame with every tick and none while nobody ticks it. A reader that waits
    for longer than :data:`SILENCE_SECS` is told so by a warning of this module's logger.

    Args:
        endpoint: a bus address, as `causeway up` prints it.
        ring_frames: frames kept for a slow reader; the oldest goes when a newer one comes.
        identity: who subscribes, on a bus with TLS.

    Raises:
        ConnectionError: nobody listens at `endpoint`.
    """
    key = frame_key(tenant, world=world)
    if ring_frames < 1:
        raise ValueError(f"a ring holds at least 1 frame, not {ring_frames}")
    session = join(endpoint, connect_timeout_secs, identity)
    return FrameSubscription(session, key, ring_frames)


def join(
    endpoint: str = DEFAULT_ENDPOINT, timeout_secs: float = 5.0, identity: Identity | None = None
) -> zenoh.Session:
    """A session on a bus, as a client of it.

    Raises:
        ConnectionError: nobody listens at `endpoint`.
        ValueError: it is no address of a bus.
    """
    config = zenoh.Config()
    for name, value in [
        ("mode", "client"),
        ("connect/endpoints", [endpoint]),
        ("connect/timeout_ms", int(timeout_secs * 1000)),
        ("connect/exit_on_failure", True),
        ("scouting/multicast/enabled", False),
        ("scouting/gossip/enabled", False),
        *_secured(identity),
    ]:
        try:
            config.insert_json5(name, json.dumps(value))
        except zenoh.ZError:
            raise ValueError(
                f"no bus: wanted an address like {DEFAULT_ENDPOINT}, found {endpoint!r}"
            ) from None
    try:
        return zenoh.open(config)
    except zenoh.ZError as cause:
        raise ConnectionError(
            f"no bus at {endpoint}: start one with `causeway up`, or pass the address it printed "
            f"({_BUILT_AT.sub('', str(cause))})"
        ) from None


def _secured(identity: Identity | None) -> list[tuple[str, object]]:
    if identity is None:
        return []
    return [
        ("transport/link/tls/root_ca_certificate", str(identity.authority)),
        ("transport/link/tls/connect_certificate", str(identity.certificate)),
        ("transport/link/tls/connect_private_key", str(identity.key)),
        ("transport/link/tls/enable_mtls", True),
        ("transport/link/tls/verify_name_on_connect", True),
    ]


class FrameSubscription:
    """An iterator of frames, and a context manager that ends it. For one reading thread."""

    def __init__(self, session: zenoh.Session, key: str, ring_frames: int) -> None:
        self._ring: deque[bytes] = deque(maxlen=ring_frames)
        self._changed = threading.Condition()
        self._dropped = 0
        self._closed = False
        self._session = session
        self._key = key
        self._subscriber = session.declare_subscriber(key, self._put)

    @property
    def dropped(self) -> int:
        """Frames that this ring gave up because the reader was slower. Never decreases."""
        with self._changed:
            return self._dropped

    def receive(self, *, timeout_secs: float | None = None) -> Frame:
        """The oldest frame of the ring, or the next one to come.

        Raises:
            TimeoutError: no frame came in time.
            ValueError: a message was not a frame; the subscription goes on.
            EOFError: the subscription is closed.
        """
        now = time.monotonic()
        deadline = math.inf if timeout_secs is None else now + timeout_secs
        silent_at = now + SILENCE_SECS
        with self._changed:
            while not self._ring:
                if self._closed:
                    raise EOFError("the subscription is closed")
                now = time.monotonic()
                if now >= deadline:
                    raise TimeoutError(
                        f"no frame within {timeout_secs} s: a world publishes when it is ticked"
                    )
                if now >= silent_at:
                    _log.warning(
                        "no frame on %s for %.0f s: a world publishes when it is ticked, "
                        "e.g. by a session or by CARLA's client",
                        self._key,
                        SILENCE_SECS,
                    )
                    silent_at = math.inf
                wake_at = min(deadline, silent_at)
                self._changed.wait(None if wake_at == math.inf else wake_at - now)
            message = self._ring.popleft()
        return decode(message)

    def close(self) -> None:
        """Leaves the bus; a waiting reader gets :class:`EOFError`. Closing twice does nothing."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._changed.notify_all()
        self._session.close()

    def __iter__(self) -> Iterator[Frame]:
        return self

    def __next__(self) -> Frame:
        try:
            return self.receive()
        except EOFError:
            raise StopIteration from None

    def __enter__(self) -> FrameSubscription:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _put(self, sample: zenoh.Sample) -> None:
        message = sample.payload.to_bytes()
        with self._changed:
            if len(self._ring) == self._ring.maxlen:
                self._dropped += 1
            self._ring.append(message)
            self._changed.notify()
