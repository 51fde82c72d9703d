"""The subscription against a private bus in the same process, without any service."""

import json
import socket
import time
from pathlib import Path

import pytest
import zenoh

from causeway import bus

GOLDEN = (Path(__file__).parent / "golden" / "frame.bin").read_bytes()
DEADLINE_SECS = 30.0


@pytest.fixture
def router():
    """A bus on a free port: the session that publishes, and its endpoint."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    config = zenoh.Config()
    for name, value in (
        ("mode", "router"),
        ("listen/endpoints", [endpoint]),
        ("scouting/multicast/enabled", False),
    ):
        config.insert_json5(name, json.dumps(value))
    with zenoh.open(config) as session:
        yield session, endpoint


def publish_until(session, key, message, condition):
    """Publishes until `condition` holds: a subscription takes a moment to arrive."""
    deadline = time.monotonic() + DEADLINE_SECS
    while not condition():
        assert time.monotonic() < deadline, f"nothing arrived on {key} in {DEADLINE_SECS} s"
        session.put(key, message)
        time.sleep(0.01)


def test_a_published_frame_arrives_decoded(router):
    session, endpoint = router
    with bus.subscribe(endpoint, tenant="lab-1", world=3) as frames:
        publish_until(session, "causeway/lab-1/world/3/frame", GOLDEN, lambda: frames._ring)
        assert frames.receive(timeout_secs=DEADLINE_SECS).tick == 42


def test_a_slow_reader_keeps_the_newest_frames_and_counts_the_others(router):
    session, endpoint = router
    key = "causeway/local/world/1/frame"
    with bus.subscribe(endpoint, ring_frames=2) as frames:
        publish_until(session, key, GOLDEN, lambda: frames.dropped >= 3)
        assert len(frames._ring) == 2
        for _ in range(2):
            frames.receive(timeout_secs=DEADLINE_SECS)


def test_another_tenants_frames_do_not_arrive(router):
    session, endpoint = router
    with (
        bus.subscribe(endpoint, tenant="mine") as mine,
        bus.subscribe(endpoint, tenant="theirs") as theirs,
    ):
        publish_until(session, "causeway/theirs/world/1/frame", GOLDEN, lambda: theirs._ring)
        with pytest.raises(TimeoutError):
            mine.receive(timeout_secs=0.2)


def test_a_reader_is_told_once_why_there_may_be_no_frame(router, monkeypatch, caplog):
    monkeypatch.setattr(bus, "SILENCE_SECS", 0.05)
    _, endpoint = router
    with bus.subscribe(endpoint, world=3) as frames:
        with pytest.raises(TimeoutError, match="publishes when it is ticked"):
            frames.receive(timeout_secs=0.4)
    (told,) = caplog.messages
    assert "causeway/local/world/3/frame" in told and "ticked" in told


def test_a_message_that_is_no_frame_is_reported_and_the_next_one_is_read(router):
    session, endpoint = router
    key = "causeway/local/world/1/frame"
    with bus.subscribe(endpoint, ring_frames=1) as frames:
        publish_until(session, key, b"not a frame", lambda: frames._ring)
        with pytest.raises(ValueError, match="CWFR"):
            frames.receive(timeout_secs=DEADLINE_SECS)
        frames._ring.clear()
        publish_until(session, key, GOLDEN, lambda: frames._ring and frames._ring[0] == GOLDEN)
        assert next(frames).tick == 42


def test_closing_ends_the_iteration(router):
    _, endpoint = router
    frames = bus.subscribe(endpoint)
    frames.close()
    frames.close()
    assert list(frames) == []
    with pytest.raises(EOFError):
        frames.receive(timeout_secs=0.1)


def test_a_missing_bus_is_named():
    begin = time.monotonic()
    with pytest.raises(ConnectionError, match=r"no bus at tcp/127\.0\.0\.1:1: .*causeway up"):
        bus.subscribe("tcp/127.0.0.1:1", connect_timeout_secs=0.5)
    assert time.monotonic() - begin < 20.0


def test_what_is_no_bus_is_told_in_a_line_without_zenohs_own_lines():
    with pytest.raises(ValueError, match=r"wanted an address like tcp/.*, found 'junk'$"):
        bus.join("junk")
    with pytest.raises(ConnectionError) as refused:
        bus.join("tcp/127.0.0.1:1", 0.5)
    assert ".rs" not in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("tenant", ["", "A", "a/b", "*", "a" * 33, "batch"])
def test_a_tenant_with_key_syntax_is_refused(tenant):
    with pytest.raises(ValueError, match="tenant"):
        bus.frame_key(tenant)


def test_keys_are_those_of_the_bus():
    assert bus.frame_key("lab-1", world=7) == "causeway/lab-1/world/7/frame"
    assert bus.frame_key("lab-1") == "causeway/lab-1/world/*/frame"
    with pytest.raises(ValueError, match="1 or more"):
        bus.frame_key("lab-1", world=0)
