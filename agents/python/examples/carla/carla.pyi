"""For type checkers: the wheel says of itself that it has no types."""

from typing import Any

def __getattr__(name: str) -> Any: ...
