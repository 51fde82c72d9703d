"""Which sensors and how many others: of the example itself, or of a CarlaSettings.ini of 0.8."""

from __future__ import annotations

import configparser
import sys
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Sensor:
    """A sensor in CARLA's axes: x ahead, y right, z up in metres; pitch, yaw, roll in degrees."""

    name: str
    kind: str
    place_m: tuple[float, float, float] = (0.3, 0.0, 1.3)
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    attributes: dict[str, object] = field(default_factory=dict)


@dataclass
class Settings:
    """`weather` is a number of CARLA 0.8; None: drawn by chance."""

    vehicles: int = 20
    pedestrians: int = 40
    weather: int | None = None
    sensors: list[Sensor] = field(default_factory=list)


#: By what 0.8 calls them.
CAMERAS = {
    "SceneFinal": "sensor.camera.rgb",
    "Depth": "sensor.camera.depth",
    "SemanticSegmentation": "sensor.camera.semantic_segmentation",
}
CAMERA_KEYS = {"imagesizex": "image_size_x", "imagesizey": "image_size_y", "fov": "fov"}
LIDAR_KEYS = {
    "channels": "channels",
    "range": "range",
    "pointspersecond": "points_per_second",
    "rotationfrequency": "rotation_frequency",
    "upperfovlimit": "upper_fov",
    "lowerfovlimit": "lower_fov",
}
PLACE = ("positionx", "positiony", "positionz")
TURN = ("rotationpitch", "rotationyaw", "rotationroll")
LEVEL_KEYS = {
    "numberofvehicles": "vehicles",
    "numberofpedestrians": "pedestrians",
    "weatherid": "weather",
}
LEVEL, SENSORS = "CARLA/LevelSettings", "CARLA/Sensor"


def usual(lidar: bool, *, small: bool) -> Settings:
    """Two cameras, 20 cars, 40 walkers; `lidar` adds one of 32 channels."""
    width, height = (400, 300) if small else (800, 600)
    size: dict[str, object] = {"image_size_x": width, "image_size_y": height}
    sensors = [
        Sensor("CameraRGB", "sensor.camera.rgb", attributes=size),
        Sensor("CameraDepth", "sensor.camera.depth", attributes=size),
    ]
    if lidar:
        turning: dict[str, object] = {
            "channels": 32,
            "range": 50,
            "points_per_second": 100_000,
            "rotation_frequency": 10,
            "upper_fov": 10,
            "lower_fov": -30,
        }
        sensors.append(
            Sensor("Lidar32", "sensor.lidar.ray_cast", place_m=(0.0, 0.0, 2.5), attributes=turning)
        )
    return Settings(sensors=sensors)


def read(path: Path) -> Settings:
    """The settings of a file; keys that mean nothing here are named on stderr.

    ValueError with the file's name, the section and the key where something is wrong.
    """
    file = configparser.ConfigParser(inline_comment_prefixes=(";",))
    try:
        with path.open() as text:
            file.read_file(text)
        settings = Settings()
        if file.has_section(LEVEL):
            level(file[LEVEL], settings, path)
        names = file.get(SENSORS, "Sensors", fallback="")
        for name in filter(None, (one.strip() for one in names.split(","))):
            settings.sensors.append(sensor(file, name, path))
    except configparser.Error as error:
        raise ValueError(f"{path}: {error}") from None
    known = {LEVEL, SENSORS, *(f"{SENSORS}/{one.name}" for one in settings.sensors)}
    for section in file.sections():
        if section not in known:
            warn(path, f"[{section}]")
    return settings


def level(section: configparser.SectionProxy, settings: Settings, path: Path) -> None:
    for key, value in section.items():
        if key not in LEVEL_KEYS:
            warn(path, f"{key} of [{section.name}]")
            continue
        count = int(number(value, key, section, path))
        if not 0 <= count <= (14 if key == "weatherid" else 1000):
            raise ValueError(f"{path}: [{section.name}] {key}={value} is out of range")
        setattr(settings, LEVEL_KEYS[key], count)


def sensor(file: configparser.ConfigParser, name: str, path: Path) -> Sensor:
    where = f"{SENSORS}/{name}"
    if not file.has_section(where):
        raise ValueError(f"{path}: there is no section [{where}]")
    section = file[where]
    kind = file.get(where, "SensorType", fallback=file.get(SENSORS, "SensorType", fallback=""))
    if kind == "CAMERA":
        drawn = section.get("PostProcessing", "SceneFinal")
        if drawn not in CAMERAS:
            raise ValueError(f"{path}: [{where}] PostProcessing={drawn}: wanted {[*CAMERAS]}")
        found, keys = Sensor(name, CAMERAS[drawn]), CAMERA_KEYS
    elif kind == "LIDAR_RAY_CAST":
        found, keys = Sensor(name, "sensor.lidar.ray_cast"), LIDAR_KEYS
    else:
        raise ValueError(f"{path}: [{where}] SensorType={kind}: wanted CAMERA or LIDAR_RAY_CAST")
    place, turn = list(found.place_m), list(found.turn_deg)
    for key, value in section.items():
        if key in PLACE:
            place[PLACE.index(key)] = number(value, key, section, path)
        elif key in TURN:
            turn[TURN.index(key)] = number(value, key, section, path)
        elif key in keys:
            amount = number(value, key, section, path)
            found.attributes[keys[key]] = int(amount) if amount.is_integer() else amount
        elif key not in ("sensortype", "postprocessing"):
            warn(path, f"{key} of [{where}]")
    found.place_m, found.turn_deg = (place[0], place[1], place[2]), (turn[0], turn[1], turn[2])
    return found


def number(value: str, key: str, section: configparser.SectionProxy, path: Path) -> float:
    try:
        return float(value)
    except ValueError:
        raise ValueError(f"{path}: [{section.name}] {key}={value} is not a number") from None


def warn(path: Path, what: str) -> None:
    print(f"{path}: {what} is not known here", file=sys.stderr)
