"""OpenEnv's own tests of `carla_env`, as they are, with our service behind the environment.

They are not ours to keep: `CAUSEWAY_OPENENV_DIR` names a checkout of OpenEnv. About a quarter of
them reset, step or ask for the state, which goes over the wire; the others are about upstream's own
classes of scenarios.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
#: Of upstream's tests, those in which the service has to be asked.
ASKING = 13


def test_upstreams_tests_pass_over_the_wire(site):
    folder = os.environ.get("CAUSEWAY_OPENENV_DIR")
    if not folder:
        pytest.skip("no tests of OpenEnv; set CAUSEWAY_OPENENV_DIR")
    root = Path(folder).resolve()
    paths = [root / "src", root / "envs", HERE]
    environment = {
        "PYTHONPATH": os.pathsep.join(map(str, paths)),
        "PYTHONDONTWRITEBYTECODE": "1",
        "CAUSEWAY_URL": site.base_url,
    }
    flags = ["-p", "openenv_over_wire", "-p", "no:cacheprovider", "--rootdir", str(root)]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *flags, "tests/envs/test_carla_environment.py"],
        cwd=root,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    (asking,) = re.findall(r"(\d+) tests asked the service", done.stdout)
    assert int(asking) >= ASKING, done.stdout[-2000:]
    print(re.search(r"\d+ passed", done.stdout)[0], f"{asking} of them asked the service")
