"""One who comes and goes without end, in a process of its own, to be killed.

Usage: churn.py BASE_URL ENDPOINT CARLA_PORT KIND SEED. Says one line for each thing that it has
done, and one that begins with "error" for each that failed.
"""

import contextlib
import random
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import causeway
import httpx
import websockets.sync.client
import zenoh
from causeway import bus

HERE = Path(__file__).parent
SCENARIOS = ("trolley_saves", "bias_2v1", "free_roam", "maze_navigation")
ACTIONS = ("observe", "emergency_stop", "maintain_speed", "lane_change", "follow_route")
PAGES = ("/health", "/metrics", "/schema", "/web", "/nowhere")
VISIT_SECS = 180.0
#: A masked WebSocket ping of 125 bytes.
PING = b"\x89\xfd\0\0\0\0" + b"\x07" * 125
#: A request of HTTP, the head of a WebSocket's text of a megabyte, and a call of CARLA; parts of
#: them are sent, and no more.
POST = (
    b"POST /step HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n"
    b"content-length: 1000000\r\n\r\n{"
)
UPGRADE = (
    b"GET /ws HTTP/1.1\r\nhost: localhost\r\nconnection: upgrade\r\nupgrade: websocket\r\n"
    b"sec-websocket-version: 13\r\nsec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
HALF_TEXT = b"\x81\xff" + (1_000_000).to_bytes(8, "big") + bytes(4) + b"x" * 100_000
HALVES = 20
HALF_SECS = 2.0
PHANTOMS = 60
#: MessagePack: what is no number, and what is too large to be one.
NOT_FINITE = (b"\xcb\x7f\xf8" + bytes(6), b"\xcb\x7f\xf0" + bytes(6), b"\xca\xff\x80\0\0")
#: Of pages of others, and of names that were made to lead here.
FOREIGN = ({"Origin": "https://evil.example"}, {"Host": "evil.example"})
CALLS = ("get_sensor_token", "apply_batch", "is_traffic_manager_running", "spawn_actor", "no_such")


class Churn:
    """What may be done, again and again."""

    def __init__(self, base_url: str, endpoint: str, port: int, seed: int) -> None:
        self.base_url, self.endpoint, self.port = base_url, endpoint, port
        self.dice = random.Random(seed)

    def sessions(self) -> None:
        """An episode of some scenario with a picture, or its beginning."""
        with causeway.Session(self.base_url, connect_timeout_secs=60.0) as session:
            others = {"num_npc_vehicles": 5, "num_pedestrians": 5, "camera_width": 160}
            config = {**others, "camera_height": 90}
            session.reset(self.dice.choice(SCENARIOS), scenario_config=config, seed=1)
            for _ in range(self.dice.randrange(60)):
                session.step(self.dice.choice(ACTIONS), lane_direction="left")
            session.capture()

    def subscribers(self) -> None:
        with bus.subscribe(self.endpoint, connect_timeout_secs=60.0) as frames:
            for _ in range(self.dice.randrange(20)):
                frames.receive(timeout_secs=60.0)

    def pages(self) -> None:
        for page in PAGES:
            httpx.get(self.base_url + page, timeout=60.0)
        time.sleep(0.05)

    def visits(self) -> None:
        """A client of CARLA that loads, spawns, measures, and goes."""
        visit = [sys.executable, HERE / "visiting_client.py", str(self.port)]
        map_name = self.dice.choice(("Town02", "Town10HD_Opt"))
        done = subprocess.run(
            [*visit, map_name], timeout=VISIT_SECS, check=False, capture_output=True, text=True
        )
        if done.returncode != 0:
            raise RuntimeError(f"a visit ended with {done.returncode}: {done.stderr[-300:]}")

    def floods(self) -> None:
        """Pings without reading, bytes that are no calls, and calls that mean nothing."""
        host, port = self.base_url.removeprefix("http://").split(":")
        url = f"ws://{host}:{port}/ws"
        with (
            websockets.sync.client.connect(url, open_timeout=60.0) as deaf,
            socket.create_connection((host, self.port), 60.0) as noise,
            socket.create_connection((host, self.port), 60.0) as caller,
        ):
            # What nobody takes any more is given up after a moment.
            deaf.socket.settimeout(0.2)
            with contextlib.suppress(OSError):
                deaf.socket.sendall(PING * 10_000)
            with contextlib.suppress(OSError):
                noise.sendall(self.dice.randbytes(4_000))
            for number in range(200):
                caller.sendall(request(self.dice.choice(CALLS), number))
                caller.recv(65_536)

    def halves(self) -> None:
        """Connections that say nothing, or half of something, for a while."""
        host, port = self.base_url.removeprefix("http://").split(":")
        call = request("version", 1)
        with contextlib.ExitStack() as stack:
            for _ in range(HALVES):
                for to, said in ((port, POST), (self.port, call), (self.port + 1, b"\0\0\0")):
                    half = stack.enter_context(socket.create_connection((host, int(to)), 60.0))
                    half.sendall(said[: self.dice.randrange(len(said))])
            talk = stack.enter_context(socket.create_connection((host, int(port)), 60.0))
            talk.sendall(UPGRADE)
            talk.settimeout(HALF_SECS)
            with contextlib.suppress(OSError):
                talk.sendall(HALF_TEXT)
            time.sleep(HALF_SECS)

    def nonsense(self) -> None:
        """Numbers that are none, and pages of others: refused each time."""
        number = self.dice.choice(("NaN", "1e999", "-Infinity"))
        action = f'{{"action": {{"throttle": {number}}}}}'
        answer = httpx.post(
            f"{self.base_url}/step",
            content=action,
            headers={"content-type": "application/json"},
            timeout=60.0,
        )
        assert answer.status_code == 422, answer.text
        for headers in FOREIGN:
            answer = httpx.get(self.base_url + "/metadata", headers=headers, timeout=60.0)
            assert answer.status_code == 403, (headers, answer.text)
        host = self.base_url.removeprefix("http://").split(":")[0]
        with socket.create_connection((host, self.port), 60.0) as caller:
            for number in range(20):
                argument = self.dice.choice(NOT_FINITE)
                caller.sendall(request("get_actors_by_id", number, argument))
                assert caller.recv(65_536)
        time.sleep(0.05)

    def phantoms(self) -> None:
        """Services that are announced, and are not there."""
        config = zenoh.Config()
        for name, value in {
            "mode": '"client"',
            "connect/endpoints": f'["{self.endpoint}"]',
            "scouting/multicast/enabled": "false",
        }.items():
            config.insert_json5(name, value)
        with zenoh.open(config) as session:
            tokens = [
                session.liveliness().declare_token(f"causeway/{what}/{kind}/phantom-{count}")
                for count in range(PHANTOMS)
                for kind in ("world", "render")
                for what in ("alive", "draining")
            ]
            time.sleep(HALF_SECS)
            for token in tokens:
                token.undeclare()


def request(method: str, number: int, argument: bytes = b"\x01") -> bytes:
    """`[0, number, method, [metadata, argument]]` as MessagePack-RPC."""
    name = method.encode()
    head = b"\x94\x00\xce" + struct.pack(">I", number) + b"\xd9" + bytes([len(name)]) + name
    return head + b"\x92\x91\xc2" + argument


if __name__ == "__main__":
    url, endpoint, port, kind, seed = sys.argv[1:]
    churn = Churn(url, endpoint, int(port), int(seed))
    while True:
        try:
            getattr(churn, kind)()
            print(kind, flush=True)
        except Exception as error:  # Whoever looks judges.
            print(f"error: {kind}: {error!r}", flush=True)
            time.sleep(0.5)
