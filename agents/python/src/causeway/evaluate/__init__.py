"""How well policies drive: tasks by policies by seeds, with intervals, and what changed.

::

    python -m causeway.evaluate --policies follow driver.npz --tasks corl17-straight --out results

`docs/evaluate.md` says what is measured. In a program: :func:`play` drives the episodes,
:func:`summarise` counts them, :func:`by_condition` tells known towns and weathers from new ones,
:func:`compare` sets two runs side by side, :func:`write` keeps them.
"""

from causeway.evaluate.compare import Difference, compare
from causeway.evaluate.conditions import Row, by_condition
from causeway.evaluate.episodes import Cell, Episode, digest, play
from causeway.evaluate.results import read, write
from causeway.evaluate.summary import Summary, summarise, table

__all__ = [
    "Cell",
    "Difference",
    "Episode",
    "Row",
    "Summary",
    "by_condition",
    "compare",
    "digest",
    "play",
    "read",
    "summarise",
    "table",
    "write",
]
