"""Pictures of recordings: as columns of tables, and what their pixels are like."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from PIL import Image

#: Pictures of an episode, and pixels of each, that numbers about them are taken from.
PICTURES, PIXELS = 32, 32


def column(pictures: Sequence[bytes]) -> pa.Array:
    """A column as Hugging Face's `datasets.Image` is stored."""
    kind = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    return pa.array([{"bytes": picture, "path": None} for picture in pictures], kind)


def size(picture: bytes) -> tuple[int, int]:
    """Width and height."""
    with Image.open(io.BytesIO(picture)) as image:
        return image.size


def pixels(pictures: Sequence[bytes]) -> NDArray[np.float32]:
    """Colours from 0 to 1 of pixels that stand for all, shape ``(pixels, 3)``."""
    rows = []
    for picture in pictures[:: max(1, len(pictures) // PICTURES)]:
        with Image.open(io.BytesIO(picture)) as image:
            small = image.convert("RGB").resize((PIXELS, PIXELS), Image.Resampling.NEAREST)
        rows.append(np.asarray(small, np.float32).reshape(-1, 3) / 255.0)
    return np.concatenate(rows)
