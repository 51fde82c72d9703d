"""Messages as JSON, also of what numpy has computed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def encode(message: Mapping[str, Any]) -> str:
    """A message as JSON; numpy's scalars and arrays are numbers and lists.

    Raises:
        TypeError: a value is none that JSON has; the text names its key.
        ValueError: a number is not finite; the text names its key.
    """
    try:
        return json.dumps(message, default=_plain, allow_nan=False)
    except (TypeError, ValueError):
        _refuse("the message", message)
        raise


def _plain(value: Any) -> Any:
    """What numpy's scalars and arrays hold, without importing numpy for it."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{type(value).__name__} is nothing that JSON has")
    return value.tolist()


def _refuse(key: str, value: Any) -> None:
    """Raises for the first value that cannot be sent, by the key under which it is."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        for name, inner in value.items():
            _refuse(str(name), inner)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            _refuse(key, inner)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{key} cannot be sent; wanted a finite number, found {value}")
    elif value is not None and not isinstance(value, (str, int, float)):
        raise TypeError(
            f"{key} cannot be sent; wanted a number, a text, a boolean, a list or a dict, "
            f"found {value!r}"
        )
