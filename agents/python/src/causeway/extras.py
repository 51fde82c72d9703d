"""What to install for the modules that need more packages than the others."""

from __future__ import annotations


def missing(extra: str, error: ModuleNotFoundError) -> ModuleNotFoundError:
    """The same error, with what brings the package."""
    return ModuleNotFoundError(
        f"{error} (pip install './agents/python[{extra}]' brings it)", name=error.name
    )
