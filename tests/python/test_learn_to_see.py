"""What learns from pictures of one weather sees in others, on a small budget."""

import re
import subprocess
import sys

from running_site import PACKAGE

EXAMPLE = PACKAGE / "examples" / "carla" / "learn_to_see.py"
ROW = r"^\| (day|night|rain|rainy night|all) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$"
LIMIT_SECS = 900.0


def test_what_learns_in_one_weather_sees_in_another(site, client):
    at = ("--host", "127.0.0.1", "--port", str(site.carla_port))
    ran = subprocess.run(
        [sys.executable, str(EXAMPLE), *at, "--scenes", "30", "--seed", "1"],
        capture_output=True,
        text=True,
        timeout=LIMIT_SECS,
    )
    assert ran.returncode == 0, ran.stderr
    rows = re.findall(ROW, ran.stdout, re.MULTILINE)
    right = {learnt: [int(share) for share in shares] for learnt, *shares in rows}
    assert len(right) == 5, ran.stdout
    # Of three classes a guess is right in a third of cases.
    assert right["day"][0] > 70 and right["night"][1] > 70, ran.stdout
    assert right["day"][1] > 55 and right["night"][0] > 55, ran.stdout
    assert right["day"][2] > 55 and min(right["all"]) > 60, ran.stdout
