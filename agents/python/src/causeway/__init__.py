"""Python client of the Causeway driving simulator.

- :mod:`causeway.frames` decodes a frame into numpy arrays.
- :mod:`causeway.bus` subscribes to the frames of running worlds.
- :mod:`causeway.openenv` drives one episode over the OpenEnv WebSocket.
- :mod:`causeway.maps` asks maps for lanes and places, many at once, without a site.
- :mod:`causeway.rollout` steps many worlds at once, in memory shared with the engine.
- :mod:`causeway.vector` is such worlds as Gymnasium environments (extra ``gym``).
- :mod:`causeway.gym` is an OpenEnv session as a Gymnasium environment (extra ``gym``).

Frames and the bus use SI units and radians, right-handed, x forward/east, y left/north, z up.
OpenEnv sessions use CARLA's left-handed axes (y right), degrees and km/h.
"""

from causeway.frames import Frame, decode
from causeway.openenv import Session, SessionError, Step

__all__ = ["Frame", "Session", "SessionError", "Step", "decode"]
