"""The blocks of deploy/README.md that want an engine of containers, or systemd, run as printed.

Method: a copy of `deploy/` is the reader's checkout. Images are those of the program under test;
ports, the compose project and its volumes are the test's own. systemd runs in a container.
"""

import contextlib
import os
import re
import shlex
import shutil
import subprocess
import time
from pathlib import Path

import pytest
from causeway import Session

import containers
from containers import BINARY, CORE, FULL, ROOT, build_from, docker, drive, wait_until_healthy
from documents import Page
from running_site import binary, two_free_ports
from shell import Shell

PAGE = Page("deploy/README.md", (ROOT / "deploy/README.md").read_text())
SYSTEMD = "causeway-systemd:test"
SYSTEMD_SECS = 60.0
#: Blocks that no test runs, by a word in them, and why.
NOT_RUN = {
    "kubectl": "it needs a cluster; the tree is tested by test_kubernetes.py",
    "docker push": "it needs an account; the Space's folder is tested by test_deploy.py",
}
#: What each test below runs, by a word in it; together they are all blocks.
TAKEN = (
    "2000-2001:2000-2001",
    "--carla 3000",
    "--scale world=2",
    "token new",
    "CAUSEWAY_BUS_OVER",
    "--scale env=4",
    "systemctl",
)


def blocks() -> list[str]:
    """Those that are run, with lines that go on made one."""
    texts = (block.text.replace("\\\n", " ") for block in PAGE.blocks("sh"))
    return [text for text in texts if not any(word in text for word in NOT_RUN)]


def take(*words: str) -> list[str]:
    """The lines of the first block with these words."""
    found = next(text for text in blocks() if all(word in text for word in words))
    lines = (line.split("  #")[0].strip() for line in found.splitlines())
    return [line for line in lines if line]


def test_every_block_is_run_or_has_a_reason():
    for text in blocks():
        assert any(word in text for word in TAKEN), text


class Checkout:
    """A reader's checkout and shell, on ports of the test's own."""

    def __init__(self, folder: Path, project: str) -> None:
        self.project = project
        self.http, self.carla, self.second = (two_free_ports() for _ in range(3))
        shutil.copytree(ROOT / "deploy", folder / "deploy")
        self.shell = Shell(folder, {**os.environ, **self.settings()})

    def settings(self) -> dict[str, str]:
        return {
            "COMPOSE_PROJECT_NAME": self.project,
            "CAUSEWAY_IMAGE": FULL,
            "CAUSEWAY_CORE_IMAGE": CORE,
            "CAUSEWAY_HTTP_PORT": str(self.http),
            "CARLA_PORT": str(self.carla),
            "CARLA_STREAM_PORT": str(self.carla + 1),
            "CARLA_PORT_2": str(self.second),
            "CARLA_STREAM_PORT_2": str(self.second + 1),
            "CARLA_PORTS": f"{self.carla}=alice,{self.second}=bob",
        }

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.http}"

    def build(self, line: str) -> None:
        """An image, with the program under test instead of one that is built in it."""
        words = shlex.split(line)
        assert words[:2] == ["docker", "build"] and words[-1] == "."
        name = words.index("-t")
        image = {"causeway": FULL, "causeway-core": CORE}[words[name + 1]]
        rest = [*words[2:name], *words[name + 2 : -1]]
        build_from(self.shell.folder, image, *rest, "--build-arg", f"BINARY_IMAGE={BINARY}")

    def named(self, line: str) -> str:
        """A line of `docker run` with the test's own image, name, ports and volume."""
        line = re.sub(r"(?<=\s)causeway(?=\s|$)", FULL, line, count=1)
        # Clients of CARLA are told the port of streams by number.
        own = f"docker run --name {self.project} -e CARLA_PORT={self.carla}"
        pair = f"{self.carla}-{self.carla + 1}"
        line = line.replace("docker run", own).replace("8000:8000", f"{self.http}:8000")
        for usual in ("2000", "3000"):
            line = line.replace(f"{usual}-{int(usual) + 1}", pair)
        line = line.replace("--carla 3000", f"--carla {self.carla}")
        return line.replace("causeway-recordings", f"{self.project}-recordings")


@pytest.fixture
def checkout(images, tmp_path, names_of_project):
    if shutil.which("docker-compose") is None:
        pytest.skip("no docker-compose")
    found = Checkout(tmp_path, names_of_project)
    with found.shell.servers:
        yield found
    for label in ("com.docker.compose.project", "causeway.project"):
        listed = docker("ps", "--all", "--quiet", "--filter", f"label={label}={names_of_project}")
        if listed.split():
            docker("rm", "--force", "--volumes", *listed.split())
    for kind in ("network", "volume"):
        listed = docker(kind, "ls", "--quiet", "--filter", f"name={names_of_project}")
        for name in listed.split():
            subprocess.run(["docker", kind, "rm", name], capture_output=True)


def test_one_container_serves_and_its_recordings_outlive_it(checkout):
    build, run = take("2000-2001:2000-2001")
    checkout.build(build)
    checkout.shell.serve(checkout.named(run))
    drive(checkout.url, checkout.carla)
    docker("stop", "--time", "5", checkout.project)
    kept = f"{checkout.project}-recordings:/recordings"
    listed = docker("run", "--rm", "--volume", kept, FULL, "record", "list")
    assert "drive.log  log" in listed and "drive.log.journal  journal" in listed, listed


def test_one_container_serves_another_port_of_carla(checkout):
    (run,) = take("--carla 3000")
    checkout.shell.serve(checkout.named(run))
    ask = ["docker", "exec", checkout.project, "/usr/bin/causeway", "health", "--ready"]
    until(lambda: subprocess.run(ask, capture_output=True).returncode == 0)
    client = containers.connect(checkout.carla)
    assert client.get_world().get_map().name


def test_a_composed_site_is_started_shown_and_ended(checkout):
    build, up, logs, down = take("--scale world=2")
    checkout.build(build)
    checkout.shell.run(up)
    drive(checkout.url, checkout.carla)
    assert "scenario" in checkout.shell.run(logs)
    checkout.shell.run(down)
    left = docker("ps", "--all", "--filter", f"name={checkout.project}", "--quiet")
    assert not left.split()


def test_two_people_come_to_a_composed_site_with_tokens_of_their_own(checkout):
    *tokens, chmod, up = take("token new", "docker run")
    # The printed one is the last word that a new container says.
    alice, bob = (checkout.shell.run(line.replace(" causeway ", f" {FULL} ")) for line in tokens)
    checkout.shell.run(chmod)
    checkout.shell.run(up)
    wait_until_healthy(checkout.url)
    with pytest.raises(PermissionError):
        Session(checkout.url)
    for token, port in ((alice, checkout.carla), (bob, checkout.second)):
        drive(checkout.url.replace("://", f"://anybody:{token.strip()}@"), port)


def test_a_composed_site_shows_certificates_on_its_bus(checkout):
    checkout.shell.run("\n".join(take("CAUSEWAY_BUS_OVER")))
    drive(checkout.url, checkout.carla)


def test_each_researcher_has_an_openenv_server_at_one_site(checkout):
    full, core, up, port, down = take("--scale env=4")
    checkout.build(full)
    checkout.build(core)
    checkout.shell.run(up)
    url = f"http://{checkout.shell.run(port).strip()}"
    wait_until_healthy(url)
    with Session(url) as session:
        session.reset("trolley_saves", seed=1)
        assert session.capture().startswith(b"\xff\xd8"), "no JPEG"
    checkout.shell.run(down)


@contextlib.contextmanager
def machine(folder: Path, name: str, published: list[str]):
    """A Debian machine with systemd, in a container: what is typed there, as its root."""
    if Path("/sys/fs/cgroup/cgroup.controllers").exists():
        pytest.skip("no systemd in a container: it needs cgroups of version 1")
    context = folder / "machine"
    context.mkdir()
    shutil.copytree(ROOT / "deploy", context / "deploy")
    subprocess.run(["strip", "-o", context / "causeway", binary()], check=True)
    (context / "Dockerfile").write_text(
        f"FROM {containers.DEBIAN}\n"
        "RUN apt-get update && apt-get install -y --no-install-recommends "
        "systemd systemd-sysv openssl\n"
        "COPY deploy /root/checkout/deploy\n"
        "COPY causeway /root/.cache/causeway/target/release/causeway\n"
        'CMD ["/sbin/init"]\n'
    )
    build_from(context, SYSTEMD)
    docker(
        "run", "--detach", "--name", name, "--cap-add", "SYS_ADMIN",
        "--security-opt", "seccomp=unconfined", "--security-opt", "apparmor=unconfined",
        "--tmpfs", "/run", "--tmpfs", "/run/lock", "-v", "/sys/fs/cgroup:/sys/fs/cgroup:ro",
        *published, SYSTEMD,
    )  # fmt: skip

    def typed(*lines: str) -> str:
        script = "set -eu; cd ~/checkout; " + "\n".join(lines)
        return docker("exec", name, "bash", "-c", script)

    until(lambda: "running" in docker("exec", name, "sh", "-c", "systemctl is-system-running || :"))
    yield typed


@pytest.mark.usefixtures("images")
def test_the_server_of_a_lab_has_two_users_and_records(tmp_path, names_of_project):
    http, alices, bobs = (two_free_ports() for _ in range(3))
    ports = [f"127.0.0.1:{http}:8000"]
    ports += [f"127.0.0.1:{p}:{p}" for first in (alices, bobs) for p in (first, first + 1)]
    published = [word for mapping in ports for word in ("-p", mapping)]
    lines = "\n".join(take("systemctl")).replace("2000=", f"{alices}=").replace("2100=", f"{bobs}=")
    # What is published of a container comes from outside.
    outside = "--http 0.0.0.0:8000 --carla-host 0.0.0.0 --carla "
    with machine(tmp_path, names_of_project, published) as typed:
        said = typed(lines.replace("--carla ", outside))
        alice, bob = re.findall(r"^cw_\S+$", said, flags=re.MULTILINE)
        for token, port in ((alice, alices), (bob, bobs)):
            drive(f"http://anybody:{token}@127.0.0.1:{http}", port)
        kept = typed("causeway record list /var/lib/causeway/recordings")
        assert "alice/drive.log  log" in kept and "bob/drive.log.journal  journal" in kept, kept
        # Nobody is heard on the bus without a certificate.
        worlds = "timeout 10 causeway record worlds --tenant alice --connect "
        pki = "/etc/causeway/pki"
        face = f"--bus-cert {pki}/causeway-face.crt --bus-key {pki}/causeway-face.key"
        typed(f"{worlds} tls/127.0.0.1:7460 --bus-ca {pki}/ca.crt {face}")
        with pytest.raises(pytest.fail.Exception):
            typed(f"{worlds} tcp/127.0.0.1:7460")


def until(look) -> None:
    deadline = time.monotonic() + SYSTEMD_SECS
    while not look():
        assert time.monotonic() < deadline
        time.sleep(0.2)
