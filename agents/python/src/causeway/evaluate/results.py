"""The files of a run: `results.json` with every episode, and `report.html`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from causeway.evaluate.compare import Difference
from causeway.evaluate.conditions import Row
from causeway.evaluate.episodes import Episode, digest
from causeway.evaluate.page import WAY, page
from causeway.evaluate.summary import summarise

#: Of `results.json`.
VERSION = 1
#: What commands say after Ctrl-C.
NOTHING_KEPT = "interrupted: nothing is written of what has been driven"
RESULTS, REPORT = "results.json", "report.html"


def write(
    folder: Path,
    episodes: Sequence[Episode],
    differences: Sequence[Difference] = (),
    share: str = WAY,
    conditions: Sequence[Row] = (),
) -> None:
    """Writes both files; equal episodes give equal files. `share`: what `completion` is."""
    summaries = summarise(episodes)
    results = {
        "version": VERSION,
        "digest": digest(episodes),
        "cells": [one.record() for one in summaries],
        "conditions": [one.record() for one in conditions],
        "differences": [one.record() for one in differences],
        "episodes": [one.record() for one in episodes],
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RESULTS).write_text(json.dumps(results, indent=1) + "\n")
    (folder / REPORT).write_text(page(summaries, differences, episodes, share, conditions))


def read(path: Path) -> list[Episode]:
    """The episodes of a `results.json`.

    Raises:
        OSError, ValueError: it cannot be read; the text says why.
    """
    try:
        results = json.loads(path.read_text())
        if results["version"] != VERSION:
            raise ValueError(f"wanted version {VERSION}, found {results['version']}")
        return [Episode.of_record(record) for record in results["episodes"]]
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path} holds no results of an evaluation: {error}") from None
