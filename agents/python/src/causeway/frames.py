"""Frames of a world as numpy arrays.

The arrays map the bytes of the message: decoding a frame of thousands of actors copies none of
them. All values are SI units and radians in a right-handed frame: x forward/east, y left/north,
z up; quaternions are x, y, z, w.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from causeway.wire import (
    ActorKind,
    ActorState,
    BonePose,
    Collision,
    Halt,
    RulesBroken,
    TrafficLightState,
    Weather,
)
from causeway.wire import Frame as FrameTable
from causeway.wire import WalkerPose as WalkerPoseTable

IDENTIFIER = b"CWFR"

#: Values of ``actors["kind"]``.
VEHICLE = ActorKind.ActorKind.Vehicle
WALKER = ActorKind.ActorKind.Walker
PROP = ActorKind.ActorKind.Prop
TRAFFIC_LIGHT = ActorKind.ActorKind.TrafficLight
TRAFFIC_SIGN = ActorKind.ActorKind.TrafficSign
SENSOR = ActorKind.ActorKind.Sensor
MARKER = ActorKind.ActorKind.Marker

_VECTOR = ("<f4", (3,))

#: Pose of one frame in another: metres, and a unit quaternion x, y, z, w.
POSE_DTYPE = np.dtype([("position_m", *_VECTOR), ("orientation", "<f4", (4,))])

#: CARLA's controls with ISO 8855 signs: steer -1 is full right, 1 full left.
VEHICLE_CONTROL_DTYPE = np.dtype(
    {
        "names": [
            "throttle",
            "steer",
            "brake",
            "hand_brake",
            "reverse",
            "manual_gear",
            "gear",
        ],
        "formats": ["<f4", "<f4", "<f4", "?", "?", "?", "i1"],
        "offsets": [0, 4, 8, 12, 13, 14, 15],
        "itemsize": 16,
    }
)

#: How a pedestrian wants to move: a unit vector in the world, or zero to stand.
WALKER_CONTROL_DTYPE = np.dtype(
    {
        "names": ["direction_in_world", "speed_mps", "jump"],
        "formats": [_VECTOR, "<f4", "?"],
        "offsets": [0, 12, 16],
        "itemsize": 20,
    }
)

#: One actor at the end of a tick, as in ``schemas/fbs/frame.fbs``.
ACTOR_STATE_DTYPE = np.dtype(
    [
        ("id", "<u4"),
        ("kind", "u1"),
        ("gear", "i1"),
        ("type_index", "<u2"),
        ("world_from_actor", POSE_DTYPE),
        ("linear_velocity_in_world_mps", *_VECTOR),
        ("angular_velocity_in_world_radps", *_VECTOR),
        ("linear_acceleration_in_world_mps2", *_VECTOR),
        ("box_centre_in_actor_m", *_VECTOR),
        ("box_half_extent_m", *_VECTOR),
        ("control", VEHICLE_CONTROL_DTYPE),
        ("road_wheel_rad", "<f4"),
        ("colour_rgb", "<u4"),
        ("parent", "<u4"),
        ("lights", "<u4"),
        ("doors", "u1"),
        ("failure", "u1"),
        ("_padding", "V2"),
        ("speed_limit_mps", "<f4"),
        ("traffic_light", "<u4"),
        ("walker", WALKER_CONTROL_DTYPE),
        ("gait_rad", "<f4"),
    ]
)

#: What one traffic light shows; ``colour`` is a value of ``TrafficLightColour``.
TRAFFIC_LIGHT_STATE_DTYPE = np.dtype(
    {
        "names": [
            "actor",
            "colour",
            "group",
            "frozen",
            "elapsed_secs",
            "green_secs",
            "yellow_secs",
            "red_secs",
        ],
        "formats": ["<u4", "u1", "<u2", "?", "<f4", "<f4", "<f4", "<f4"],
        "offsets": [0, 4, 6, 8, 12, 16, 20, 24],
        "itemsize": 28,
    }
)

#: One contact that pushed during the tick; ``other`` is 0 for static scenery.
COLLISION_DTYPE = np.dtype(
    {
        "names": [
            "actor",
            "other",
            "started",
            "position_in_world_m",
            "impulse_in_world_ns",
            "closing_speed_mps",
        ],
        "formats": ["<u4", "<u4", "?", _VECTOR, _VECTOR, "<f4"],
        "offsets": [0, 4, 8, 12, 24, 36],
        "itemsize": 40,
    }
)

#: An actor at rest because its motion became impossible in ``tick``; ``reason`` is a value of
#: ``HaltReason``.
HALT_DTYPE = np.dtype(
    {
        "names": ["tick", "actor", "reason"],
        "formats": ["<u8", "<u4", "u1"],
        "offsets": [0, 8, 12],
        "itemsize": 16,
    }
)

#: How often a vehicle has broken rules of the road: red lights and stop signs run, junctions
#: driven into before somebody who was to go first, crossings driven onto before people.
RULES_BROKEN_DTYPE = np.dtype(
    [(name, "<u4") for name in ("actor", "red_lights", "stop_signs", "right_of_way", "crossings")]
)

#: How one bone of a walker is posed; ``bone`` is its place in the order in which CARLA tells bones.
BONE_POSE_DTYPE = np.dtype([("bone", "u1"), ("_padding", "V3"), ("parent_from_bone", POSE_DTYPE)])

#: CARLA's fourteen weather parameters; percentages run from 0 to 100.
WEATHER_DTYPE = np.dtype(
    [
        (name, "<f4")
        for name in (
            "cloudiness_percent",
            "precipitation_percent",
            "precipitation_deposits_percent",
            "wind_intensity_percent",
            "sun_azimuth_rad",
            "sun_altitude_rad",
            "fog_density_percent",
            "fog_distance_m",
            "wetness_percent",
            "fog_falloff",
            "scattering_intensity",
            "mie_scattering_scale",
            "rayleigh_scattering_scale",
            "dust_storm_percent",
        )
    ]
)

for _name, _dtype, _bytes in (
    ("ActorState", ACTOR_STATE_DTYPE, ActorState.ActorState.SizeOf()),
    ("Collision", COLLISION_DTYPE, Collision.Collision.SizeOf()),
    (
        "TrafficLightState",
        TRAFFIC_LIGHT_STATE_DTYPE,
        TrafficLightState.TrafficLightState.SizeOf(),
    ),
    ("BonePose", BONE_POSE_DTYPE, BonePose.BonePose.SizeOf()),
    ("Halt", HALT_DTYPE, Halt.Halt.SizeOf()),
    ("RulesBroken", RULES_BROKEN_DTYPE, RulesBroken.RulesBroken.SizeOf()),
    ("Weather", WEATHER_DTYPE, Weather.Weather.SizeOf()),
):
    if _dtype.itemsize != _bytes:
        raise ImportError(
            f"{_name} takes {_bytes} bytes on the wire, its numpy type {_dtype.itemsize}: "
            "causeway.frames and the generated code are of different versions"
        )

Buffer: TypeAlias = bytes | bytearray | memoryview


@dataclass(frozen=True)
class WalkerPose:
    """Bones of a walker that somebody posed: what is shown and met is between its walk and this."""

    #: Its actor.
    walker: int
    #: 0: its walk alone; 1: the pose alone.
    share: float
    #: :data:`BONE_POSE_DTYPE`, shape ``(K,)``, ordered by bone; all others walk.
    bones: NDArray[np.void]


@dataclass(frozen=True)
class Frame:
    """The immutable state of one world after one tick."""

    world: int
    #: Count of completed ticks; 0 is the initial state.
    tick: int
    #: Changes when a new process owns the world.
    epoch: int
    #: Length of the last tick, or of the next one at tick 0.
    dt_secs: float
    #: Equal for equal states, bit for bit.
    state_hash: int
    seed: int
    map_name: str
    #: BLAKE3 of the map's OpenDRIVE text, hexadecimal.
    map_digest: str
    #: One element of :data:`WEATHER_DTYPE`, shape ``()``.
    weather: NDArray[np.void]
    #: Blueprint ids, indexed by ``actors["type_index"]``.
    types: tuple[str, ...]
    #: :data:`ACTOR_STATE_DTYPE`, shape ``(N,)``, ordered by id; read-only for a ``bytes`` message.
    actors: NDArray[np.void]
    #: :data:`COLLISION_DTYPE`, shape ``(M,)``, ordered by (actor, other).
    collisions: NDArray[np.void]
    #: :data:`TRAFFIC_LIGHT_STATE_DTYPE`, shape ``(L,)``, ordered by actor.
    traffic_lights: NDArray[np.void]
    #: Simulated seconds since tick 0.
    time_secs: float
    #: :data:`HALT_DTYPE`, shape ``(H,)``, ordered by actor.
    halted: NDArray[np.void]
    #: :data:`RULES_BROKEN_DTYPE`, shape ``(B,)``, ordered by actor: those that have broken any.
    rules_broken: NDArray[np.void]
    #: Of those walkers that somebody posed, ordered by walker.
    walker_poses: tuple[WalkerPose, ...]

    def speeds_mps(self) -> NDArray[np.float32]:
        """Speed of every actor, shape ``(N,)``, metres per second, never negative."""
        speeds: NDArray[np.float32] = np.linalg.norm(
            self.actors["linear_velocity_in_world_mps"], axis=1
        )
        return speeds

    def type_names(self) -> list[str]:
        """Blueprint id of every actor, in the order of :attr:`actors`."""
        return [self.types[index] for index in self.actors["type_index"]]


def decode(buffer: Buffer) -> Frame:
    """Reads one ``Frame`` message. Its arrays keep `buffer` alive and map its bytes.

    Raises:
        ValueError: the bytes are not a frame, or are cut short or damaged.
    """
    data = memoryview(buffer).cast("B")
    found = bytes(data[4:8])
    if len(data) < 8 or found != IDENTIFIER:
        raise ValueError(
            f"wanted a frame with identifier {IDENTIFIER!r}, found {found!r} in {len(data)} bytes"
        )
    try:
        return _decode(data)
    except (struct.error, IndexError, TypeError, OverflowError, UnicodeDecodeError) as cause:
        raise ValueError(f"a damaged frame of {len(data)} bytes: {cause}") from cause


def _decode(data: memoryview) -> Frame:
    table = FrameTable.Frame.GetRootAs(data)
    map_ref, weather = table.Map(), table.Weather()
    vectors = (table.ActorsIsNone(), table.CollisionsIsNone(), table.TrafficLightsIsNone())
    if map_ref is None or weather is None or any(vectors):
        raise ValueError("a damaged frame: a required field is missing")
    # A damaged length must not make us allocate or loop beyond what the message can hold.
    type_count = min(table.TypesLength(), len(data) // 4)
    types = tuple(_text(table.Types(index), data) for index in range(type_count))
    actors = _array(data, ACTOR_STATE_DTYPE, table.Actors(0), table.ActorsLength())
    if len(actors) and int(actors["type_index"].max()) >= len(types):
        raise ValueError(f"a damaged frame: an actor of a type beyond its {len(types)} types")
    collisions = _array(data, COLLISION_DTYPE, table.Collisions(0), table.CollisionsLength())
    lights = _array(
        data, TRAFFIC_LIGHT_STATE_DTYPE, table.TrafficLights(0), table.TrafficLightsLength()
    )
    halted = np.empty(0, HALT_DTYPE)
    if not table.HaltedIsNone():
        halted = _array(data, HALT_DTYPE, table.Halted(0), table.HaltedLength())
    broken = np.empty(0, RULES_BROKEN_DTYPE)
    if not table.RulesBrokenIsNone():
        broken = _array(data, RULES_BROKEN_DTYPE, table.RulesBroken(0), table.RulesBrokenLength())
    return Frame(
        world=table.World(),
        tick=table.Tick(),
        epoch=table.Epoch(),
        dt_secs=table.DtSecs(),
        state_hash=table.StateHash(),
        seed=table.Seed(),
        map_name=_text(map_ref.Name(), data),
        map_digest=_text(map_ref.Digest(), data),
        weather=_array(data, WEATHER_DTYPE, weather, 1)[0],
        types=types,
        actors=actors,
        collisions=collisions,
        traffic_lights=lights,
        time_secs=table.SimSecs(),
        halted=halted,
        rules_broken=broken,
        walker_poses=_walker_poses(table, data),
    )


def _walker_poses(table: FrameTable.Frame, data: memoryview) -> tuple[WalkerPose, ...]:
    # As for types: a damaged length is bounded by what the message can hold.
    count = min(table.WalkerPosesLength(), len(data) // 4)
    return tuple(_walker_pose(table.WalkerPoses(index), data) for index in range(count))


def _walker_pose(pose: WalkerPoseTable.WalkerPose | None, data: memoryview) -> WalkerPose:
    if pose is None or pose.BonesIsNone():
        raise ValueError("a damaged frame: bones of a walker are missing")
    bones = _array(data, BONE_POSE_DTYPE, pose.Bones(0), pose.BonesLength())
    return WalkerPose(pose.Walker(), pose.Share(), bones)


def _array(data: memoryview, dtype: np.dtype[np.void], first: Any, count: int) -> NDArray[np.void]:
    """`count` structs as one array, from the accessor of the first one."""
    # The position is the one thing the generated accessors know and do not say.
    return np.frombuffer(data, dtype=dtype, count=count, offset=first._tab.Pos)


def _text(raw: bytes | None, data: memoryview) -> str:
    if not raw:
        raise ValueError("a damaged frame: a required text is missing")
    # A zero byte follows every text, and the generated accessor cuts a text that runs over the end.
    if data[-len(raw) :] == raw:
        raise ValueError("a damaged frame: a text is cut short")
    return raw.decode("utf-8")
