"""Tokens for the tests, as their owners get them."""

import subprocess
from pathlib import Path

from running_site import binary


def command(*words: str) -> str:
    """What a command prints; it must succeed."""
    done = subprocess.run([binary(), *words], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def new_token(path: Path, tenant: str, name: str) -> str:
    """A new token of a file of tenants."""
    return command("token", "new", "--tenant", tenant, "--id", name, "--add", str(path)).strip()
