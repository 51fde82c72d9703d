"""Episodes as data sets: recorded as MCAP, exported as Parquet and in LeRobot's layout.

`python -m causeway.record_episodes` records, `python -m causeway.dataset` exports; both need
``pip install 'causeway[data]'``.
"""

from causeway.dataset.episodes import About, Recorded, play
from causeway.dataset.lerobot import export_lerobot
from causeway.dataset.recording import read, write
from causeway.dataset.tables import export_parquet

__all__ = ["About", "Recorded", "export_lerobot", "export_parquet", "play", "read", "write"]
