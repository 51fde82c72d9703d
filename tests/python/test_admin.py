"""Whoever watches over a service learns whether it is started, lives and is ready, and its figures.

Method: start services as processes of their own, in an order in which something is missing first,
and ask them as probes and Prometheus do.
"""

import functools
import json
import re
import shutil
import socket
import subprocess

import causeway
import httpx
import pytest
import yaml

from documents import ROOT
from running_site import binary, child, start, stop
from watched import SOON_SECS, ask, bus, eventually, figures, services, told


def health(*arguments: str) -> subprocess.CompletedProcess:
    command = [binary(), "health", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=SOON_SECS)


def test_a_face_is_ready_while_there_is_a_world_service(tmp_path):
    with bus(tmp_path) as begin:
        face = begin("scenario", "--http", "127.0.0.1:0")
        face.until("/startupz", 200)
        refused = face.until("/readyz", 503).json()
        assert refused["status"] == "not ready" and refused["service"] == "scenario"
        assert refused["reason"].startswith("worlds: no world service is up")
        assert told(face.admin, "/livez") == 200
        assert health("--ready", face.admin).returncode == 1
        world = begin("world")
        assert world.until("/readyz", 200).json()["status"] == "ready"
        face.until("/readyz", 200)
        asked = health("--ready", face.admin, world.admin)
        assert asked.returncode == 0, asked.stdout + asked.stderr
        assert asked.stdout.count('"status":"ready"') == 2
        world.process.kill()
        face.until("/readyz", 503)
        begin("world")
        face.until("/readyz", 200)


def test_who_waits_for_a_bus_lives_and_has_not_started(tmp_path):
    with socket.socket() as nobody:
        # Bound, so that nobody else takes it, and not listening.
        nobody.bind(("127.0.0.1", 0))
        address = f"tcp/127.0.0.1:{nobody.getsockname()[1]}"
        with services(tmp_path) as begin:
            face = begin("scenario", "--http", "127.0.0.1:0", "--connect", address)
            assert told(face.admin, "/livez") == 200
            assert told(face.admin, "/startupz") == 503
            assert told(face.admin, "/readyz") == 503
            assert health(face.admin).returncode == 0
            assert health("--started", face.admin).returncode == 1
            # Its port opens before it looks for the bus, and its signals are followed before.
            face.find("(OpenEnv face) listens")
            face.terminate()
            assert face.ended() == 0


def test_nobody_there_is_not_healthy_and_wrong_use_is_exit_code_2():
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        asked = health(f"127.0.0.1:{nobody.getsockname()[1]}")
    assert asked.returncode == 1 and "no answer" in asked.stdout
    assert health("nowhere").returncode == 2
    taken = subprocess.run(
        [binary(), "world", "--admin", "192.0.2.1:1"],
        capture_output=True,
        text=True,
        timeout=SOON_SECS,
    )
    assert taken.returncode == 2 and "--admin" in taken.stderr


@pytest.fixture(scope="module")
def watched_site(tmp_path_factory):
    """A site with a renderer, and where its parts are asked, by name."""
    site = start(tmp_path_factory.mktemp("watched") / "log", "--admin", "127.0.0.1:0")
    found = re.findall(r"http://(127\.0\.0\.1:\d+) · (\S+)$", site.said(), flags=re.MULTILINE)
    parts = {name: address for address, name in found}
    parts["up"] = re.search(r"probes +http://(\S+)", site.said())[1]
    try:
        eventually(
            "ready site", lambda: {told(part, "/readyz") for part in parts.values()} == {200}
        )
        yield site, parts
    finally:
        stop(site)


def good(admin: str, path: str) -> httpx.Response | None:
    reply = ask(admin, path)
    return reply if reply.status_code == 200 else None


def test_every_part_of_a_site_answers(watched_site):
    _, parts = watched_site
    assert set(parts) == {"up", "world", "scenario", "gateway", "render-0"}
    for part in parts.values():
        for path in ("/livez", "/readyz", "/startupz"):
            # On a busy machine the site may not hear of one of its services for a moment.
            reply = eventually(f"{part}{path}", functools.partial(good, part, path))
            assert reply.headers["content-type"] == "application/json"


def test_what_cannot_be_asked_is_refused(watched_site):
    _, parts = watched_site
    unknown = ask(parts["world"], "/health")
    assert unknown.status_code == 404 and "/readyz" in unknown.json()["wanted"]
    wrong = ask(parts["world"], "/drain")
    assert wrong.status_code == 405 and wrong.headers["allow"] == "POST"
    page = httpx.post(
        f"http://{parts['world']}/drain", headers={"Origin": "http://example.com"}, trust_env=False
    )
    assert page.status_code == 403
    assert told(parts["world"], "/readyz") == 200


def test_figures_count_what_happens(watched_site):
    site, parts = watched_site
    before = figures(parts["world"]), figures(parts["scenario"]), figures(parts["render-0"])
    with causeway.Session(site.base_url) as session:
        session.reset("trolley_saves", seed=1)
        for _ in range(10):
            session.step()
        assert session.capture()
        assert figures(parts["scenario"])["causeway_scenario_sessions"] >= 1
        assert figures(parts["world"])["causeway_world_worlds"] >= 1
    after = figures(parts["world"]), figures(parts["scenario"]), figures(parts["render-0"])
    world, scenario, render = (
        {name: new[name] - old.get(name, 0.0) for name in new}
        for old, new in zip(before, after, strict=True)
    )
    assert world["causeway_world_created_total"] >= 1
    assert world["causeway_world_tick_seconds_count"] >= 10
    assert world["causeway_world_tick_seconds_sum"] > 0
    assert scenario["causeway_scenario_sessions_asked_total{outcome=opened}"] == 1
    assert scenario["causeway_scenario_reset_seconds_count"] == 1
    assert scenario["causeway_scenario_step_seconds_count"] == 10
    assert scenario["causeway_scenario_picture_seconds_count"] == 1
    assert render["causeway_render_jobs_total{outcome=drawn}"] >= 1
    assert render["causeway_render_pictures_total"] >= 1
    for found in after:
        assert found["process_resident_memory_bytes"] > 1e6
        assert found["causeway_ready"] == 1


def exported(parts) -> set[str]:
    """Names of all figures of a site, without labels."""
    return {name.split("{")[0] for part in parts.values() for name in figures(part)}


def test_the_page_names_every_figure(watched_site):
    _, parts = watched_site
    page = (ROOT / "docs/operations.md").read_text()
    named = set(re.findall(r"`((?:causeway|process)_\w+)`", page))
    histograms = r"_(bucket|sum|count)$"
    found = {re.sub(histograms, "", name) for name in exported(parts)}
    assert named == found


def test_rules_and_dashboard_name_figures_that_there_are(watched_site):
    _, parts = watched_site
    rules = yaml.safe_load((ROOT / "deploy/prometheus/rules.yaml").read_text())
    dashboard = json.loads((ROOT / "deploy/grafana/causeway.json").read_text())
    asked = [rule["expr"] for group in rules["groups"] for rule in group["rules"]]
    asked += [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    names = {name for expr in asked for name in re.findall(r"\b(?:causeway|process)_\w+", expr)}
    assert len(names) > 10
    assert names <= exported(parts)


def test_prometheus_reads_the_rules():
    promtool = shutil.which("promtool")
    if promtool is None:
        pytest.skip("no promtool")
    command = [promtool, "check", "rules", ROOT / "deploy/prometheus/rules.yaml"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_site_is_ready_without_a_renderer_and_counts_its_restart(watched_site):
    site, parts = watched_site
    restarts = figures(parts["up"])["causeway_up_restarts_total"]
    renderer = child(site, "render")
    subprocess.run(["kill", "-9", str(renderer)], check=True)
    eventually(
        "restart in the figures",
        lambda: figures(parts["up"])["causeway_up_restarts_total"] > restarts,
    )
    eventually("site that is ready", lambda: told(parts["up"], "/readyz") == 200)
    eventually("renderer that is ready again", lambda: told(parts["render-0"], "/readyz") == 200)
