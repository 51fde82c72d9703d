"""Images made of deploy/Containerfile, and their containers, on an engine without a registry."""

import io
import os
import shutil
import subprocess
import tarfile
import time
from pathlib import Path

import carla
import httpx
import pytest
from causeway import Session

from carla_site import connect, spawn_car, synchronous
from running_site import binary

ROOT = Path(__file__).parent.parent.parent
DEBIAN = "debian:12-slim"
BINARY = "causeway-binary:test"
FULL, CORE = "causeway:test", "causeway-core:test"
READY_SECS = 60.0
HEALTHY_SECS = 120.0


def docker(*arguments: str, **options) -> str:
    """What `docker` prints."""
    done = subprocess.run(["docker", *arguments], capture_output=True, timeout=300, **options)
    if done.returncode != 0:
        what = f"docker {' '.join(arguments)}: {done.stderr.decode()}"
        pytest.fail(what, pytrace=False)
    return done.stdout.decode()


def need_engine() -> None:
    if shutil.which("docker") is None:
        pytest.skip("no container engine")
    if subprocess.run(["docker", "info"], capture_output=True).returncode != 0:
        pytest.skip("no container engine")


def has_image(name: str) -> bool:
    inspect = ["docker", "image", "inspect", name]
    return subprocess.run(inspect, capture_output=True).returncode == 0


def make_debian(folder: Path) -> None:
    """Debian's base as an image: from a registry, else from Debian's packages."""
    if has_image(DEBIAN):
        return
    if subprocess.run(["docker", "pull", DEBIAN], capture_output=True).returncode == 0:
        return
    root = folder / "debian"
    subprocess.run(
        ["debootstrap", "--variant=minbase", "bookworm", root],
        check=True,
        capture_output=True,
    )
    packed = subprocess.Popen(["tar", "-C", root, "-c", "."], stdout=subprocess.PIPE)
    docker("import", "-", DEBIAN, stdin=packed.stdout)
    assert packed.wait() == 0


def make_binary_image(folder: Path) -> None:
    """An image of nothing but the program under test, without what debuggers read."""
    stripped = folder / "causeway"
    subprocess.run(["strip", "-o", stripped, binary()], check=True)
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        archive.add(stripped, "usr/bin/causeway")
    docker("import", "-", BINARY, input=packed.getvalue())


def build(target: str, name: str) -> None:
    """One of the two images."""
    arguments = ["--build-arg", f"BINARY_IMAGE={BINARY}", "--target", target]
    build_from(ROOT, name, "-f", "deploy/Containerfile", *arguments)


def build_from(folder: Path, name: str, *arguments: str) -> None:
    """An image; unlike the builder before BuildKit this leaves out unused stages."""
    command = ["build", *arguments, "-t", name, "."]
    said = b""
    # A newer client wants a plug-in for BuildKit; Debian's own has it inside.
    for client in ("docker", "/usr/bin/docker"):
        done = subprocess.run(
            [client, *command],
            cwd=folder,
            env={**os.environ, "DOCKER_BUILDKIT": "1"},
            capture_output=True,
            timeout=600,
        )
        if done.returncode == 0:
            return
        said += done.stderr
    pytest.fail(f"no image: {said.decode()[-3000:]}", pytrace=False)


def wait_until_containers_are_healthy(*names: str) -> None:
    """Each is asked by the engine, as its image or compose says."""
    deadline = time.monotonic() + HEALTHY_SECS
    while True:
        states = docker("inspect", "--format", "{{.State.Health.Status}}", *names).split()
        if set(states) == {"healthy"}:
            return
        if time.monotonic() > deadline:
            pytest.fail(f"containers are {states}", pytrace=False)
        time.sleep(0.1)


def wait_until_healthy(url: str) -> None:
    deadline = time.monotonic() + READY_SECS
    while True:
        try:
            if httpx.get(f"{url}/health", timeout=2.0).json()["status"] == "healthy":
                return
            said = "it is not healthy"
        except httpx.HTTPError as error:
            said = str(error)
        if time.monotonic() > deadline:
            pytest.fail(f"{url} does not answer: {said}", pytrace=False)
        time.sleep(0.05)


def drive(url: str, carla_port: int) -> None:
    """An OpenEnv episode with a picture, and a car through CARLA's client, recorded."""
    wait_until_healthy(url)
    with Session(url) as session:
        session.reset("trolley_saves", seed=1)
        assert session.capture().startswith(b"\xff\xd8"), "no JPEG"
        session.step("observe")
    client = connect(carla_port)
    with synchronous(client.get_world()) as world:
        client.start_recorder("drive.log")
        car = spawn_car(world)
        car.apply_control(carla.VehicleControl(throttle=1.0))
        for _ in range(40):
            world.tick()
        assert car.get_velocity().length() > 1.0
        car.destroy()
        client.stop_recorder()
        said = client.show_recorder_file_info("drive.log", False)
        assert "Frames: 4" in said, said
