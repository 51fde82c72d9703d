"""What the package's commands share: the options of the engine, and how they end."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

#: What brings the packages that recordings and tables of episodes need.
EXTRA = "pip install './agents/python[data]' brings it"
OF_EXTRA = ("mcap", "pyarrow", "PIL")


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Options that say which engine runs, and what it knows beside its own towns and tasks."""
    parser.add_argument("--maps", help="folder of further OpenDRIVE files")
    parser.add_argument("--task-files", help="folder of further tasks, NAME.toml")
    parser.add_argument("--program", default="causeway", help="the engine (%(default)s)")


def engine(options: argparse.Namespace) -> dict[str, Any]:
    """Those options as settings of :class:`causeway.rollout.Batch`."""
    return {"maps": options.maps, "tasks": options.task_files, "program": options.program}


def ended(name: str, work: Callable[[], int]) -> int:
    """The status that work ends with: 2 for what cannot be, which is told on standard error."""
    try:
        return work()
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in OF_EXTRA:
            raise
        print(f"{name}: {error} ({EXTRA})", file=sys.stderr)
        return 2
    except (OSError, RuntimeError, ValueError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
