"""The protocol without a client library between: what is sent and what comes back, as JSON."""

import json
from contextlib import contextmanager

from websockets.sync.client import connect

REPLY_SECS = 60.0


class Wire:
    """One connection on `/ws`."""

    def __init__(self, connection):
        self.connection = connection

    def send(self, message):
        """Sends an object as JSON, or a text or bytes as they are."""
        raw = message if isinstance(message, (str, bytes)) else json.dumps(message)
        self.connection.send(raw)

    def receive(self):
        return json.loads(self.connection.recv(timeout=REPLY_SECS))

    def ask(self, message):
        self.send(message)
        return self.receive()

    def reset(self, **data):
        return self._data({"type": "reset", "data": data}, "observation")

    def step(self, **action):
        return self._data({"type": "step", "data": action}, "observation")

    def state(self):
        return self._data({"type": "state"}, "state")

    def _data(self, message, kind):
        reply = self.ask(message)
        assert reply["type"] == kind, reply
        return reply["data"]


@contextmanager
def wire(base_url, *, path="/ws", **options):
    """A raw connection; `options` go to the WebSocket library."""
    url = base_url.replace("http", "ws", 1) + path
    with connect(url, max_size=None, open_timeout=60, proxy=None, **options) as connection:
        yield Wire(connection)
