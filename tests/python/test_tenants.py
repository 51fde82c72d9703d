"""Two people on one server: tokens at the OpenEnv face, ports of their own for CARLA's client."""

import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import carla
import causeway
import httpx
import pytest
from openenv.core.generic_client import GenericEnvClient

from carla_site import connect, spawn_car, synchronous
from running_site import Site, binary, two_free_ports
from tenants import command, new_token
from watched import figures

# A changed file is read within two seconds; a busy machine gets much longer.
RELOAD_SECS = 60.0


@dataclass
class Shared:
    """A server that two people share."""

    site: Site
    path: Path
    alice: str
    bob: str
    ports: dict[str, int]
    admin: str

    def at(self, token: str) -> str:
        return self.site.base_url.replace("http://", f"http://anybody:{token}@")


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    from running_site import start, stop

    folder = tmp_path_factory.mktemp("tenants")
    path = folder / "tokens.toml"
    alice, bob = (new_token(path, name, f"{name}-laptop") for name in ("alice", "bob"))
    ports = {"alice": two_free_ports(), "bob": two_free_ports()}
    endpoints = ",".join(f"{port}={name}" for name, port in ports.items())
    admin = two_free_ports()
    flags = ["--tokens", str(path), f"--carla={endpoints}", "--admin", f"127.0.0.1:{admin}"]
    site = start(folder / "log", "--no-render", *flags)
    # The site itself and the world service are before it.
    yield Shared(site, path, alice, bob, ports, f"127.0.0.1:{admin + 2}")
    stop(site)


def test_clients_of_openenv_come_in_with_their_token(shared):
    """Older clients have no headers: their token is the password in the address."""
    with GenericEnvClient(base_url=shared.at(shared.alice)) as env:
        assert env.reset(seed=7).observation["scenario_name"]
    headers = {"Authorization": f"Bearer {shared.bob}"}
    with GenericEnvClient(base_url=shared.site.base_url, headers=headers) as env:
        assert env.reset(seed=7).observation["scenario_name"]


def test_the_package_takes_a_token_in_three_ways(shared, monkeypatch):
    url = shared.site.base_url
    with causeway.Session(url, token=shared.alice) as session:
        assert session.reset("trolley_saves", seed=7).observation["scenario_name"]
    with causeway.Session(shared.at(shared.bob)) as session:
        assert session.state()
    with pytest.raises(PermissionError, match="CAUSEWAY_TOKEN"):
        causeway.Session(url)
    monkeypatch.setenv("CAUSEWAY_TOKEN", shared.bob)
    with causeway.Session(url) as session:
        assert session.state()
    with pytest.raises(PermissionError) as refused:
        causeway.Session(url.replace("//", "//anybody:cw_bob-laptop_wrong@"))
    assert "wrong" not in str(refused.value)


def test_who_is_not_let_in_is_counted_by_why(shared):
    url, refused = shared.site.base_url, "causeway_scenario_entries_refused_total"
    before = figures(shared.admin)
    for headers in ({}, {}, {"Authorization": "Bearer cw_bob-laptop_wrong"}):
        assert httpx.post(f"{url}/reset", json={}, headers=headers).status_code == 401
    after = figures(shared.admin)
    for why, count in (("no_token", 2), ("wrong_token", 1), ("too_many", 0)):
        name = f"{refused}{{why={why}}}"
        assert after[name] - before[name] == count, why


def test_without_a_token_only_probes_are_answered(shared):
    url = shared.site.base_url
    assert httpx.get(f"{url}/health").status_code == 200
    assert httpx.get(f"{url}/schema").status_code == 200
    refused = httpx.post(f"{url}/reset", json={})
    assert refused.status_code == 401
    assert "Bearer cw_" in refused.json()["detail"]
    with pytest.raises(ConnectionError, match="HTTP 401"), GenericEnvClient(url) as env:
        env.reset(seed=7)
    wrong = shared.alice[:-1] + ("A" if shared.alice[-1] != "A" else "B")
    answer = httpx.post(f"{url}/reset", json={}, headers={"Authorization": f"Bearer {wrong}"})
    assert (answer.status_code, answer.json()["detail"]) == (
        401,
        "this token is not valid here, or no longer",
    )
    said = shared.site.log.read_text(errors="replace")
    assert "refused" in said
    secrets = [token[-20:] for token in (wrong, shared.alice, shared.bob)]
    assert not [secret for secret in secrets if secret in said]


def test_a_session_is_seen_by_its_tenant_alone(shared):
    def call(token: str, path: str, body: dict) -> httpx.Response:
        headers = {"Authorization": f"Bearer {token}"}
        return httpx.post(f"{shared.site.base_url}{path}", json=body, headers=headers, timeout=60)

    create = {"jsonrpc": "2.0", "id": 1, "method": "openenv/session/create"}
    session = call(shared.alice, "/mcp", create).json()["result"]["session_id"]
    reset = {"session_id": session, "seed": 7}
    assert call(shared.alice, "/reset", reset).status_code == 200
    assert call(shared.bob, "/reset", reset).status_code == 404
    assert call(shared.bob, "/step", {"session_id": session, "action": {}}).status_code == 404
    assert call(shared.alice, "/step", {"session_id": session, "action": {}}).status_code == 200


def test_carla_ports_belong_to_tenants(shared):
    """Cars, recordings and maps of one are not those of the other."""
    worlds = {name: connect(port).get_world() for name, port in shared.ports.items()}
    with synchronous(worlds["alice"]) as own:
        car = spawn_car(own)
        own.tick()
        assert own.get_actors().find(car.id)
        assert not list(worlds["bob"].get_actors().filter("vehicle.*"))
        client = connect(shared.ports["alice"])
        client.start_recorder("drive.log")
        own.tick()
        client.stop_recorder()
        said = connect(shared.ports["bob"]).show_recorder_file_info("drive.log", False)
        assert "not found" in said.lower(), said
        assert "Town" in client.show_recorder_file_info("drive.log", False)
        (path,) = shared.path.parent.rglob("drive.log")
        with pytest.raises(RuntimeError, match=r"wanted a recording in .*bob"):
            connect(shared.ports["bob"]).show_recorder_file_info(str(path), False)
        car.destroy()


def test_whoever_is_taken_off_the_file_does_not_come_in_again(shared):
    before = shared.path.read_text()
    carol = new_token(shared.path, "carol", "carol")

    def status() -> int:
        headers = {"Authorization": f"Bearer {carol}"}
        return httpx.get(f"{shared.site.base_url}/metrics", headers=headers).status_code

    wait_until(lambda: status() == 200)
    shared.path.write_text(before)
    wait_until(lambda: status() == 401)


def test_networks_that_are_not_named_do_not_reach_an_endpoint(start_site):
    port = two_free_ports()
    site = start_site("--no-render", f"--carla={port}", f"--allow={port}=10.77.0.0/24")
    client = carla.Client("127.0.0.1", site.carla_port)
    client.set_timeout(2.0)
    with pytest.raises(RuntimeError):
        client.get_server_version()
    wait_until(lambda: "not in --allow" in site.said())


def test_nobody_serves_the_whole_network_by_accident(tmp_path):
    port = two_free_ports()
    whole = [binary(), "up", "--http", f"0.0.0.0:{port}", "--no-carla"]
    done = subprocess.run(whole, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "--tokens" in done.stderr and "--open" in done.stderr
    missing = [binary(), "up", "--tokens", str(tmp_path / "none.toml"), "--no-carla"]
    done = subprocess.run(missing, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "none.toml" in done.stderr


def test_a_token_that_cannot_be_is_refused_before_anything_is_written(tmp_path):
    path = tmp_path / "tokens.toml"
    new_token(path, "alice", "alice")
    before = path.read_text()
    again = ["token", "new", "--tenant", "alice", "--id", "alice", "--add", str(path)]
    done = subprocess.run([binary(), *again], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert "its id is there twice" in done.stderr
    assert path.read_text() == before
    assert path.stat().st_mode & 0o777 == 0o600
    assert command("token", "check", str(path)) == "1 tenants, 1 tokens\n"


def wait_until(condition) -> None:
    deadline = time.monotonic() + RELOAD_SECS
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.1)
