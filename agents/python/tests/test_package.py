"""The package as it is installed: typed, complete, and clean for a type checker."""

import subprocess
import sys
import zipfile
from pathlib import Path

PACKAGE = Path(__file__).parent.parent


def test_the_wheel_holds_the_generated_code_and_says_that_it_is_typed(tmp_path):
    # A copy, because building leaves files beside the sources.
    command = ["cp", "-r", PACKAGE / "src", PACKAGE / "pyproject.toml", tmp_path]
    subprocess.run(command, check=True, timeout=60)
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
        + ["--disable-pip-version-check", "--wheel-dir", tmp_path / "wheel", tmp_path],
        check=True,
        timeout=120,
    )
    (wheel,) = (tmp_path / "wheel").glob("causeway-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    modules = {"__init__", "frames", "bus", "openenv", "gym", "wire/Frame", "wire/ActorState"}
    assert {f"causeway/{name}.py" for name in modules} <= names
    assert "causeway/py.typed" in names


def test_the_types_are_consistent():
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "examples", "src/causeway"],
        cwd=PACKAGE,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout + run.stderr
