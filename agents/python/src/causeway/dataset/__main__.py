"""Exports a recording of episodes as Parquet, or in LeRobot's layout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from causeway.commands import ended


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m causeway.dataset", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("recording", type=Path, help="of python -m causeway.record_episodes")
    parser.add_argument("--parquet", type=Path, metavar="DIR", help="tables of steps and episodes")
    parser.add_argument("--lerobot", type=Path, metavar="DIR", help="a data set of LeRobot, v3.0")
    parser.add_argument("--only", choices=["success"], help="leaves the other episodes out")
    options = parser.parse_args()
    if not (options.parquet or options.lerobot):
        parser.error("nothing to do: wanted --parquet DIR or --lerobot DIR")
    return ended("causeway.dataset", lambda: export_all(options))


def export_all(options: argparse.Namespace) -> int:
    from causeway.dataset import export_lerobot, export_parquet, read

    for folder, export in (
        (options.parquet, export_parquet),
        (options.lerobot, export_lerobot),
    ):
        if folder is not None:
            about, episodes = read(options.recording)
            chosen = (it for it in episodes if it.success or options.only is None)
            print(f"{folder}: {export(folder, about, chosen)} episodes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
