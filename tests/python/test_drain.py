"""A service that drains takes nothing new and lets what goes on come to its end.

Method: services as processes of their own on one bus; clients that are at work while a service is
told to drain, by a request or by SIGTERM, and clients that come then.
"""

import contextlib
import signal
import subprocess

import causeway
import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from carla_site import connect as connect_carla
from running_site import binary, two_free_ports
from watched import SOON_SECS, Service, ask, bus, eventually, figures

LONG = ("--drain-secs", "600")


def address_of(face: Service) -> str:
    return "http://" + face.find(r"OpenEnv face listens address=(\S+)")


def drain(service: Service, *flags: str) -> None:
    command = [binary(), "drain", *flags, service.admin]
    subprocess.run(command, check=True, capture_output=True, timeout=SOON_SECS)


def is_refused(url: str) -> bool:
    """Whether a new session is, with a word where to go."""
    reply = httpx.post(f"{url}/reset", json={}, timeout=60.0, trust_env=False)
    assert reply.status_code in (200, 503)
    if reply.status_code == 503:
        assert "Connect again" in reply.json()["detail"]
        assert reply.headers["Retry-After"] == "1"
    return reply.status_code == 503


def test_new_worlds_go_to_the_host_that_does_not_drain(tmp_path):
    with bus(tmp_path) as start:
        first, second = (start("world", "--id", f"world-{name}", *LONG) for name in "ab")
        for host in (first, second):
            host.until("/readyz", 200)
        face = start("scenario", "--http", "127.0.0.1:0")
        url = address_of(face)
        face.until("/readyz", 200)
        with causeway.Session(url) as staying, causeway.Session(url) as coming:
            staying.reset("trolley_saves", seed=1)
            hosts = {figures(host.admin)["causeway_world_worlds"]: host for host in (first, second)}
            # The face keeps to one of them.
            old, new = hosts[1], hosts[0]
            drain(old)
            assert "drain" in old.until("/readyz", 503).json()["reason"]

            def placed_elsewhere() -> bool:
                # The face hears a moment later that the first one drains, which refuses until then.
                with contextlib.suppress(causeway.SessionError):
                    coming.reset("trolley_saves", seed=2)
                return figures(new.admin)["causeway_world_worlds"] > 0

            eventually("world on the other host", placed_elsewhere)
            # Both go on, in one round trip or two.
            for _ in range(20):
                staying.step()
                coming.step()
            # What it had goes to the other one, and it need not wait for the end of the episode.
            eventually("move", lambda: figures(old.admin)["causeway_world_worlds"] == 0)
            old.terminate()
            assert old.ended() == 0
            assert "lost=0" in old.said()
            assert staying.step().observation["step_number"] == 21
            assert figures(new.admin)["causeway_world_worlds"] >= 2


def test_a_host_alone_refuses_new_worlds_until_it_is_told_otherwise(tmp_path):
    with bus(tmp_path) as start:
        host = start("world")
        face = start("scenario", "--http", "127.0.0.1:0")
        url = address_of(face)
        face.until("/readyz", 200)
        with causeway.Session(url) as session:
            session.reset("trolley_saves", seed=1)
            drain(host)
            face.until("/readyz", 503)
            with pytest.raises(causeway.SessionError, match="another world service"):
                session.reset("trolley_saves", seed=2)
            # What is refused changes nothing.
            session.step()
            drain(host, "--undo")
            face.until("/readyz", 200)
            session.reset("trolley_saves", seed=2)
        refused = "causeway_world_requests_total{outcome=draining}"
        assert figures(host.admin)[refused] >= 1


def test_a_face_lets_episodes_end_and_sends_others_away(tmp_path):
    with bus(tmp_path) as start:
        start("world")
        face = start("scenario", "--http", "127.0.0.1:0", *LONG)
        url = address_of(face)
        face.until("/readyz", 200)
        websocket = url.replace("http", "ws") + "/ws"
        with causeway.Session(url) as session, connect(websocket, proxy=None) as idle:
            session.reset("trolley_saves", seed=1)
            face.terminate()
            face.until("/readyz", 503)
            eventually("refusal", lambda: is_refused(url))
            with pytest.raises(InvalidStatus) as refusal:
                connect(websocket, proxy=None)
            assert refusal.value.response.status_code == 503
            with pytest.raises(ConnectionClosed) as closed:
                idle.recv(timeout=SOON_SECS)
            assert closed.value.rcvd.code == 1012
            for _ in range(5):
                session.step()
            # In the first half of its time it begins episodes for those who cannot come again.
            session.reset("trolley_saves", seed=2)
            session.step()
            assert ask(face.admin, "/undrain", "POST").status_code == 409
        assert face.ended() == 0
        assert "lost=0" in face.said()


def test_the_end_of_its_time_and_a_second_signal_end_a_face(tmp_path):
    with bus(tmp_path) as start:
        start("world")
        for flags, signals in ((("--drain-secs", "1"), 1), (LONG, 2)):
            face = start("scenario", "--http", "127.0.0.1:0", *flags)
            url = address_of(face)
            face.until("/readyz", 200)
            with contextlib.ExitStack() as stack:
                session = stack.enter_context(causeway.Session(url))
                session.reset("trolley_saves", seed=1)
                face.terminate()
                if signals == 2:
                    face.until("/readyz", 503)
                    face.process.send_signal(signal.SIGTERM)
                assert face.ended() == 0
                # The connection is gone with it.
                stack.pop_all()
            assert "lost=1" in face.said()


def test_a_gateway_keeps_its_clients_and_tells_new_ones_where_to_go(tmp_path):
    with bus(tmp_path) as start:
        start("world")
        port, other = two_free_ports(), two_free_ports()
        recordings = ("--recordings", str(tmp_path / "recordings"))
        gateway = start("gateway", "--port", f"{port},{other}", *recordings, *LONG)
        gateway.until("/readyz", 200)
        client = connect_carla(port)
        assert client.get_world().get_map().name
        gateway.terminate()
        gateway.until("/readyz", 503)
        # Of the same endpoint, as a script with a second process.
        joining = connect_carla(port)
        assert joining.get_world().get_snapshot().frame > 0
        late = connect_carla(other)
        with pytest.raises(RuntimeError, match="ending and takes no new clients"):
            late.get_world()
        assert client.get_world().wait_for_tick().frame > 0
        assert gateway.process.poll() is None
        assert figures(gateway.admin)["causeway_gateway_clients"] >= 1
        gateway.process.send_signal(signal.SIGTERM)
        assert gateway.ended() == 0


def test_a_renderer_that_drains_is_asked_no_more_while_there_is_another(tmp_path):
    with bus(tmp_path) as start:
        start("world")
        first, second = (start("render", "--id", f"render-{name}", *LONG) for name in "ab")
        for renderer in (first, second):
            renderer.until("/readyz", 200)
        face = start("scenario", "--http", "127.0.0.1:0")
        url = address_of(face)
        face.until("/readyz", 200)

        def drawn(renderer: Service) -> float:
            return figures(renderer.admin)["causeway_render_jobs_total{outcome=drawn}"]

        with causeway.Session(url) as session:
            session.reset("trolley_saves", seed=1)
            drain(first)

            def asks_the_other_alone() -> bool:
                before = drawn(first)
                for _ in range(4):
                    assert session.capture()
                return drawn(first) == before

            eventually("pictures of the other alone", asks_the_other_alone)
            assert drawn(second) >= 4
            first.terminate()
            assert first.ended() == 0
            assert session.capture()


def test_a_site_ends_its_faces_first(start_site):
    site = start_site("--no-render", "--drain-secs", "600")
    with causeway.Session(site.base_url) as session:
        session.reset("trolley_saves", seed=1)
        site.process.send_signal(signal.SIGTERM)
        eventually("refusal", lambda: is_refused(site.base_url))
        for _ in range(20):
            session.step()
        assert site.process.poll() is None
    assert site.process.wait(SOON_SECS) == 0
