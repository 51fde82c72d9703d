"""One driving episode over the OpenEnv WebSocket, synchronously and without further packages.

Positions and angles of observations follow CARLA: metres and degrees, left-handed, x
forward/east, y right/south, z up; speeds are in km/h where the name says so.
"""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus, InvalidURI
from websockets.sync.client import ClientConnection, connect

from causeway.messages import encode

DEFAULT_BASE_URL = "http://localhost:8000"

#: Largest reply, in bytes: a picture of 4096 × 4096 pixels in base64, with room.
REPLY_BYTES_MAX = 64 * 1024 * 1024

#: Status of HTTP for who has no valid token.
UNAUTHORIZED = 401


class SessionError(RuntimeError):
    """The server refused a request. The session and its episode are unchanged."""

    def __init__(self, message: str, *, code: str, errors: list[dict[str, Any]]) -> None:
        details = "".join(f"\n  {_where(error)}: {error.get('msg')}" for error in errors)
        super().__init__(f"{message} ({code}){details}")
        #: For programs, e.g. ``EXECUTION_ERROR``, ``VALIDATION_ERROR``, ``CAPACITY_REACHED``.
        self.code = code
        #: One entry per field that was wrong: ``type``, ``loc``, ``msg``, ``input``.
        self.errors = errors


@dataclass(frozen=True)
class Step:
    """What the server answers to a reset or a step."""

    #: The fields of the observation, e.g. ``speed_kmh``, ``nearby_actors``, ``camera_image``.
    observation: dict[str, Any]
    #: The scenario's reward of this step; ``None`` after a reset.
    reward: float | None
    #: Whether the episode is over. Steps are still taken: the world goes on.
    done: bool
    #: Facts beyond the observation: ``outcome``, ``info``, ``events``, ``sim``.
    metadata: dict[str, Any] = field(default_factory=dict)

    @property
    def rubric_reward(self) -> float | None:
        """0 until the episode is over, then its reward; ``None`` after a reset."""
        value = self.observation.get("rubric_reward")
        return None if value is None else float(value)


class Session:
    """One connection, one world, one episode at a time.

    Example::

        with Session("http://localhost:8000") as session:
            step = session.reset("trolley_saves", seed=7)
            side = step.metadata["info"]["side_directions"][0]
            while not step.done:
                step = session.step("lane_change", lane_direction=side)
            picture = session.capture()
    """

    def __init__(
        self,
        base_url: str = DEFAULT_BASE_URL,
        *,
        token: str | None = None,
        connect_timeout_secs: float = 10.0,
        reply_timeout_secs: float = 60.0,
    ) -> None:
        """Connects.

        Args:
            base_url: where the server is; a token may be its password, as in
                ``http://anybody:cw_...@host:8000``.
            token: who you are, for servers that ask; absent: `CAUSEWAY_TOKEN` of the environment.
            connect_timeout_secs: how long connecting may take.
            reply_timeout_secs: how long a reply may take.

        Raises:
            ConnectionError: nobody answers at `base_url`, or not as an OpenEnv server.
            PermissionError: the server wants a token, or another one.
        """
        url = _websocket_url(base_url)
        self._url = _without_user(url)
        if token is None and self._url == url:
            token = os.environ.get("CAUSEWAY_TOKEN")
        self._reply_timeout_secs = reply_timeout_secs
        self._open = ExitStack()
        try:
            opening = connect(
                url,
                additional_headers={"Authorization": f"Bearer {token}"} if token else None,
                open_timeout=connect_timeout_secs,
                max_size=REPLY_BYTES_MAX,
                compression=None,
                # A program may think for minutes between two steps; TCP notices a dead server.
                ping_interval=None,
                proxy=None,
            )
            self._connection: ClientConnection = self._open.enter_context(opening)
        except (OSError, InvalidHandshake, InvalidURI) as cause:
            if isinstance(cause, InvalidStatus) and cause.response.status_code == UNAUTHORIZED:
                raise PermissionError(
                    f"{self._url} wants a valid token: pass token=..., or set CAUSEWAY_TOKEN"
                ) from None
            if isinstance(cause, InvalidURI):
                raise ValueError(
                    f"no address: {self._url}; a token is the password of a user, "
                    "as in http://anybody:cw_...@host:8000"
                ) from None
            raise ConnectionError(
                f"no OpenEnv server at {self._url} ({cause}): start one with `causeway up`, "
                "or pass the address it printed"
            ) from cause

    def reset(
        self,
        scenario: str | None = None,
        *,
        scenario_config: Mapping[str, Any] | None = None,
        seed: int | None = None,
        episode_id: str | None = None,
        snapshot_id: str | None = None,
        join: str | None = None,
        ego: str | None = None,
    ) -> Step:
        """Starts a new episode.

        Args:
            scenario: e.g. ``trolley_saves`` or ``bias_3v1``; absent: the present one again.
            scenario_config: overrides of the scenario's settings; they stay for later resets.
            seed: the same seed and actions give the same observations; absent: drawn.
            episode_id: a name for the episode; absent: drawn.
            snapshot_id: goes on from this state, with its scenario, settings and seed.
            join: takes part in the world of another session, whose reset with ``num_egos``
                told this as ``metadata["world_id"]``.
            ego: as which ego, ``ego_1`` and so on; absent: the first one that is free.

        Raises:
            SessionError: unknown scenario, setting, snapshot, world or ego; the previous episode
                goes on.
        """
        wanted = {
            "scenario_name": scenario,
            "scenario_config": None if scenario_config is None else dict(scenario_config),
            "seed": seed,
            "episode_id": episode_id,
            "snapshot_id": snapshot_id,
            "join": join,
            "ego": ego,
        }
        data = {name: value for name, value in wanted.items() if value is not None}
        return _step(self._ask("reset", data))

    def step(self, action_type: str = "observe", **arguments: Any) -> Step:
        """Takes one action and advances the world by one tick of 0.05 s.

        Args:
            action_type: ``observe``, ``control``, ``emergency_stop``, ``brake_vehicle``,
                ``maintain_speed``, ``lane_change`` or ``capture_image`` (which never ticks).
            arguments: the action's fields, e.g. ``throttle`` (0 to 1), ``steer`` (-1 left to
                1 right), ``brake_intensity`` (0 to 1), ``target_speed_kmh``, ``lane_direction``.

        Raises:
            SessionError: a field is unknown or out of its bounds.
        """
        return _step(self._ask("step", {"action_type": action_type, **arguments}))

    def snapshot(self) -> str:
        """Keeps the present state; sessions go on from it with ``reset(snapshot_id=...)``.

        No time passes. For whoever trains, never for the driver: a sealed episode has none.

        Raises:
            SessionError: the episode is sealed.
        """
        return str(self.step(metadata={"op": "snapshot"}).metadata["snapshot_id"])

    def forget(self, snapshot_id: str) -> None:
        """Gives a state up that :meth:`snapshot` kept.

        Raises:
            SessionError: there is none, or the episode is sealed.
        """
        self.step(metadata={"op": "forget", "snapshot_id": snapshot_id})

    def state(self) -> dict[str, Any]:
        """The episode's counters: steps, distance, collisions, rewards, seed, map."""
        return self._ask("state", None)

    def capture(self) -> bytes:
        """The front camera's picture of the present moment, as JPEG. Time stands still.

        Raises:
            SessionError: with code ``NO_IMAGE`` when no renderer could draw it.
        """
        step = self.step("capture_image")
        image = step.observation.get("camera_image")
        if image is None:
            reason = step.metadata.get("camera_error", "the server gave no reason")
            raise SessionError(f"no picture: {reason}", code="NO_IMAGE", errors=[])
        return base64.b64decode(image, validate=True)

    def close(self) -> None:
        """Ends the session; its world is freed. Closing twice does nothing."""
        self._open.close()

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _ask(self, kind: str, data: dict[str, Any] | None) -> dict[str, Any]:
        message: dict[str, Any] = {"type": kind}
        if data is not None:
            message["data"] = data
        reply = self._exchange(encode(message))
        content = reply.get("data")
        if not isinstance(content, dict):
            raise ConnectionError(f"{self._url} answered {kind} without data: {repr(reply)[:200]}")
        if reply.get("type") == "error":
            raise SessionError(
                str(content.get("message")),
                code=str(content.get("code")),
                errors=content.get("errors") or [],
            )
        return content

    def _exchange(self, text: str) -> dict[str, Any]:
        try:
            try:
                self._connection.send(text)
            except ConnectionClosed:
                # A server that is full says so and closes; its reason waits to be read.
                pass
            raw = self._connection.recv(timeout=self._reply_timeout_secs)
        except TimeoutError:
            # A late reply would be taken for the answer to the next request.
            self.close()
            raise TimeoutError(
                f"{self._url} gave no reply within {self._reply_timeout_secs} s; "
                "the session is closed"
            ) from None
        except ConnectionClosed as cause:
            raise ConnectionError(f"{self._url} closed the session: {cause}") from cause
        return self._object(raw)

    def _object(self, raw: str | bytes) -> dict[str, Any]:
        try:
            reply = json.loads(raw)
        except ValueError:
            reply = None
        if not isinstance(reply, dict):
            found = repr(raw[:200])
            raise ConnectionError(f"{self._url} answered {found} instead of a JSON object")
        return reply


def _websocket_url(base_url: str) -> str:
    parts = urlsplit(base_url)
    scheme = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}.get(parts.scheme)
    if scheme is None or not parts.netloc:
        raise ValueError(f"wanted an address like {DEFAULT_BASE_URL}, found {base_url!r}")
    return urlunsplit((scheme, parts.netloc, parts.path.rstrip("/") + "/ws", "", ""))


def _without_user(url: str) -> str:
    """The address as messages may show it."""
    parts = urlsplit(url)
    return urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))


def _step(content: dict[str, Any]) -> Step:
    observation = content["observation"]
    return Step(
        observation=observation,
        reward=content.get("reward"),
        done=bool(content.get("done")),
        metadata=observation.get("metadata") or content.get("metadata") or {},
    )


def _where(error: Mapping[str, Any]) -> str:
    return ".".join(str(part) for part in error.get("loc", ())) or "message"
