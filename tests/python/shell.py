"""Lines of documents, typed into a shell."""

import contextlib
import shlex
import subprocess
from pathlib import Path


class Shell:
    """Runs lines of a block in a folder; what serves goes on until the end of the test."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self.folder = folder
        self.environment = environment
        self.servers = contextlib.ExitStack()

    def run(self, line: str) -> str:
        result = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", line],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=600,
        )
        assert result.returncode == 0, f"{line}\n{result.stdout}{result.stderr}"
        return result.stdout

    def serve(self, line: str) -> None:
        process = subprocess.Popen(shlex.split(line), cwd=self.folder, env=self.environment)
        self.servers.callback(process.wait)
        self.servers.callback(process.terminate)
