"""Frames of a running world, decoded in Python, against what the session says of the same world."""

import contextlib
import math
import time

import causeway
import pytest
from causeway import bus, frames

DEADLINE_SECS = 60.0


def frame_of(subscription: bus.FrameSubscription, sim: dict) -> frames.Frame | None:
    """The frame of a step, if it comes within a moment; other worlds have frames, too."""
    until = time.monotonic() + 1.0
    with contextlib.suppress(TimeoutError):
        while time.monotonic() < until:
            frame = subscription.receive(timeout_secs=1.0)
            if (frame.tick, f"{frame.state_hash:016x}") == (sim["tick"], sim["state_hash"]):
                return frame
    return None


def test_a_subscriber_sees_the_world_that_the_session_drives(site):
    with causeway.Session(site.base_url) as session, bus.subscribe(site.endpoint) as subscription:
        session.reset("trolley_saves", seed=1)
        deadline, frame = time.monotonic() + DEADLINE_SECS, None
        while frame is None:
            assert time.monotonic() < deadline, f"no frame within {DEADLINE_SECS} s"
            step = session.step()
            frame = frame_of(subscription, step.metadata["sim"])
    assert frame.map_name == "Town10HD_Opt"
    assert frame.dt_secs == pytest.approx(0.05)
    assert frame.time_secs == pytest.approx(step.observation["simulation_time"])
    kinds = frame.actors["kind"]
    assert (kinds == frames.WALKER).sum() == 3
    (car,) = frame.actors[kinds == frames.VEHICLE]
    assert frame.types[car["type_index"]] == "vehicle.lincoln.mkz"
    x, y, _ = step.observation["location"]
    # The session speaks CARLA's left-handed axes.
    assert car["world_from_actor"]["position_m"][:2] == pytest.approx([x, -y], abs=0.01)
    speed_mps = math.hypot(*car["linear_velocity_in_world_mps"])
    assert speed_mps * 3.6 == pytest.approx(step.observation["speed_kmh"], abs=0.1)
