"""What all environments over a batch share: Gymnasium's spaces of its rows, and their settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from causeway.extras import missing
from causeway.rollout import ACTION_WIDTH, Batch

try:
    from gymnasium import spaces
except ModuleNotFoundError as error:
    raise missing("gym", error) from error


def observation_space(batch: Batch) -> spaces.Box[np.float32]:
    """The space of one row."""
    normalised = bool(batch.spec["normalise"])
    scales = [column.scale if normalised else 1.0 for column in batch.columns]
    ends = ([column.low for column in batch.columns], [column.high for column in batch.columns])
    bounds = [np.array(end, np.float32) * np.array(scales, np.float32) for end in ends]
    # The engine multiplies in single precision: an end may come out one unit beyond.
    low, high = np.nextafter(bounds[0], -np.inf), np.nextafter(bounds[1], np.inf)
    return spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def action_space() -> spaces.Box[np.float32]:
    """Steering wheel, positive to the left, and pedal, positive for throttle."""
    return spaces.Box(-1.0, 1.0, shape=(ACTION_WIDTH,), dtype=np.float32)


def with_own(settings: Mapping[str, Any], **own: Any) -> dict[str, Any]:
    """Settings of the batch of an environment that chooses some of them itself.

    Raises:
        ValueError: other values are given for those.
    """
    for name, value in own.items():
        given = settings.get(name, value)
        if given != value:
            raise ValueError(f"{name} is {value!r} in this environment, not {given!r}")
    return {**settings, **own}
