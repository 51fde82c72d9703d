"""The package as it is installed: typed, complete, and clean for a type checker."""

import subprocess
import sys
import zipfile
from pathlib import Path

PACKAGE = Path(__file__).parent.parent
SOURCES = ("src", "pyproject.toml", "README.md")
CONFORMANCE = PACKAGE.parent.parent / "tests" / "python"


def test_the_wheel_holds_the_generated_code_and_says_that_it_is_typed(tmp_path):
    # A copy, because building leaves files beside the sources.
    command = ["cp", "-r", *(PACKAGE / name for name in SOURCES), tmp_path]
    subprocess.run(command, check=True, timeout=60)
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"),
            *("--no-deps", "--no-build-isolation", "--wheel-dir", tmp_path / "wheel", tmp_path),
        ],
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
        [
            sys.executable,
            "-m",
            "mypy",
            "--strict",
            "--no-error-summary",
            "examples",
            "src/causeway",
        ],
        cwd=PACKAGE,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_the_code_is_formatted_and_lint_finds_nothing():
    for command in (["format", "--check"], ["check"]):
        run = subprocess.run(
            [sys.executable, "-m", "ruff", *command, PACKAGE, CONFORMANCE],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert run.returncode == 0, run.stdout + run.stderr
