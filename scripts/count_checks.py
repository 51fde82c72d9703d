"""Counts the checks of a JUnit report, and says what was skipped that this machine could run.

count_checks.py REPORT.xml [AGAIN.xml]

Prints `PASSED FAILED SKIPPED`; names on standard error every skipped test and why. A test that
cannot run where it is says so: in Python with `pytest.skip(REASON)`, in Rust with a line
`skipped: REASON` on its output, after which it returns. A reason that is not in `EXCUSES`, or whose
excuse does not hold on this machine, counts as a failure.

What failed is run once more, and AGAIN.xml tells how that went. A test that passes then is flaky:
it is named. Up to `FLAKY_MOST` of them count as passed, more as failed.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

#: Tests of one report that may pass only when they are run again.
FLAKY_MOST = 2

VULKAN_DRIVERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d")


def has_no_vulkan() -> bool:
    return not any(any(Path(folder).glob("*.json")) for folder in VULKAN_DRIVERS)


def has_no_other_address() -> bool:
    interfaces = Path("/sys/class/net")
    return interfaces.is_dir() and {path.name for path in interfaces.iterdir()} <= {
        "lo"
    }


def is_installed(package: str) -> bool:
    environments = (Path.home() / ".cache" / "causeway" / "venv").glob("lib/python3*")
    return any((one / "site-packages" / package).exists() for one in environments)


def has_python_of_ue5() -> bool:
    return (Path.home() / ".cache" / "causeway" / "venv/lib/python3.11").is_dir()


def has_no_engine() -> bool:
    return shutil.which("docker") is None or bool(
        subprocess.run(["docker", "info"], capture_output=True, check=False).returncode
    )


#: What a reason says, and whether this machine really cannot.
EXCUSES: dict[str, Callable[[], bool]] = {
    r"no checkout of git": lambda: not Path(".git").exists(),
    r"no recordings": lambda: "CAUSEWAY_RECORDINGS_DIR" not in os.environ,
    r"no tests of OpenEnv": lambda: "CAUSEWAY_OPENENV_DIR" not in os.environ,
    r"no scripts of CARLA": lambda: "CAUSEWAY_CARLA_SCRIPTS_DIR" not in os.environ,
    r"no readers of maps": lambda: "CAUSEWAY_READERS_DIR" not in os.environ,
    r"no maps": lambda: "CAUSEWAY_MAPS_DIR" not in os.environ,
    r"no( Vulkan)? adapter": has_no_vulkan,
    r"no address but the loopback": has_no_other_address,
    r"no container engine": has_no_engine,
    r"Stable-Baselines3 needs torch": lambda: not is_installed("stable_baselines3"),
    r"no wheel of carla-ue5-api": lambda: (
        platform.machine() != "x86_64" or not has_python_of_ue5()
    ),
    r"PufferLib wants numpy below 2": lambda: not is_installed("pufferlib"),
    r"no kubectl$": lambda: shutil.which("kubectl") is None,
    r"no kubectl that knows components": lambda: shutil.which("kubectl") is not None,
    r"no docker-compose": lambda: shutil.which("docker-compose") is None,
    r"only root can become another user": lambda: os.geteuid() != 0,
    r"no network namespaces": lambda: bool(
        subprocess.run(["unshare", "--net", "true"], capture_output=True, check=False).returncode
    ),
    r"no systemd in a container": Path("/sys/fs/cgroup/cgroup.controllers").exists,
    r"no chromium": lambda: shutil.which("chromium") is None,
    r"no promtool": lambda: shutil.which("promtool") is None,
    r"no systemd": lambda: shutil.which("systemd-analyze") is None,
}


@dataclass(frozen=True)
class Check:
    """One test of a report."""

    name: str
    failed: bool
    #: It failed, and passed when it was run again.
    flaky: bool
    #: Why it did not run; `None` when it did.
    skipped: str | None


def checks(report: Path) -> Iterator[Check]:
    """The tests of a report by nextest or pytest."""
    for case in ElementTree.parse(report).iter("testcase"):
        failed = case.find("failure") is not None or case.find("error") is not None
        yield Check(
            name=f"{case.get('classname')}::{case.get('name')}",
            failed=failed,
            # As nextest reports it, which runs a test again by itself.
            flaky=not failed and case.find("flakyFailure") is not None,
            skipped=None if failed else reason(case),
        )


def with_second_run(first: list[Check], again: list[Check]) -> list[Check]:
    """The checks of a run, knowing how those that failed went when they were run again."""
    passed_again = {check.name for check in again if not check.failed and check.skipped is None}
    return [
        replace(check, failed=False, flaky=True)
        if check.failed and check.name in passed_again
        else check
        for check in first
    ]


def reason(case: ElementTree.Element) -> str | None:
    mark = case.find("skipped")
    if mark is not None:
        return mark.get("message") or "no reason given"
    for output in (*case.iter("system-out"), *case.iter("system-err")):
        said = re.search(r"^skipped: (.*)$", output.text or "", flags=re.MULTILINE)
        if said:
            return said.group(1)
    return None


def is_excused(why: str) -> bool:
    return any(re.search(words, why) and holds() for words, holds in EXCUSES.items())


def main() -> int:
    reports = [list(checks(Path(path))) for path in sys.argv[1:]]
    found = with_second_run(*reports) if len(reports) > 1 else reports[0]
    flaky = [check.name for check in found if check.flaky]
    for name in flaky:
        print(f"flaky, passed when it was run again: {name}", file=sys.stderr)
    passed = failed = skipped = 0
    for check in found:
        if check.failed or (check.flaky and len(flaky) > FLAKY_MOST):
            failed += 1
        elif check.skipped is None:
            passed += 1
        elif is_excused(check.skipped):
            skipped += 1
            print(f"skipped: {check.name}: {check.skipped}", file=sys.stderr)
        else:
            failed += 1
            print(
                f"skipped, but this machine could run it: {check.name}: {check.skipped}",
                file=sys.stderr,
            )
    print(passed, failed, skipped)
    return 0


if __name__ == "__main__":
    sys.exit(main())
