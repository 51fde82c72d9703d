"""How the package's commands end where something is missing."""

import subprocess
import sys

import pytest

#: As where the packages of `causeway[data]` are not installed.
WITHOUT_DATA = """
import runpy, sys
sys.modules.update(mcap=None, pyarrow=None)
runpy.run_module(sys.argv.pop(1), run_name="__main__", alter_sys=True)
"""


def run(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", WITHOUT_DATA, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    "words",
    [
        ("causeway.record_episodes", "lane-keep", "--out", "x.mcap"),
        ("causeway.dataset", "x.mcap", "--parquet", "tables"),
    ],
)
def test_commands_for_data_say_what_brings_the_packages_that_they_need(words):
    helped = run(words[0], "--help")
    assert helped.returncode == 0, helped.stderr
    refused = run(*words)
    assert refused.returncode == 2 and "Traceback" not in refused.stderr, refused.stderr
    assert "agents/python[data]" in refused.stderr, refused.stderr


@pytest.mark.parametrize("size", ["64", "0x36", "axb"])
def test_a_camera_that_is_none_is_told_what_one_is(size):
    refused = run("causeway.record_episodes", "lane-keep", "--out", "x.mcap", "--camera", size)
    assert refused.returncode == 2
    assert f"a camera is WIDTHxHEIGHT, as 256x144, not '{size}'" in refused.stderr, refused.stderr
