"""The package as it is installed: typed, complete, and clean for a type checker."""

import subprocess
import sys
import zipfile
from pathlib import Path

PACKAGE = Path(__file__).parent.parent
CONFORMANCE = PACKAGE.parent.parent / "tests" / "python"


def files() -> set[Path]:
    """All files of the package's folder but what Python itself caches."""
    return {path for path in PACKAGE.rglob("*") if "cache" not in str(path)}


def test_the_wheel_is_complete_typed_and_leaves_nothing_in_the_tree(tmp_path):
    before = files()
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"),
            *("--no-deps", "--no-build-isolation", "--wheel-dir", tmp_path / "wheel", PACKAGE),
        ],
        check=True,
        timeout=600,
    )
    assert files() == before
    (wheel,) = (tmp_path / "wheel").glob("causeway-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    modules = {
        "__init__",
        "frames",
        "bus",
        "openenv",
        "maps",
        "gym",
        "policy",
        "zoo",
        "evaluate/__main__",
        "wire/Frame",
        "wire/ActorState",
    }
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
        timeout=900,
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_the_code_is_formatted_and_lint_finds_nothing():
    for command in (["format", "--check"], ["check"]):
        run = subprocess.run(
            [sys.executable, "-m", "ruff", *command, PACKAGE, CONFORMANCE],
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert run.returncode == 0, run.stdout + run.stderr
