"""Sites and clients that the tests share."""

import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from documented_blocks import page_of
from documents import ROOT
from running_site import CACHE, PACKAGE, Site, binary, start, stop
from shell import Shell

sys.path.insert(0, str(PACKAGE / "src"))


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """One site for all tests that do not need their own."""
    running = start(tmp_path_factory.mktemp("site") / "log")
    yield running
    stop(running)


@pytest.fixture
def client(site):
    """CARLA's client of a new episode on the shared site."""
    from carla_site import fresh

    return fresh(site.carla_port)


@pytest.fixture
def world(client):
    """The world of that episode, in synchronous mode."""
    from carla_site import synchronous

    with synchronous(client.get_world()) as world:
        yield world


@pytest.fixture
def base_url(site):
    return site.base_url


@pytest.fixture
def start_site(tmp_path):
    """Starts further sites, e.g. `start_site("--no-render", MAX_CONCURRENT_ENVS="2")`."""
    running = []

    def another(*flags: str, **more) -> Site:
        running.append(start(tmp_path / f"log-{len(running)}", *flags, **more))
        return running[-1]

    yield another
    for site in running:
        stop(site)


def folder_of(wanted: str) -> Path:
    """Folder with a package alone whose modules have the names of others that are installed."""
    folder = CACHE / wanted.replace("==", "-")
    if not folder.exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=CACHE) as fresh:
            subprocess.run(
                [
                    *(sys.executable, "-m", "pip", "install", "--disable-pip-version-check"),
                    *("--quiet", "--no-deps", "--target", f"{fresh}/client", wanted),
                ],
                check=True,
                timeout=300,
            )
            os.rename(f"{fresh}/client", folder)
    return folder


@pytest.fixture(scope="session")
def old_client():
    """Folder with the client generation before `openenv`, which has the same module names."""
    return folder_of("openenv-core==0.3.0")


@pytest.fixture(scope="session")
def ue5_client():
    """Folder with CARLA's client of Unreal Engine 5, which has the same module name."""
    if sys.version_info[:2] != (3, 11) or platform.machine() != "x86_64":
        pytest.skip("no wheel of carla-ue5-api: there is one for Python 3.11 on x86-64")
    return folder_of("carla-ue5-api==0.10.0")


@pytest.fixture(scope="session")
def images(tmp_path_factory):
    """Both images, made from deploy/Containerfile with the program under test."""
    import containers

    containers.need_engine()
    folder = tmp_path_factory.mktemp("images")
    containers.make_debian(folder)
    containers.make_binary_image(folder)
    containers.build("full", containers.FULL)
    containers.build("core", containers.CORE)


@pytest.fixture
def names_of_project():
    """A name for containers of one test, which are removed after it."""
    name = f"causeway-test-{os.getpid()}"
    yield name
    subprocess.run(["docker", "rm", "--force", "--volumes", name], capture_output=True)


@pytest.fixture
def environment(tmp_path):
    """That of a reader who has done what the README begins with, and no more."""
    built = tmp_path / "cache" / "causeway" / "target" / "release"
    built.mkdir(parents=True)
    (built / "causeway").symlink_to(binary())
    ours = ("CAUSEWAY_BIN", "CAUSEWAY_TARGET_DIR", "CAUSEWAY_CACHE_DIR")
    return {
        **{name: value for name, value in os.environ.items() if name not in ours},
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join([str(PACKAGE / "src"), str(ROOT / "deploy" / "space")]),
    }


@pytest.fixture
def shell(tmp_path, environment):
    # The line of the README, in a cache that is this test's.
    (line,) = [line for line in page_of("README.md").commands() if line.startswith("export PATH")]
    folder = line.partition('"')[2].partition(":$PATH")[0]
    folder = folder.replace("$HOME/.cache", environment["XDG_CACHE_HOME"])
    # What the package installer keeps is everybody's.
    shared = {name: value for name, value in environment.items() if name != "XDG_CACHE_HOME"}
    shell = Shell(tmp_path, {**shared, "PATH": f"{folder}:{environment['PATH']}"})
    with shell.servers:
        yield shell
