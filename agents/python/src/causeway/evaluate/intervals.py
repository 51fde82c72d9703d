"""Intervals and tests of significance, by numpy alone and the same every time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Two-sided 95 % of the normal distribution.
Z = 1.959963984540054
DRAWS = 10_000
#: Resamples are drawn in pieces, which bounds the memory.
_PIECE = 2_000_000
_SEED = 2017

Interval = tuple[float, float]


def wilson(successes: int, count: int) -> Interval:
    """95 % of a share.

    **Source:** Wilson, "Probable inference, the law of succession, and statistical inference",
    1927, without correction for continuity.
    """
    if count == 0:
        return 0.0, 1.0
    share, square = successes / count, Z * Z
    middle = share + square / (2 * count)
    spread = Z * math.sqrt(share * (1 - share) / count + square / (4 * count * count))
    low, high = ((middle + side * spread) / (1 + square / count) for side in (-1.0, 1.0))
    # At the ends the formula is off by its rounding.
    return (0.0 if successes == 0 else low), (1.0 if successes == count else high)


def mean(values: ArrayLike) -> Interval:
    """95 % of a mean, by the percentiles of means of resamples."""
    given = np.asarray(values, np.float64)
    return ratio(given, np.ones_like(given))


def ratio(amounts: ArrayLike, shares: ArrayLike) -> Interval:
    """95 % of a sum over another one, both by episode: resampled in pairs.

    Infinite where a resample has nothing to divide by.
    """
    above, below = np.asarray(amounts, np.float64), np.asarray(shares, np.float64)
    if len(above) == 0:
        return math.nan, math.nan
    random = np.random.default_rng(_SEED)
    found: list[NDArray[np.float64]] = []
    piece = max(1, _PIECE // len(above))
    for first in range(0, DRAWS, piece):
        chosen = random.integers(len(above), size=(min(piece, DRAWS - first), len(above)))
        with np.errstate(divide="ignore", invalid="ignore"):
            found.append(above[chosen].sum(axis=1) / below[chosen].sum(axis=1))
    low, high = np.percentile(np.nan_to_num(np.concatenate(found)), [2.5, 97.5])
    return float(low), float(high)


def mcnemar(lost: int, won: int) -> float:
    """How likely so uneven a count of changes is, or a more uneven one, if nothing is different.

    **Source:** McNemar, 1947, in its exact form: a two-sided sign test.
    """
    count, fewer = lost + won, min(lost, won)
    if count == 0:
        return 1.0
    tail = sum(math.comb(count, at) for at in range(fewer + 1))
    return min(1.0, float(2 * tail / 2**count))


def holm(chances: Sequence[float]) -> list[float]:
    """Chances of several tests, adjusted so that together they err as often as one.

    **Source:** Holm, "A simple sequentially rejective multiple test procedure", 1979.
    """
    adjusted = [0.0] * len(chances)
    least = 0.0
    order = sorted(range(len(chances)), key=lambda at: chances[at])
    for rank, at in enumerate(order):
        least = max(least, min(1.0, chances[at] * (len(chances) - rank)))
        adjusted[at] = least
    return adjusted
