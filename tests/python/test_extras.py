"""Modules that need more packages than the rest say what brings them."""

import os
import subprocess
import sys

import pytest

from running_site import PACKAGE

HIDE = "import sys; sys.modules[{package!r}] = None; import causeway.{module}"


@pytest.mark.parametrize(
    ("module", "package", "extra"),
    [
        ("zoo", "pettingzoo", "zoo"),
        ("zoo", "gymnasium", "zoo"),
        ("gym", "gymnasium", "gym"),
        ("vector", "gymnasium", "gym"),
        ("puffer", "gymnasium", "gym"),
    ],
)
def test_a_module_without_its_packages_says_what_brings_them(module, package, extra):
    run = subprocess.run(
        [sys.executable, "-c", HIDE.format(module=module, package=package)],
        env={**os.environ, "PYTHONPATH": str(PACKAGE / "src")},
        capture_output=True,
        text=True,
        timeout=60,
    )
    last = run.stderr.splitlines()[-1]
    assert last.startswith("ModuleNotFoundError") and package in last, run.stderr
    assert f"(pip install './agents/python[{extra}]' brings it)" in last
