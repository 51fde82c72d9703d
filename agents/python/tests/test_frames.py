"""A frame written by Rust means the same in Python.

`golden/frame.bin` is written by a Rust test of `schemas`, which holds the same bytes against the
same values.
"""

import random
import struct
from pathlib import Path

import numpy as np
import pytest

from causeway import frames
from causeway.wire import (
    ActorState,
    Collision,
    HaltReason,
    Pose,
    Quat,
    Vec3,
    VehicleControl,
    Weather,
)
from causeway.wire import Frame as FrameTable

GOLDEN = (Path(__file__).parent / "golden" / "frame.bin").read_bytes()


def vector(accessor):
    """The three components of a generated accessor's vector."""
    value = accessor(Vec3.Vec3())
    return [value.X(), value.Y(), value.Z()]


def test_the_golden_frame_has_the_values_that_rust_wrote():
    frame = frames.decode(GOLDEN)
    assert (frame.world, frame.tick, frame.epoch) == (0x1234_5678_9ABC_DEF0, 42, 7)
    assert (frame.dt_secs, frame.seed) == (0.05, 11)
    assert frame.state_hash == 0xFEED_BEEF_DEAD_CAFE
    assert frame.time_secs == pytest.approx(2.1)
    assert (frame.map_name, frame.map_digest) == ("Town10HD_Opt", "ab" * 32)
    assert frame.types == ("vehicle.lincoln.mkz", "walker.pedestrian.0015")
    assert frame.type_names() == list(frame.types)

    car, walker = frame.actors
    assert list(frame.actors["id"]) == [1, 2]
    assert list(frame.actors["kind"]) == [frames.VEHICLE, frames.WALKER]
    assert car["gear"] == 3
    assert car["world_from_actor"]["position_m"].tolist() == [1.5, -2.25, 0.125]
    half_yaw_rad = 0.25
    assert car["world_from_actor"]["orientation"] == pytest.approx(
        [0.0, 0.0, np.sin(half_yaw_rad), np.cos(half_yaw_rad)], abs=1e-6
    )
    assert car["linear_velocity_in_world_mps"].tolist() == [11.0, 0.5, -0.25]
    assert car["linear_acceleration_in_world_mps2"].tolist() == [-8.5, 0.0, 0.0]
    assert car["control"].tolist() == (0.25, -0.5, 1.0, True, False, True, -1)
    assert walker["control"].tolist() == (0.0, 0.0, 0.0, False, False, False, 0)
    assert car["road_wheel_rad"] == -0.125
    assert car["colour_rgb"] == 0x00C0_FFEE
    assert frame.speeds_mps() == pytest.approx([np.sqrt(121.3125)] * 2)

    assert (car["parent"], car["lights"], car["doors"]) == (7, 0x8001, 0b10_0001)
    assert (car["speed_limit_mps"], car["traffic_light"]) == (13.5, 9)
    assert walker["walker"]["direction_in_world"].tolist() == [0.0, 1.0, 0.0]
    assert (walker["walker"]["jump"], walker["gait_rad"]) == (True, 0.75)

    (light,) = frame.traffic_lights
    assert (light["actor"], light["colour"], light["group"], light["frozen"]) == (9, 1, 3, True)
    assert [light[name] for name in ("elapsed_secs", "green_secs", "yellow_secs", "red_secs")] == [
        0.5,
        10.0,
        3.0,
        2.0,
    ]

    (halt,) = frame.halted
    assert (halt["tick"], halt["actor"], halt["reason"]) == (7, 1, HaltReason.HaltReason.TooFast)

    (broken,) = frame.rules_broken
    assert broken.tolist() == (1, 1, 2, 3, 4)

    (pose,) = frame.walker_poses
    assert (pose.walker, pose.share) == (2, 0.5)
    assert pose.bones["bone"].tolist() == [5, 65]

    assert frame.collisions["other"].tolist() == [2, 0]
    assert frame.collisions["started"].tolist() == [True, False]
    assert frame.collisions["impulse_in_world_ns"][0].tolist() == [-420.0, 3.0, 0.0]


def test_every_field_of_an_actor_agrees_with_the_generated_code():
    table = FrameTable.Frame.GetRootAs(GOLDEN)
    frame = frames.decode(GOLDEN)
    assert len(frame.actors) == table.ActorsLength() == 2
    for index, row in enumerate(frame.actors):
        actor = table.Actors(index)
        assert row["id"] == actor.Id()
        assert row["kind"] == actor.Kind()
        assert row["gear"] == actor.Gear()
        assert row["type_index"] == actor.TypeIndex()
        pose = actor.WorldFromActor(Pose.Pose())
        orientation = pose.Orientation(Quat.Quat())
        assert row["world_from_actor"]["position_m"].tolist() == vector(pose.PositionM)
        assert row["world_from_actor"]["orientation"].tolist() == [
            orientation.X(),
            orientation.Y(),
            orientation.Z(),
            orientation.W(),
        ]
        for name, accessor in (
            ("linear_velocity_in_world_mps", actor.LinearVelocityInWorldMps),
            ("angular_velocity_in_world_radps", actor.AngularVelocityInWorldRadps),
            ("linear_acceleration_in_world_mps2", actor.LinearAccelerationInWorldMps2),
            ("box_centre_in_actor_m", actor.BoxCentreInActorM),
            ("box_half_extent_m", actor.BoxHalfExtentM),
        ):
            assert row[name].tolist() == vector(accessor), name
        control = actor.Control(VehicleControl.VehicleControl())
        assert row["control"].tolist() == (
            control.Throttle(),
            control.Steer(),
            control.Brake(),
            control.HandBrake(),
            control.Reverse(),
            control.ManualGear(),
            control.Gear(),
        )
        assert row["road_wheel_rad"] == actor.RoadWheelRad()
        assert row["colour_rgb"] == actor.ColourRgb()
        assert (row["parent"], row["lights"]) == (actor.Parent(), actor.Lights())
        assert (row["doors"], row["failure"]) == (actor.Doors(), actor.Failure())
        assert row["speed_limit_mps"] == actor.SpeedLimitMps()
        assert row["traffic_light"] == actor.TrafficLight()
        assert row["gait_rad"] == actor.GaitRad()


def test_collisions_and_weather_agree_with_the_generated_code():
    table = FrameTable.Frame.GetRootAs(GOLDEN)
    frame = frames.decode(GOLDEN)
    for index, row in enumerate(frame.collisions):
        contact = table.Collisions(index)
        assert row["actor"] == contact.Actor()
        assert row["other"] == contact.Other()
        assert row["started"] == contact.Started()
        assert row["position_in_world_m"].tolist() == vector(contact.PositionInWorldM)
        assert row["impulse_in_world_ns"].tolist() == vector(contact.ImpulseInWorldNs)
        assert row["closing_speed_mps"] == contact.ClosingSpeedMps()
    weather = table.Weather()
    for name in frames.WEATHER_DTYPE.names:
        accessor = "".join(part.capitalize() for part in name.split("_"))
        assert frame.weather[name] == getattr(weather, accessor)(), name


def test_posed_bones_agree_with_the_generated_code():
    table, frame = FrameTable.Frame.GetRootAs(GOLDEN), frames.decode(GOLDEN)
    for posed, shown in zip(
        (table.WalkerPoses(index) for index in range(table.WalkerPosesLength())),
        frame.walker_poses,
        strict=True,
    ):
        assert (posed.Walker(), posed.Share()) == (shown.walker, shown.share)
        assert posed.BonesLength() == len(shown.bones)
        for index, row in enumerate(shown.bones):
            bone = posed.Bones(index)
            pose = bone.ParentFromBone(Pose.Pose())
            assert row["bone"] == bone.Bone()
            assert row["parent_from_bone"]["position_m"].tolist() == vector(pose.PositionM)


def test_the_numpy_types_have_the_size_of_the_structs():
    assert frames.ACTOR_STATE_DTYPE.itemsize == ActorState.ActorState.SizeOf()
    assert frames.COLLISION_DTYPE.itemsize == Collision.Collision.SizeOf()
    assert frames.WEATHER_DTYPE.itemsize == Weather.Weather.SizeOf()
    assert frames.VEHICLE_CONTROL_DTYPE.itemsize == VehicleControl.VehicleControl.SizeOf()
    assert frames.POSE_DTYPE.itemsize == Pose.Pose.SizeOf()


def test_actors_map_the_bytes_of_the_message_without_a_copy():
    message = bytearray(GOLDEN)
    frame = frames.decode(message)
    frame.actors["gear"][0] = -1
    assert message != GOLDEN
    assert frames.decode(message).actors["gear"][0] == -1


def test_another_message_is_refused_with_what_was_wanted_and_found():
    other = GOLDEN[:4] + b"CWRQ" + GOLDEN[8:]
    with pytest.raises(ValueError, match=r"CWFR.*CWRQ"):
        frames.decode(other)
    with pytest.raises(ValueError, match="in 3 bytes"):
        frames.decode(b"abc")


def test_a_message_cut_short_is_refused():
    # The last text of the golden frame is followed by its zero byte and three of padding.
    for length in range(len(GOLDEN) - 4):
        with pytest.raises(ValueError):
            frames.decode(GOLDEN[:length])


def test_a_damaged_message_is_refused_or_read_but_never_breaks_the_reader():
    generator = random.Random(1)
    for _ in range(5_000):
        message = bytearray(GOLDEN)
        for _ in range(generator.randint(1, 4)):
            at = generator.randrange(8, len(message) - 4)
            struct.pack_into("<I", message, at, generator.choice([0, 1, 0xFFFF_FFFF, at]))
        try:
            frame = frames.decode(message)
        except ValueError:
            continue
        assert len(frame.type_names()) == len(frame.actors)
