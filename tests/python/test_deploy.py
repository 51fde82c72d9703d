"""Goal: what deploy/ says works where there is a container engine; images hold what they must.

Method: build the images from deploy/Containerfile with the program under test, look inside, and
drive what runs from them as users would.
"""

import base64
import contextlib
import importlib
import io
import os
import shutil
import subprocess
import tarfile
import time
from pathlib import Path

import httpx
import pytest
import yaml
from causeway import Session
from openenv.cli.commands import push

from containers import (
    CORE,
    FULL,
    ROOT,
    build_from,
    docker,
    drive,
    wait_until_containers_are_healthy,
    wait_until_healthy,
)
from running_site import two_free_ports
from tenants import new_token

FULL_BYTES_MAX, CORE_BYTES_MAX = 65_000_000, 60_000_000
#: A world service with a certificate is heard within a second.
STRANGER_SECS = 5.0


@pytest.mark.usefixtures("images")
@pytest.mark.parametrize(("image", "bytes_max"), [(FULL, FULL_BYTES_MAX), (CORE, CORE_BYTES_MAX)])
def test_an_image_holds_the_program_and_what_it_links_to(image, bytes_max, names_of_project):
    size = int(docker("image", "inspect", "--format", "{{.Size}}", image))
    assert size < bytes_max, f"{image} has {size / 1e6:.0f} MB"
    user = docker("image", "inspect", "--format", "{{.Config.User}}", image)
    assert user.strip() == "10001:10001"
    docker("create", "--name", names_of_project, image)
    packed = subprocess.run(["docker", "export", names_of_project], capture_output=True, check=True)
    files = tarfile.open(fileobj=io.BytesIO(packed.stdout)).getmembers()
    programs = {Path(file.name).name for file in files if "bin/" in file.name and file.isfile()}
    assert programs == {"causeway"}
    assert not [file.name for file in files if file.isfile() and file.mode & 0o6000]


@pytest.mark.usefixtures("images")
def test_one_container_serves_openenv_and_carlas_client(names_of_project):
    http, port = two_free_ports(), two_free_ports()
    ports = [f"127.0.0.1:{http}:8000"] + [f"127.0.0.1:{p}:{p}" for p in (port, port + 1)]
    published = [word for mapping in ports for word in ("-p", mapping)]
    flags = ["--http", "0.0.0.0:8000", "--open", "--carla", str(port), "--carla-host", "0.0.0.0"]
    docker(
        "run", "--detach", "--read-only", "--tmpfs", "/tmp", "--cap-drop", "ALL",
        "--volume", "/recordings", "--name", names_of_project, *published, FULL, "up", *flags,
    )  # fmt: skip
    drive(f"http://127.0.0.1:{http}", port)
    wait_until_containers_are_healthy(names_of_project)
    docker("stop", "--time", "5", names_of_project)
    state = docker("inspect", "--format", "{{.State.ExitCode}}", names_of_project)
    assert state.strip() == "0", docker("logs", names_of_project)


@pytest.mark.usefixtures("images")
def test_a_container_for_each_service_is_a_site(names_of_project):
    http, port = two_free_ports(), two_free_ports()
    settings = {
        "CAUSEWAY_IMAGE": FULL,
        "CAUSEWAY_HTTP_PORT": str(http),
        "CARLA_PORT": str(port),
        "CARLA_STREAM_PORT": str(port + 1),
    }
    with composed(names_of_project, ["deploy/compose.yaml"], settings) as run:
        run("up", "--detach", "--scale", "world=2")
        drive(f"http://127.0.0.1:{http}", port)
        running = run("ps", "--quiet").split()
        wait_until_containers_are_healthy(*running)
        states = docker("inspect", "--format", "{{.RestartCount}}", *running).split()
        assert states == ["0"] * 6, run("logs")
        volume = f"{names_of_project}_recordings:/recordings"
        kept = docker("run", "--rm", "--volume", volume, CORE, "record", "list")
        assert "drive.log  log" in kept and "drive.log.journal  journal" in kept, kept


@pytest.mark.usefixtures("images")
def test_two_people_share_a_composed_site(names_of_project, tmp_path):
    tokens = tmp_path / "tokens.toml"
    alice, bob = (new_token(tokens, name, f"{name}-laptop") for name in ("alice", "bob"))
    tokens.chmod(0o644)
    http, port, second = two_free_ports(), two_free_ports(), two_free_ports()
    settings = {
        "CAUSEWAY_IMAGE": FULL,
        "CAUSEWAY_HTTP_PORT": str(http),
        "CAUSEWAY_TOKENS_FILE": str(tokens),
        "CARLA_PORTS": f"{port}=alice,{second}=bob",
        "CARLA_PORT": str(port),
        "CARLA_STREAM_PORT": str(port + 1),
        "CARLA_PORT_2": str(second),
        "CARLA_STREAM_PORT_2": str(second + 1),
    }
    files = ["deploy/compose.yaml", "deploy/compose.secure.yaml"]
    with composed(names_of_project, files, settings) as run:
        run("up", "--detach")
        wait_until_healthy(f"http://127.0.0.1:{http}")
        with pytest.raises(PermissionError):
            Session(f"http://127.0.0.1:{http}")
        for token, own in ((alice, port), (bob, second)):
            drive(f"http://anybody:{token}@127.0.0.1:{http}", own)


@pytest.mark.usefixtures("images")
def test_services_of_a_composed_site_show_certificates(names_of_project, tmp_path):
    tokens, pki = tmp_path / "tokens.toml", tmp_path / "pki"
    alice = new_token(tokens, "alice", "alice-laptop")
    tokens.chmod(0o644)
    roles = ["causeway-router=router", "causeway-world", "causeway-render", "causeway-face"]
    script = ROOT / "deploy" / "bus" / "certificates.sh"
    subprocess.run(["sh", script, pki, *roles], check=True, capture_output=True)
    pki.chmod(0o700)
    for key in pki.glob("causeway-*.key"):
        key.chmod(0o644)
    http, port = two_free_ports(), two_free_ports()
    settings = {
        "CAUSEWAY_IMAGE": FULL,
        "CAUSEWAY_HTTP_PORT": str(http),
        "CAUSEWAY_TOKENS_FILE": str(tokens),
        "CARLA_PORTS": f"{port}=alice",
        "CARLA_PORT": str(port),
        "CARLA_STREAM_PORT": str(port + 1),
        "CARLA_PORT_2": str(two_free_ports()),
        "CARLA_STREAM_PORT_2": str(two_free_ports()),
        "CAUSEWAY_PKI": str(pki),
        "CAUSEWAY_BUS_OVER": "tls",
    }
    files = [f"deploy/compose{kind}.yaml" for kind in ("", ".secure", ".tls")]
    with composed(names_of_project, files, settings) as run:
        run("up", "--detach")
        drive(f"http://anybody:{alice}@127.0.0.1:{http}", port)
        wait_until_containers_are_healthy(*run("ps", "--quiet").split())
        # Whoever is on the same network and shows nothing is heard by nobody.
        docker(
            "run", "--detach", "--name", names_of_project, "--network", f"{names_of_project}_bus",
            FULL, "world", "--connect", "tls/router:7460", "--id", "stranger",
        )  # fmt: skip
        time.sleep(STRANGER_SECS)
        docker("rm", "--force", names_of_project)
        said = run("logs", "scenario")
        assert "world service up" in said and "stranger" not in said, said


def test_composed_services_do_not_meet_in_the_open_by_accident():
    compose = shutil.which("docker-compose")
    if compose is None:
        pytest.skip("no docker-compose")
    files = [word for kind in ("", ".tls") for word in ("-f", f"deploy/compose{kind}.yaml")]
    for over, status in (("", 1), ("tls", 0)):
        done = subprocess.run(
            [compose, *files, "config", "--quiet"],
            cwd=ROOT,
            env={**os.environ, "CAUSEWAY_BUS_OVER": over},
            capture_output=True,
            text=True,
        )
        assert done.returncode == status, done.stderr
        assert ("set it to tls" in done.stderr) == (status != 0)


@pytest.mark.usefixtures("images")
def test_four_openenv_servers_share_one_site_that_carla_host_names(names_of_project):
    settings = {"CAUSEWAY_IMAGE": FULL, "CAUSEWAY_CORE_IMAGE": CORE}
    with composed(names_of_project, ["deploy/compose.split.yaml"], settings) as run:
        run("up", "--detach", "--scale", "env=4")
        places = [run("port", "--index", str(n), "env", "8000").strip() for n in range(1, 5)]
        assert len(set(places)) == 4
        with contextlib.ExitStack() as stack:
            sessions = []
            for place in places:
                wait_until_healthy(f"http://{place}")
                sessions.append(stack.enter_context(Session(f"http://{place}")))
            speeds = []
            for session in sessions:
                session.reset("trolley_saves", seed=1)
            for count, session in enumerate(sessions):
                for action in ["observe"] * (3 - count) + ["emergency_stop"] * count:
                    seen = session.step(action)
                speeds.append(seen.observation["speed_kmh"])
                assert session.capture().startswith(b"\xff\xd8"), "no JPEG"
        # Each braked for one step more than the one before it, in a world of its own.
        assert speeds == sorted(speeds, reverse=True)
        assert len(set(speeds)) == 4


def test_composed_renderers_ask_for_a_gpu_and_draw_with_nothing_else():
    compose = shutil.which("docker-compose")
    if compose is None:
        pytest.skip("no docker-compose")
    files = [word for kind in ("", ".gpu") for word in ("-f", f"deploy/compose{kind}.yaml")]
    done = subprocess.run([compose, *files, "config"], cwd=ROOT, capture_output=True, check=True)
    render = yaml.safe_load(done.stdout)["services"]["render"]
    (device,) = render["deploy"]["resources"]["reservations"]["devices"]
    assert (device["driver"], device["capabilities"]) == ("nvidia", ["gpu"])
    assert render["command"][-2:] == ["--adapter", "nvidia"]


@contextlib.contextmanager
def composed(project: str, files: list[str], settings: dict[str, str]):
    """Runs words of docker-compose; takes everything down at the end."""
    compose = shutil.which("docker-compose")
    if compose is None:
        pytest.skip("no docker-compose")
    named = [word for file in files for word in ("-f", file)]

    def run(*words: str) -> str:
        done = subprocess.run(
            [compose, *named, "-p", project, *words],
            cwd=ROOT,
            env={**os.environ, **settings},
            capture_output=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr.decode()
        return done.stdout.decode()

    try:
        yield run
    finally:
        run("down", "--volumes", "--timeout", "5")


@pytest.mark.usefixtures("images")
def test_a_space_serves_its_own_client(tmp_path, names_of_project, monkeypatch):
    folder, space = ROOT / "deploy" / "space", tmp_path / "space"
    name, manifest = push._validate_openenv_directory(folder)
    assert (name, manifest["port"]) == ("carla_env", 8000)
    push._prepare_staging_directory(folder, name, space, [], base_image=FULL)
    assert "base_path: /web" in (space / "README.md").read_text()
    build_from(space, f"{FULL}-space")
    port = two_free_ports()
    # As whom and with what files Hugging Face runs it.
    docker(
        "run", "--detach", "--user", "1000:1000", "--name", names_of_project,
        "-p", f"127.0.0.1:{port}:8000", f"{FULL}-space",
    )  # fmt: skip
    url = f"http://127.0.0.1:{port}"
    wait_until_healthy(url)
    assert httpx.get(f"{url}/web", follow_redirects=True).status_code == 200
    monkeypatch.syspath_prepend(space)
    client = importlib.import_module("client")
    with client.CarlaEnv(base_url=url).sync() as env:
        env.reset(scenario_name="trolley_saves", seed=7)
        seen = env.step(client.CarlaAction(action_type="capture_image")).observation
        assert base64.b64decode(seen.camera_image).startswith(b"\xff\xd8"), "no JPEG"
        slower = env.step(client.CarlaAction(action_type="emergency_stop")).observation
        assert slower.speed_kmh < seen.speed_kmh
        assert env.state().step_count == 2


def test_the_unit_for_systemd_is_one(tmp_path):
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        pytest.skip("no systemd")
    unit = (ROOT / "deploy" / "systemd" / "causeway.service").read_text()
    # The program is where the unit says once it is installed.
    there = tmp_path / "causeway.service"
    there.write_text(unit.replace("/usr/local/bin/causeway", "/bin/true"))
    done = subprocess.run([analyze, "verify", there], capture_output=True)
    said = [line for line in done.stderr.decode().splitlines() if "causeway.service" in line]
    assert not said
