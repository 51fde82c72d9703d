"""Where the command `causeway` is, and the folders that it is given."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

#: As people type it.
NAME = "causeway"
#: What lies in folders that programs are given, by flag.
IN_FOLDERS = {"maps": ".xodr files", "tasks": ".toml files"}


def find(program: str = NAME) -> str:
    """The path of a program.

    A name other than `causeway` is found as a shell does. `causeway` is the file that
    `CAUSEWAY_BIN` names, else what the PATH has, else what `./run` has built: in
    `CAUSEWAY_TARGET_DIR`, or in the folder `target` of `CAUSEWAY_CACHE_DIR` or of
    `~/.cache/causeway`.

    Raises:
        FileNotFoundError: there is none; the text says where it was looked for.
    """
    if program != NAME:
        found = shutil.which(program)
        if found is None:
            raise FileNotFoundError(f"no program {program!r}: wanted a path, or a name on the PATH")
        return found
    given = os.environ.get("CAUSEWAY_BIN")
    if given:
        if shutil.which(given) is None:
            raise FileNotFoundError(f"no program at {given!r}, which CAUSEWAY_BIN names")
        return given
    built = str(_target() / "release" / NAME)
    found = shutil.which(NAME) or shutil.which(built)
    if found is None:
        raise FileNotFoundError(
            f"no program `causeway` on the PATH or at {built}: build it with ./run in a checkout, "
            "or name it with CAUSEWAY_BIN or program=..."
        )
    return found


def folder(flag: str, path: str | Path) -> Path:
    """A folder as a program is given it, wherever that runs.

    Raises:
        ValueError: it is none; a program would go on without it.
    """
    found = Path(path).absolute()
    if not found.is_dir():
        what = "a file" if found.exists() else "nothing"
        raise ValueError(f"{flag}: wanted a folder of {IN_FOLDERS[flag]}, found {what} at {path}")
    return found


def _target() -> Path:
    """Where `./run` builds, as `scripts/setup.sh` decides it."""
    target, cache = os.environ.get("CAUSEWAY_TARGET_DIR"), os.environ.get("CAUSEWAY_CACHE_DIR")
    if target:
        return Path(target)
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache or Path(caches) / NAME) / "target"
