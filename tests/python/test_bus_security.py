"""Goal: on a bus with TLS nobody comes in without a certificate, and each does what its role needs
and nothing else.

Method: a site of single services on a router with TLS, driven by OpenEnv's protocol and CARLA's
client; then strangers and tenants at the router, with Zenoh's own client.
"""

import contextlib
import json
import subprocess
import time
from pathlib import Path

import pytest
import zenoh
from causeway import Session, bus

from carla_site import connect, spawn_car, synchronous
from containers import ROOT, wait_until_healthy
from running_site import binary, two_free_ports

ROLES = ["causeway-router=127.0.0.1", "causeway-world", "causeway-render", "causeway-face"]
READY_SECS = 60.0
#: Within which a neighbour on the same machine answers.
SOON_SECS = 2.0


def certificates(folder: Path, *wanted: str) -> Path:
    script = ROOT / "deploy" / "bus" / "certificates.sh"
    subprocess.run(["sh", script, folder, *wanted], check=True, capture_output=True)
    return folder


class SecuredSite:
    """Services of one site, each a process with a certificate of its role."""

    def __init__(self, folder: Path, pki: Path):
        self.folder, self.pki = folder, pki
        port, self.http, self.carla_port = two_free_ports(), two_free_ports(), two_free_ports()
        self.address = f"tls/127.0.0.1:{port}"
        self.processes: list[subprocess.Popen] = []
        watchers = ["--watcher", "alice", "--watcher", "bob"]
        self.run("router", "causeway-router", "--listen", self.address, *watchers)
        to_bus = ["--connect", self.address]
        self.run("world", "causeway-world", *to_bus)
        self.run("render", "causeway-render", *to_bus)
        http = ["--http", f"127.0.0.1:{self.http}", "--tenant", "alice"]
        self.run("scenario", "causeway-face", *to_bus, *http)
        carla = ["--port", f"{self.carla_port}=bob", "--recordings", folder / "recordings"]
        self.run("gateway", "causeway-face", *to_bus, *carla)

    def identity(self, role: str) -> list:
        files = {"ca": "ca.crt", "cert": f"{role}.crt", "key": f"{role}.key"}
        return [word for name, file in files.items() for word in (f"--bus-{name}", self.pki / file)]

    def run(self, service: str, role: str, *flags) -> subprocess.Popen:
        log = (self.folder / f"{service}.log").open("wb")
        command = [binary(), service, *self.identity(role), *flags]
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        self.processes.append(process)
        return process

    def end(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def secured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("secured")
    pki = certificates(folder / "pki", *ROLES, "tenant-alice", "tenant-bob")
    site = SecuredSite(folder, pki)
    try:
        wait_until_healthy(f"http://127.0.0.1:{site.http}")
        yield site
    finally:
        site.end()


@contextlib.contextmanager
def stranger(site: SecuredSite, pki: Path | None, role: str | None):
    """A place on the bus for Zenoh's own client, with a certificate or without."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([site.address]))
    config.insert_json5("connect/timeout_ms", "2000")
    config.insert_json5("scouting/multicast/enabled", "false")
    tls = "transport/link/tls"
    config.insert_json5(f"{tls}/root_ca_certificate", json.dumps(str(site.pki / "ca.crt")))
    if role is not None:
        files = {"connect_certificate": f"{role}.crt", "connect_private_key": f"{role}.key"}
        for name, file in files.items():
            config.insert_json5(f"{tls}/{name}", json.dumps(str((pki or site.pki) / file)))
        config.insert_json5(f"{tls}/enable_mtls", "true")
    with zenoh.open(config) as session:
        yield session


def frames(session: zenoh.Session, tenant: str) -> list[str]:
    """Keys of frames of a tenant that are seen while its worlds are ticked by `drive_both`."""
    seen: list[str] = []
    session.declare_subscriber(
        f"causeway/{tenant}/world/*/frame", lambda sample: seen.append(str(sample.key_expr))
    )
    return seen


def answers(session: zenoh.Session, key: str) -> int:
    """How many services answer a question with nothing in it; a refusal is an answer."""
    return len(list(session.get(key, timeout=SOON_SECS, target=zenoh.QueryTarget.ALL)))


def drive_both(site: SecuredSite) -> None:
    """Alice's session with a picture, and bob's car through CARLA's client."""
    with Session(f"http://127.0.0.1:{site.http}") as session:
        session.reset("trolley_saves", seed=1)
        assert session.capture().startswith(b"\xff\xd8"), "no JPEG"
        for _ in range(5):
            session.step("observe")
    with synchronous(connect(site.carla_port).get_world()) as world:
        car = spawn_car(world)
        for _ in range(5):
            world.tick()
        car.destroy()


def test_a_site_works_with_certificates_alone(secured):
    drive_both(secured)


@pytest.mark.parametrize("whose", ["nobody's", "another authority's"])
def test_who_has_no_certificate_of_this_bus_does_not_come_in(secured, tmp_path, whose):
    others = certificates(tmp_path, "causeway-face") if whose != "nobody's" else None
    with (
        pytest.raises(zenoh.ZError),
        stranger(secured, others, "causeway-face" if others else None),
    ):
        pass


def test_a_tenant_sees_its_own_frames_and_no_others(secured):
    files = (secured.pki / file for file in ("ca.crt", "tenant-alice.crt", "tenant-alice.key"))
    with (
        stranger(secured, None, "tenant-alice") as alice,
        bus.subscribe(secured.address, tenant="alice", identity=bus.Identity(*files)) as own,
    ):
        foreign, everybody = (frames(alice, tenant) for tenant in ("bob", "*"))
        drive_both(secured)
        assert own.receive(timeout_secs=READY_SECS).map_name
        assert not foreign
        assert not everybody, "a wildcard is denied as a whole"


def test_a_tenant_asks_for_its_own_worlds_and_no_others(secured):
    with stranger(secured, None, "tenant-alice") as alice:
        assert answers(alice, "causeway/alice/worlds") == 1
        for key in (
            "causeway/bob/worlds",
            "causeway/*/worlds",
            "causeway/batch/*/tick",
            "causeway/render/*/job",
            "causeway/alive/*/*",
        ):
            assert answers(alice, key) == 0, key
        assert not list(alice.liveliness().get("causeway/alive/*/*", timeout=SOON_SECS))
    with stranger(secured, None, "causeway-face") as face:
        assert answers(face, "causeway/bob/worlds") == 1
        up = list(face.liveliness().get("causeway/alive/*/*", timeout=SOON_SECS))
        assert len(up) >= 4


def test_nobody_poses_as_somebody_else(secured):
    """Neither as a service that is up, nor as a world that has a frame, nor as who answers."""
    up, shown = [], []
    with (
        stranger(secured, None, "causeway-face") as observer,
        stranger(secured, None, "tenant-bob") as bob,
        stranger(secured, None, "causeway-world") as world,
        stranger(secured, None, "causeway-face") as face,
        stranger(secured, None, "tenant-alice") as alice,
    ):
        observer.liveliness().declare_subscriber(
            "causeway/alive/*/*", lambda sample: up.append(str(sample.key_expr)), history=True
        )
        bob.declare_subscriber(
            "causeway/bob/world/*/frame", lambda sample: shown.append(str(sample.key_expr))
        )
        for forger in (alice, face):
            forger.put("causeway/bob/world/1/frame", b"forged")
            forger.declare_queryable("causeway/*/worlds", lambda query: query.reply_err(b"forged"))
        tokens = [
            who.liveliness().declare_token(f"causeway/alive/{kind}/forged")
            for who in (alice, face, world)
            for kind in ("world", "render")
        ]
        drive_both(secured)
        # What a world service says is seen, so what the others said would be, too.
        deadline = time.monotonic() + READY_SECS
        while "causeway/alive/world/forged" not in up and time.monotonic() < deadline:
            time.sleep(0.05)
        assert answers(observer, "causeway/alice/worlds") == 1
        for token in tokens:
            token.undeclare()
    assert {key for key in up if key.endswith("forged")} == {"causeway/alive/world/forged"}
    assert shown
    assert "causeway/bob/world/1/frame" not in shown


def test_what_is_missing_is_named(secured):
    for flags, wanted in (
        ([], "--bus-ca"),
        (["--bus-ca", secured.pki / "ca.crt"], "--bus-cert"),
        (secured.identity("causeway-nobody"), "causeway-nobody.crt"),
    ):
        command = [binary(), "world", "--connect", secured.address, *flags]
        done = subprocess.run(command, capture_output=True, timeout=30)
        assert done.returncode != 0
        assert wanted in done.stderr.decode()
