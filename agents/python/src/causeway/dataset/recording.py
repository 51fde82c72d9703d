"""Recordings: MCAP files with a message for each step and one for each whole episode.

Steps are JSON on `/causeway/step`, ends on `/causeway/episode`, what a camera saw before a step, if
there was one, on `/causeway/picture` as `foxglove.CompressedImage`; a record of metadata named
`causeway` says what all have in common. Times are simulated ones, one episode after the other.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Generator, Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from causeway.dataset.episodes import About, Recorded

#: Layout of these files.
VERSION = 1
STEP, EPISODE, PICTURE = "/causeway/step", "/causeway/episode", "/causeway/picture"
#: A process that is killed loses less than so much of what it had written.
CHUNK_BYTES = 64 * 1024
#: Simulated time between two episodes, so that they do not overlap.
PAUSE_SECS = 1.0
_NUMBERS = {"type": "array", "items": {"type": "number"}}
_STEP_SCHEMA = {
    "type": "object",
    "properties": {
        "episode": {"type": "integer"},
        "frame": {"type": "integer"},
        "observation": _NUMBERS,
        "action": _NUMBERS,
        "reward": {"type": "number"},
        "terminated": {"type": "boolean"},
        "truncated": {"type": "boolean"},
        "tick": {"type": "integer"},
        "state_hash": {"type": "string"},
    },
}
_EPISODE_SCHEMA = {
    "type": "object",
    "properties": {
        "episode": {"type": "integer"},
        "seed": {"type": "integer"},
        "frames": {"type": "integer"},
        "numbers": {"type": "object"},
    },
}
#: As Foxglove has it: https://docs.foxglove.dev/docs/sdk/schemas/compressed-image
_PICTURE_SCHEMA = {
    "title": "foxglove.CompressedImage",
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        },
        "frame_id": {"type": "string"},
        "data": {"type": "string", "contentEncoding": "base64"},
        "format": {"type": "string"},
    },
}
_SCHEMAS = {
    STEP: ("causeway.step", _STEP_SCHEMA),
    EPISODE: ("causeway.episode", _EPISODE_SCHEMA),
    PICTURE: ("foxglove.CompressedImage", _PICTURE_SCHEMA),
}


def write(
    path: Path, about: About, episodes: Iterable[Recorded]
) -> Generator[Recorded, None, None]:
    """Writes episodes as they come, and passes each on when it is written.

    The file is whole after the last one, and when whoever iterates stops; it goes where there is an
    error before the first one. A process that is killed leaves the episodes that it had written.

    Raises:
        FileExistsError: there is such a file; it stays as it is.
    """
    with path.open("xb") as file:
        writer = Writer(file, chunk_size=CHUNK_BYTES)
        writer.start(profile="", library="causeway")
        known = {name: json.dumps(value) for name, value in asdict(about).items()}
        writer.add_metadata("causeway", {**known, "version": str(VERSION)})
        channels = {
            topic: writer.register_channel(
                topic=topic,
                message_encoding="json",
                schema_id=writer.register_schema(
                    name=name,
                    encoding="jsonschema",
                    data=json.dumps(schema).encode(),
                ),
            )
            for topic, (name, schema) in _SCHEMAS.items()
        }
        now, written = 0.0, 0
        try:
            for number, episode in enumerate(episodes):
                for frame in range(len(episode)):
                    at = now + frame * about.step_secs
                    if episode.pictures:
                        picture = _picture(at, episode.pictures[frame])
                        _add(writer, channels[PICTURE], at, frame, picture)
                    _add(writer, channels[STEP], at, frame, _step(number, frame, episode))
                now += len(episode) * about.step_secs
                end = {"episode": number, "seed": episode.seed, "frames": len(episode)}
                numbers = {"numbers": dict(episode.numbers)}
                _add(writer, channels[EPISODE], now, number, {**end, **numbers})
                now += PAUSE_SECS
                written += 1
                yield episode
        except BaseException:
            if written == 0:
                path.unlink()
            raise
        finally:
            writer.finish()


def _step(number: int, frame: int, episode: Recorded) -> dict[str, Any]:
    return {
        "episode": number,
        "frame": frame,
        "observation": [float(value) for value in episode.observations[frame]],
        "action": [float(value) for value in episode.actions[frame]],
        "reward": float(episode.rewards[frame]),
        "terminated": bool(episode.terminated[frame]),
        "truncated": bool(episode.truncated[frame]),
        "tick": int(episode.ticks[frame]),
        "state_hash": f"{episode.hashes[frame]:016x}",
    }


def _picture(secs: float, data: bytes) -> dict[str, Any]:
    whole, nanos = divmod(round(secs * 1e9), 1_000_000_000)
    return {
        "timestamp": {"sec": whole, "nsec": nanos},
        "frame_id": "camera",
        "data": base64.b64encode(data).decode(),
        "format": "jpeg",
    }


def _add(writer: Writer, channel: int, secs: float, sequence: int, value: dict[str, Any]) -> None:
    nanos = round(secs * 1e9)
    data = json.dumps(value).encode()
    writer.add_message(channel, log_time=nanos, publish_time=nanos, sequence=sequence, data=data)


def read(path: Path) -> tuple[About, Iterator[Recorded]]:
    """What :func:`write` wrote; of a file that ends within an episode the whole ones.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is no such recording; the text says why.
    """
    records = _records(path)
    for record in records:
        if isinstance(record, Metadata) and record.name == "causeway":
            known = {name: json.loads(value) for name, value in record.metadata.items()}
            version = known.pop("version", None)
            if version != VERSION:
                raise ValueError(f"{path} has version {version}; wanted {VERSION}")
            return About(**known), _episodes(records)
    raise ValueError(f"{path} is no recording of episodes: no metadata named causeway")


def _records(path: Path) -> Iterator[Any]:
    with path.open("rb") as file:
        try:
            yield from StreamReader(file, validate_crcs=True).records
        except (McapError, EOFError, struct.error) as error:
            if file.tell() < path.stat().st_size or path.stat().st_size == 0:
                reason = str(error) or "it ends before it begins"
                raise ValueError(f"{path} is no recording of episodes: {reason}") from None


def _episodes(records: Iterator[Any]) -> Iterator[Recorded]:
    topics: dict[int, str] = {}
    steps: list[dict[str, Any]] = []
    pictures: list[bytes] = []
    for record in records:
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        if not isinstance(record, Message):
            continue
        value = json.loads(record.data)
        if topics[record.channel_id] == PICTURE:
            pictures.append(base64.b64decode(value["data"]))
        elif topics[record.channel_id] == STEP:
            steps.append(value)
        else:
            yield _recorded(value, steps, pictures)
            steps, pictures = [], []


def _recorded(end: dict[str, Any], steps: list[dict[str, Any]], pictures: list[bytes]) -> Recorded:
    def column(name: str, kind: Any) -> Any:
        return np.array([step[name] for step in steps], kind)

    return Recorded(
        seed=end["seed"],
        observations=column("observation", np.float32),
        actions=column("action", np.float32),
        rewards=column("reward", np.float32),
        terminated=column("terminated", np.bool_),
        truncated=column("truncated", np.bool_),
        ticks=column("tick", np.uint64),
        hashes=np.array([int(step["state_hash"], 16) for step in steps], np.uint64),
        numbers=end["numbers"],
        pictures=pictures,
    )
