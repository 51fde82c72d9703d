"""Bytes that no client of CARLA would send: an answer or a closed connection, and nobody else
notices."""

import contextlib
import random
import socket
import struct
import time
from pathlib import Path

import pytest

from carla_site import fresh, synchronous, ticks
from test_carla_clients import child

ANSWER_SECS = 60.0
MEGABYTE = 1_000_000
#: What the gateway may grow by, whatever it is sent: one request of the largest size and room.
GROWTH_BYTES = 200 * MEGABYTE
META = b"\x91\xc2"


def request(method: str, params: bytes = META, count: int = 1, number: int = 1) -> bytes:
    """`[0, number, method, [params...]]`; `count` says how many params there are."""
    name = method.encode()
    head = b"\x94\x00\xce" + struct.pack(">I", number) + b"\xd9" + bytes([len(name)]) + name
    return head + b"\xdc" + struct.pack(">H", count) + params


VERSION = request("version")
WRONG_ARGUMENTS = {
    "a map": b"\x81\xa1a\x01",
    "nothing": b"\xc0",
    "text": b"\xa5hello",
    "minus one": b"\xff",
    "not a number": b"\xca\x7f\xc0\x00\x00",
    "an extension": b"\xd4\x01\x00",
    "empty list": b"\x90",
    "deep list": b"\x91" * 20 + b"\xc0",
    "many commands": b"\xdd\x00\x00\xff\xff" + b"\x91\x92\x01\x91\x01" * 0xFFFF,
}
METHODS = ["spawn_actor", "apply_batch", "set_episode_settings", "get_actors_by_id", "cast_ray"]


class Raw:
    """A connection without a client library."""

    def __init__(self, port: int):
        self.socket = socket.create_connection(("127.0.0.1", port), ANSWER_SECS)

    def send(self, data: bytes) -> None:
        """Sends what the other side takes."""
        with contextlib.suppress(ConnectionError):
            self.socket.sendall(data)

    def outcome(self) -> str:
        """What comes of it: "answered", "closed" or "silence"."""
        try:
            return "answered" if self.socket.recv(65_536) else "closed"
        except ConnectionError:
            return "closed"
        except TimeoutError:
            return "silence"

    def close(self) -> None:
        self.socket.close()


@pytest.fixture
def raw(site):
    connection = Raw(site.carla_port)
    yield connection
    connection.close()


@pytest.fixture(scope="module")
def neighbour(site):
    """A client that works before, between and after."""
    with synchronous(fresh(site.carla_port).get_world()) as world:
        world.tick()
        yield world


@pytest.fixture(autouse=True)
def _nobody_notices(site, neighbour):
    before = resident_bytes(site)
    yield
    frame = neighbour.tick()
    assert ticks(neighbour, 3) == frame + 3
    assert resident_bytes(site) < before + GROWTH_BYTES


def resident_bytes(site) -> int:
    pages = Path(f"/proc/{child(site, 'gateway')}/statm").read_text().split()[1]
    return int(pages) * 4096


def test_a_good_request_is_answered(raw):
    raw.send(VERSION)
    assert raw.outcome() == "answered"


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(b"\xc1", id="no marker"),
        pytest.param(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n", id="another protocol"),
        pytest.param(b"\x91" * 100_000, id="deep nesting"),
        pytest.param(b"\x82" * 100_000, id="deep maps"),
        pytest.param(b"\xdb\xff\xff\xff\xff", id="a promise of four gigabytes"),
        pytest.param(b"\x94\x01\x01\xa1a" + b"\x91" + META, id="an answer"),
        pytest.param(b"\x94\x00\x01\x05\x91" + META, id="a number for a method"),
        pytest.param(b"\x94\x00\x01\xda\x20\x00" + b"m" * 0x2000 + b"\x91" + META, id="long name"),
        pytest.param(b"\x94\x00\x01\xa7version\x90", id="no metadata"),
    ],
)
def test_what_is_no_request_closes_the_connection(raw, data):
    raw.send(data)
    assert raw.outcome() == "closed"


@pytest.mark.parametrize("size", [10 * MEGABYTE, 100 * MEGABYTE])
def test_a_string_of_many_megabytes_ends_in_an_answer_or_a_closed_connection(raw, size):
    text = b"\xdb" + struct.pack(">I", size)
    raw.send(request("copy_opendrive_to_file", META + text, count=3))
    chunk = b"x" * MEGABYTE
    for _ in range(size // MEGABYTE):
        raw.send(chunk)
    raw.send(b"\x97" + b"\xc2" * 7)
    assert raw.outcome() in ("answered", "closed")


def test_a_promise_of_endless_small_parts_is_not_believed(raw):
    raw.send(b"\x94\x00\x01\xa7version\xdd\xff\xff\xff\xff" + META)
    for _ in range(100):
        raw.send(b"\xc0" * MEGABYTE)
    assert raw.outcome() == "closed"


@pytest.mark.parametrize("argument", WRONG_ARGUMENTS.values(), ids=WRONG_ARGUMENTS.keys())
@pytest.mark.parametrize("method", METHODS)
def test_wrong_arguments_are_answered(raw, method, argument):
    raw.send(request(method, META + argument, count=2))
    assert raw.outcome() == "answered"
    raw.send(VERSION)
    assert raw.outcome() == "answered"


def test_an_unknown_call_is_named_in_the_answer(raw):
    raw.send(request("fly_to_the_moon"))
    assert b"fly_to_the_moon" in raw.socket.recv(65_536)


def test_a_request_that_stays_half_done_harms_nobody(site, neighbour):
    halves = [Raw(site.carla_port) for _ in range(20)]
    for connection in halves:
        connection.send(VERSION[:7])
    ticks(neighbour, 10)
    for connection in halves:
        connection.close()


def test_a_client_that_never_reads_harms_nobody(raw, neighbour):
    # Each answer is some hundred kilobytes.
    raw.send(request("get_actor_definitions") * 2_000)
    ticks(neighbour, 3)


def test_large_requests_that_stay_half_done_take_bounded_memory_together(site, neighbour):
    before = resident_bytes(site)
    with contextlib.ExitStack() as stack:
        for _ in range(16):
            raw = Raw(site.carla_port)
            stack.callback(raw.close)
            raw.socket.settimeout(0.5)
            text = b"\xdb" + struct.pack(">I", 40 * MEGABYTE)
            with contextlib.suppress(TimeoutError):
                raw.send(request("copy_opendrive_to_file", META + text, count=3))
                raw.send(b"x" * 30 * MEGABYTE)
        assert resident_bytes(site) < before + GROWTH_BYTES
        neighbour.tick()


def test_tokens_that_nobody_uses_make_no_tick_of_others_wait(raw, neighbour):
    """A client that is about to listen is waited for half a second, by its own ticks."""
    began = time.monotonic()
    ticks(neighbour, 20)
    quiet_secs = time.monotonic() - began
    began = time.monotonic()
    for _ in range(20):
        raw.send(request("get_sensor_token", META + b"\x01", count=2))
        assert raw.outcome() == "answered"
        neighbour.tick()
    assert time.monotonic() - began < quiet_secs + 20 * 0.25


def test_noise_harms_nobody(site, neighbour):
    noise = random.Random(7)
    for _ in range(200):
        connection = Raw(site.carla_port)
        connection.send(noise.randbytes(noise.randrange(1, 400)))
        connection.close()
        streams = Raw(site.carla_port + 1)
        streams.send(noise.randbytes(noise.randrange(1, 16)))
        streams.close()
    ticks(neighbour, 10)


def test_a_question_for_a_traffic_manager_empties_no_port(start_site):
    """Only a process in which CARLA's client runs is lent the port of the OpenEnv face."""
    site = start_site("--no-render")
    port = int(site.base_url.rsplit(":", 1)[1])
    stranger = Raw(site.carla_port)
    question = META + b"\xcd" + struct.pack(">H", port)
    for number in range(20):
        stranger.send(request("is_traffic_manager_running", question, 2, number))
        assert stranger.outcome() == "answered"
        with socket.socket() as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with pytest.raises(OSError):
                other.bind(("0.0.0.0", port))
        socket.create_connection(("127.0.0.1", port), ANSWER_SECS).close()
        time.sleep(0.05)
