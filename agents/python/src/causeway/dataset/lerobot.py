"""Recordings in the layout of LeRobot's data sets, version 3.0.

The folder is meant to be read by `LeRobotDataset("causeway/NAME", root=FOLDER)`. Observations are
`observation.state`; pictures, where there are some, are `observation.images.camera`: JPEG within
the tables, for which no decoder of films is needed.

**Source:** https://huggingface.co/docs/lerobot/lerobot-dataset-v3, and what the library itself
writes to `meta`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from causeway.dataset import pictures
from causeway.dataset.episodes import About, Recorded
from causeway.dataset.tables import hexadecimal, vectors

CODEBASE_VERSION = "v3.0"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
IMAGE = "observation.images.camera"
CHUNKS = 1_000
#: A file of data is ended when its arrays are larger than this.
FILE_BYTES = 100 * 1024 * 1024
ACTIONS = ("steer", "pedal")
_SCALARS = {"next.reward": "float32", "next.done": "bool", "next.success": "bool"}
_INDICES = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}


class _Sums:
    """Least, greatest, mean and spread of columns over all rows so far."""

    def __init__(self) -> None:
        self._parts: list[tuple[Any, Any, Any, Any, int]] = []

    def add(self, rows: NDArray[Any]) -> dict[str, list[float]]:
        """The numbers of these rows alone."""
        values = rows.astype(np.float64).reshape(len(rows), -1)
        sums = (values.sum(axis=0), (values**2).sum(axis=0), len(values))
        self._parts.append((values.min(axis=0), values.max(axis=0), *sums))
        return self._told(self._parts[-1:])

    def told(self) -> dict[str, list[float]]:
        return self._told(self._parts)

    def _told(self, parts: list[tuple[Any, Any, Any, Any, int]]) -> dict[str, list[float]]:
        lows, highs, sums, squares, counts = zip(*parts, strict=True)
        count = sum(counts)
        mean = np.sum(sums, axis=0) / count
        spread = np.sqrt(np.maximum(np.sum(squares, axis=0) / count - mean**2, 0.0))
        return {
            "min": np.min(lows, axis=0).tolist(),
            "max": np.max(highs, axis=0).tolist(),
            "mean": mean.tolist(),
            "std": spread.tolist(),
            "count": [count],
        }


class _Data:
    """The files of steps, one after the other."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: pq.ParquetWriter | None = None
        self._number, self._bytes = -1, FILE_BYTES

    def add(self, table: pa.Table) -> tuple[int, int]:
        """Writes an episode; returns the chunk and the file it is in."""
        if self._writer is None or self._bytes >= FILE_BYTES:
            self.close()
            self._number, self._bytes = self._number + 1, 0
            path = self._folder / DATA.format(**self._place())
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = pq.ParquetWriter(path, table.schema)
        self._writer.write_table(table)
        self._bytes += table.nbytes
        place = self._place()
        return place["chunk_index"], place["file_index"]

    def _place(self) -> dict[str, int]:
        return {"chunk_index": self._number // CHUNKS, "file_index": self._number % CHUNKS}

    def close(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def export_lerobot(folder: Path, about: About, episodes: Iterable[Recorded]) -> int:
    """Writes the folder; returns how many episodes it has.

    Raises:
        FileExistsError: the folder holds a data set already.
        ValueError: there is no episode, or the steps are not a whole number a second.
    """
    fps = round(1.0 / about.step_secs)
    if abs(fps * about.step_secs - 1.0) > 1e-6:
        raise ValueError(f"steps of {about.step_secs} s are not a whole number a second")
    if (folder / "meta").exists():
        raise FileExistsError(f"{folder} holds a data set already")
    task = str(about.spec["task"])
    data, sums = _Data(folder), dict[str, _Sums]()
    rows: list[dict[str, Any]] = []
    index, size = 0, None
    try:
        for number, episode in enumerate(episodes):
            columns = _columns(episode, number, index, about.step_secs)
            arrays = {name: _arrow(values) for name, values in columns.items()}
            hashes = {"causeway.state_hash": hexadecimal(episode.hashes)}
            shown = {IMAGE: pictures.column(episode.pictures)} if episode.pictures else {}
            chunk, file = data.add(pa.table({**arrays, **hashes, **shown}))
            if episode.pictures:
                size = pictures.size(episode.pictures[0])
                columns[IMAGE] = pictures.pixels(episode.pictures)
            stats = {
                f"stats/{name}/{key}": _shaped(name, key, value)
                for name, values in columns.items()
                for key, value in sums.setdefault(name, _Sums()).add(values).items()
            }
            rows.append(
                {
                    "episode_index": number,
                    "tasks": [task],
                    "length": len(episode),
                    "data/chunk_index": chunk,
                    "data/file_index": file,
                    "dataset_from_index": index,
                    "dataset_to_index": index + len(episode),
                    "causeway.seed": str(episode.seed),
                    **stats,
                    "meta/episodes/chunk_index": 0,
                    "meta/episodes/file_index": 0,
                }
            )
            index += len(episode)
    finally:
        data.close()
    if not rows:
        raise ValueError("there is no episode to export")
    (folder / EPISODES).parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.Table.from_pylist(rows), folder / EPISODES)
    pq.write_table(_tasks(task), folder / "meta/tasks.parquet")
    _json(
        folder / "meta/stats.json",
        {
            name: {key: _shaped(name, key, value) for key, value in one.told().items()}
            for name, one in sums.items()
        },
    )
    _json(folder / "meta/info.json", _info(about, fps, len(rows), index, size))
    note = {"columns": list(about.columns), "spec": dict(about.spec), "policy": about.policy}
    _json(folder / "meta/causeway.json", note)
    return len(rows)


def _shaped(name: str, key: str, values: list[float]) -> list[Any]:
    """Numbers of pictures are by channel, row and column, of which the last two are one."""
    return [[[value]] for value in values] if name == IMAGE and key != "count" else values


def _columns(
    episode: Recorded, number: int, index: int, step_secs: float
) -> dict[str, NDArray[Any]]:
    frames = np.arange(len(episode), dtype=np.int64)
    done = episode.terminated | episode.truncated
    return {
        "observation.state": episode.observations,
        "action": episode.actions,
        "next.reward": episode.rewards,
        "next.done": done,
        "next.success": done & episode.success,
        "timestamp": (frames * step_secs).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(len(episode), number, np.int64),
        "index": frames + index,
        "task_index": np.zeros(len(episode), np.int64),
    }


def _arrow(values: NDArray[Any]) -> pa.Array:
    return vectors(values) if values.ndim == 2 else pa.array(values)


def _tasks(task: str) -> pa.Table:
    """Tasks are the index of a table of pandas."""
    table = pa.table({"task_index": pa.array([0], pa.int64()), "task": [task]})

    def column(name: str, pandas_type: str, numpy_type: str) -> dict[str, Any]:
        kinds = {"pandas_type": pandas_type, "numpy_type": numpy_type, "metadata": None}
        return {"name": name, "field_name": name, **kinds}

    pandas = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
        "pandas_version": "2.0.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def _info(
    about: About, fps: int, episodes: int, frames: int, size: tuple[int, int] | None
) -> dict[str, Any]:
    names = [str(column["name"]) for column in about.columns]
    single = {**_SCALARS, **_INDICES, "causeway.state_hash": "string"}
    features = {
        "observation.state": {"dtype": "float32", "shape": [len(names)], "names": names},
        "action": {"dtype": "float32", "shape": [len(ACTIONS)], "names": list(ACTIONS)},
        **{name: {"dtype": kind, "shape": [1], "names": None} for name, kind in single.items()},
    }
    if size is not None:
        width, height = size
        axes = ["height", "width", "channels"]
        features[IMAGE] = {"dtype": "image", "shape": [height, width, 3], "names": axes}
    return {
        "codebase_version": CODEBASE_VERSION,
        "robot_type": "causeway",
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": 1,
        "chunks_size": CHUNKS,
        "data_files_size_in_mb": FILE_BYTES // 1024**2,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": DATA,
        "video_path": None,
        "features": features,
    }


def _json(path: Path, value: Any) -> None:
    path.write_text(json.dumps(value, indent=4) + "\n")
