"""Sensors on a vehicle, and what they measured in a frame."""

from __future__ import annotations

import queue
from collections.abc import Mapping
from typing import Any

from PIL import Image
from simulator import carla

#: What a server may take to draw a frame.
WAIT_SECS = 60.0
#: Of the camera that looks over a car, from its middle.
BEHIND_M, ABOVE_M, DOWN_DEGREES = 8.0, 4.0, 14.0


class Rig:
    """Sensors on one vehicle of a world in synchronous mode.

    After every tick `measured` must be called, also before `remove`: a sensor that is removed while
    a message is on its way may end the process.
    """

    def __init__(self, world: carla.World, vehicle: carla.Actor) -> None:
        self._world = world
        self._vehicle = vehicle
        self._sensors: dict[str, tuple[carla.Sensor, queue.Queue[Any]]] = {}

    def add(
        self, name: str, kind: str, place: carla.Transform, attributes: Mapping[str, object]
    ) -> None:
        """Attaches a sensor of `kind`, e.g. `sensor.camera.rgb`, which measures in every frame."""
        blueprint = self._world.get_blueprint_library().find(kind)
        for key, value in attributes.items():
            blueprint.set_attribute(key, str(value))
        sensor = self._world.spawn_actor(blueprint, place, attach_to=self._vehicle)
        messages: queue.Queue[Any] = queue.Queue()
        self._sensors[name] = (sensor, messages)
        sensor.listen(messages.put)

    def measured(self, frame: int) -> dict[str, Any]:
        """What each sensor measured in a frame, by name. RuntimeError if one says nothing."""
        found = {}
        for name, (_, messages) in self._sensors.items():
            try:
                message = messages.get(timeout=WAIT_SECS)
                while message.frame < frame:
                    message = messages.get(timeout=WAIT_SECS)
            except queue.Empty:
                raise RuntimeError(f"{name} has measured nothing in frame {frame}") from None
            found[name] = message
        return found

    def remove(self) -> None:
        for sensor, _ in self._sensors.values():
            sensor.stop()
            sensor.destroy()
        self._sensors.clear()


def from_behind(
    world: carla.World, vehicle: carla.Actor, attributes: Mapping[str, object]
) -> Image.Image:
    """What a camera over a vehicle and behind it sees after one more tick."""
    rig = Rig(world, vehicle)
    place = carla.Transform(
        carla.Location(x=-BEHIND_M, z=ABOVE_M), carla.Rotation(pitch=-DOWN_DEGREES)
    )
    rig.add("camera", "sensor.camera.rgb", place, attributes)
    try:
        image = rig.measured(world.tick())["camera"]
    finally:
        rig.remove()
    size = (image.width, image.height)
    return Image.frombytes("RGB", size, bytes(image.raw_data), "raw", "BGRX")
