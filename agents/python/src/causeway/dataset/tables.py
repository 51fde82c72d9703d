"""Recordings as plain Parquet, for pandas, polars, DuckDB and Hugging Face `datasets`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from causeway.dataset.episodes import About, Recorded


def vectors(rows: NDArray[np.float32]) -> pa.Array:
    """A column of lists of equal length."""
    return pa.FixedSizeListArray.from_arrays(pa.array(rows.reshape(-1)), rows.shape[1])


def hexadecimal(hashes: NDArray[np.uint64]) -> pa.Array:
    """Hashes as text: not every reader has unsigned numbers of 64 bits."""
    return pa.array([f"{value:016x}" for value in hashes])


def export_parquet(folder: Path, about: About, episodes: Iterable[Recorded]) -> int:
    """Writes `steps.parquet`, a row for each step, and `episodes.parquet`; returns how many.

    Pictures are JPEG in the column `picture`.

    The names of the columns of observations are in the metadata of `steps.parquet`, as JSON under
    `causeway`.

    Raises:
        FileExistsError: the folder holds such tables already.
        ValueError: there is no episode.
    """
    if (folder / "steps.parquet").exists():
        raise FileExistsError(f"{folder} holds tables of steps already")
    folder.mkdir(parents=True, exist_ok=True)
    note = {"columns": list(about.columns), "spec": dict(about.spec), "policy": about.policy}
    writer: pq.ParquetWriter | None = None
    ends: list[dict[str, Any]] = []
    try:
        for number, episode in enumerate(episodes):
            frames = np.arange(len(episode))
            shown = {"picture": pa.array(episode.pictures)} if episode.pictures else {}
            table = pa.table(
                {
                    "episode": np.full(len(episode), number),
                    "frame": frames,
                    "secs": frames * about.step_secs,
                    "observation": vectors(episode.observations),
                    "action": vectors(episode.actions),
                    "reward": episode.rewards,
                    "terminated": episode.terminated,
                    "truncated": episode.truncated,
                    "tick": episode.ticks.astype(np.int64),
                    "state_hash": hexadecimal(episode.hashes),
                    **shown,
                }
            )
            if writer is None:
                schema = table.schema.with_metadata({"causeway": json.dumps(note)})
                writer = pq.ParquetWriter(folder / "steps.parquet", schema)
            writer.write_table(table)
            known = {"episode": number, "seed": str(episode.seed), "frames": len(episode)}
            ends.append({**known, **episode.numbers})
    finally:
        if writer is not None:
            writer.close()
    if not ends:
        raise ValueError("there is no episode to export")
    pq.write_table(pa.Table.from_pylist(ends), folder / "episodes.parquet")
    return len(ends)
