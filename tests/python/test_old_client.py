"""The client generation before the package was renamed works as well."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from driving import session

HERE = Path(__file__).parent


def test_the_old_client_plays_an_episode(base_url, old_client):
    run = subprocess.run(
        [sys.executable, HERE / "old_client_session.py", base_url],
        env={**os.environ, "PYTHONPATH": f"{old_client}{os.pathsep}{HERE}"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stderr
    seen = json.loads(run.stdout)
    assert seen["module"].startswith(str(old_client)), "the new client was imported instead"
    assert seen["rewards"] == [-1.0] * 4
    assert seen["done"] == [False, False, False, True]
    assert seen["picture_chars"] > 10_000
    assert seen["step_count"] == 5
    assert seen["refusal"] == "Server error: Unknown scenario: nope (code: EXECUTION_ERROR)"
    assert seen["synchronous_step"] == 1
    with session(base_url) as env:
        new = env.reset(scenario_name="trolley_saves", seed=1).observation
    assert seen["location"] == pytest.approx(new.location)
