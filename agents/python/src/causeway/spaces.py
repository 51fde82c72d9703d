"""Gymnasium spaces of a batch's rows, for all faces that need them."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from causeway.rollout import ACTION_WIDTH, Batch


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
