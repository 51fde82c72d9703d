"""What the package's commands share: options of the engine, where they write, how they end."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

#: What brings the packages that recordings and tables of episodes need.
EXTRA = "pip install './agents/python[data]' brings it"
OF_EXTRA = ("mcap", "pyarrow", "PIL")
#: As shells have it after Ctrl-C.
INTERRUPTED = 130


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Options that say which engine runs, and what it knows beside its own towns and tasks."""
    parser.add_argument("--maps", help="folder of further OpenDRIVE files")
    parser.add_argument("--task-files", help="folder of further tasks, NAME.toml")
    parser.add_argument("--program", default="causeway", help="the engine (%(default)s)")


def engine(options: argparse.Namespace) -> dict[str, Any]:
    """Those options as settings of :class:`causeway.rollout.Batch`."""
    return {"maps": options.maps, "tasks": options.task_files, "program": options.program}


def want_new(path: Path) -> None:
    """Refuses the place of a file that is to be written, before anything is driven for it.

    Raises:
        OSError: something is there.
    """
    if path.is_dir():
        raise IsADirectoryError(f"--out: wanted a file, found a folder at {path}")
    if path.exists():
        raise FileExistsError(f"{path} is there already; give another --out or delete it")


def want_folder(folder: Path, names: Iterable[str]) -> None:
    """Makes the folder of files that are to be written, before anything is driven for them.

    Raises:
        OSError: it cannot be made or written to, or there is such a file.
    """
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"--out: wanted a folder, found a file at {folder}")
    for name in names:
        want_new(folder / name)
    folder.mkdir(parents=True, exist_ok=True)
    tempfile.TemporaryFile(dir=folder).close()


def ended(name: str, work: Callable[[], int], *, interrupted: str = "interrupted") -> int:
    """The status that work ends with, and a line on standard error where it is not whole.

    2 for what cannot be, and 130 after Ctrl-C, of which `interrupted` tells.
    """
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
    except KeyboardInterrupt:
        print(f"{name}: {interrupted}", file=sys.stderr)
        return INTERRUPTED
