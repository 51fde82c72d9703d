"""Episodes as data sets: recorded as MCAP, exported as Parquet and in LeRobot's layout.

`python -m causeway.record_episodes` records, `python -m causeway.dataset` exports; both need
``pip install 'causeway[data]'``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from causeway.dataset.episodes import About, Recorded, play

if TYPE_CHECKING:
    from causeway.dataset.lerobot import export_lerobot
    from causeway.dataset.recording import read, write
    from causeway.dataset.tables import export_parquet

__all__ = ["About", "Recorded", "export_lerobot", "export_parquet", "play", "read", "write"]

#: Modules of names that need further packages.
_WITH_DATA = {
    "export_lerobot": "lerobot",
    "export_parquet": "tables",
    "read": "recording",
    "write": "recording",
}


def __getattr__(name: str) -> Any:
    if name not in _WITH_DATA:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_WITH_DATA[name]}"), name)
