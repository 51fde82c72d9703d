"""A server for CARLA's client that knows one map and its walkers, and nothing else.

It stands in for a simulator where only the client's own steering of walkers is looked at:
MessagePack-RPC on one port, world snapshots on another, and walkers that are wherever the client
puts them. Positions are in the client's frame: metres, y to the right, z up.
"""

import socket
import struct
import threading
from dataclasses import dataclass, field
from typing import Any

import msgpack

STEP_SECS = 0.05
OBSERVER_STREAM = 1
OBSERVER_SENSOR = 17
EPISODE = 1
WALKER_HALF_HEIGHT_M = 0.9
WALKER = "walker.pedestrian.0001"
CONTROLLER = "controller.ai.walker"
# Index of the command that places a walker, in the client's list of commands.
APPLY_WALKER_STATE = 7


@dataclass
class MiniServer:
    """Serves one map with its navigation file on two free ports of this machine."""

    map_name: str
    opendrive: str
    nav_path: str
    nav: bytes
    frame: int = 1
    actors: dict[int, list] = field(default_factory=dict)
    places: dict[int, list] = field(default_factory=dict)
    observers: list[socket.socket] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.lock = threading.RLock()
        self.rpc = socket.create_server(("127.0.0.1", 0))
        self.stream = socket.create_server(("127.0.0.1", 0))
        self.port = self.rpc.getsockname()[1]
        for listener, serve in ((self.rpc, self.serve_calls), (self.stream, self.serve_stream)):
            threading.Thread(target=self.accept, args=(listener, serve), daemon=True).start()

    def accept(self, listener: socket.socket, serve: Any) -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=serve, args=(connection,), daemon=True).start()

    def close(self) -> None:
        for listener in (self.rpc, self.stream):
            listener.close()

    def serve_stream(self, connection: socket.socket) -> None:
        connection.recv(4)
        with self.lock:
            self.observers.append(connection)
            self.send_snapshot([connection])

    def serve_calls(self, connection: socket.socket) -> None:
        unpacker = msgpack.Unpacker()
        while data := connection.recv(1 << 16):
            unpacker.feed(data)
            for _, number, method, (_, *arguments) in unpacker:
                with self.lock:
                    result = self.answer(method, arguments)
                connection.sendall(msgpack.packb([1, number, None, result]))

    def answer(self, method: str, arguments: list) -> Any:
        """The result of a call, in its envelope."""
        if method == "apply_batch":
            return [self.apply(command) for command in arguments[0]]
        handler = getattr(self, f"on_{method}", None)
        return [[False]] if handler is None else [[1, handler(*arguments)]]

    def token(self) -> list:
        port = self.stream.getsockname()[1]
        return [struct.pack("<IHBB16x", OBSERVER_STREAM, port, 1, 0)]

    def on_version(self) -> str:
        return "0.9.16"

    def on_get_episode_info(self) -> list:
        return [EPISODE, self.token()]

    def on_get_sensor_token(self, _stream: int) -> list:
        return self.token()

    def on_get_episode_settings(self) -> list:
        return [True, True, [True, STEP_SECS], False, 0.01, 10, 0.0, False, 3000.0, 2000.0, True]

    def on_get_required_files(self, folder: str) -> list:
        return [self.nav_path] if folder == "Nav" and self.nav else []

    def on_request_file(self, path: str) -> bytes:
        assert path == self.nav_path, path
        return self.nav

    def on_query_lights_state(self, _client: str) -> list:
        return []

    def on_get_map_info(self) -> list:
        return [f"Carla/Maps/{self.map_name}", []]

    def on_get_map_data(self) -> str:
        return self.opendrive

    def on_get_actor_definitions(self) -> list:
        speed = ["speed", 3, "1.4", ["1.4"], True, False]
        return [[1, WALKER, "walker,pedestrian", [speed]], [2, CONTROLLER, CONTROLLER, []]]

    def on_spawn_actor(self, description: list, transform: list) -> list:
        return self.spawn(description, transform, 0)

    def on_spawn_actor_with_parent(self, *arguments: Any) -> list:
        description, transform, parent = arguments[:3]
        return self.spawn(description, transform, parent)

    def spawn(self, description: list, transform: list, parent: int) -> list:
        number = 100 + len(self.actors)
        zero = [0.0, 0.0, 0.0]
        box = [zero, [0.3, 0.3, WALKER_HALF_HEIGHT_M], zero, number]
        self.actors[number] = [number, parent, description, box, b"\x0c", b""]
        self.places[number] = transform
        return self.actors[number]

    def on_destroy_actor(self, number: int) -> bool:
        self.places.pop(number, None)
        return self.actors.pop(number, None) is not None

    def on_get_actors_by_id(self, numbers: list) -> list:
        return [self.actors[number] for number in numbers if number in self.actors]

    def on_get_actor_bounding_box(self, number: int) -> list:
        return self.actors[number][3]

    def on_tick_cue(self) -> int:
        self.frame += 1
        self.send_snapshot(self.observers)
        return self.frame

    def apply(self, command: list) -> list:
        [[kind, fields]] = command
        number = fields[0]
        if kind == APPLY_WALKER_STATE and number in self.places:
            (x, y, z), rotation = fields[1]
            self.places[number] = [[x, y, z + WALKER_HALF_HEIGHT_M], rotation]
        return [[1, number]]

    def send_snapshot(self, observers: list[socket.socket]) -> None:
        seconds = self.frame * STEP_SECS
        data = struct.pack("<QQd6f", OBSERVER_SENSOR, self.frame, seconds, *[0.0] * 6)
        data += struct.pack("<Qdf3iI", EPISODE, seconds, STEP_SECS, 0, 0, 0, 0)
        for number, (location, rotation) in self.places.items():
            data += struct.pack("<IB6f", number, 1, *location, *rotation) + bytes(36 + 54)
        for observer in list(observers):
            try:
                observer.sendall(struct.pack("<I", len(data)) + data)
            except OSError:
                self.observers.remove(observer)
