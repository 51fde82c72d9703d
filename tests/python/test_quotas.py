"""Goal: a tenant has no more than its quotas say, hears which, and what it did is written down."""

import json
import queue
import time
from dataclasses import dataclass
from pathlib import Path

import carla
import causeway
import pytest

from carla_site import connect, spawn_car, synchronous
from running_site import Site, two_free_ports
from tenants import new_token
from watched import eventually

SIDE_PX = 64
#: Two pictures a second; four more come at once.
PIXELS_PER_SECOND = 2 * SIDE_PX * SIDE_PX
QUOTAS = f"""[tenant.alice]
actors_per_world = 4
cameras_per_world = 2
recordings_mib = 1
pixels_per_second = {PIXELS_PER_SECOND}
"""


@dataclass
class Bounded:
    """A site with a tenant that may use little of it."""

    site: Site
    token: str
    audit: Path

    def lines(self, service: str) -> list[dict]:
        text = (self.audit / f"{service}.jsonl").read_text()
        return [json.loads(line) for line in text.splitlines()]

    def wrote(self, service: str, **members: str) -> bool:
        return any(members.items() <= line.items() for line in self.lines(service))


@pytest.fixture(scope="module")
def bounded(tmp_path_factory):
    from running_site import start, stop

    folder = tmp_path_factory.mktemp("quotas")
    path = folder / "tokens.toml"
    token = new_token(path, "alice", "alice-laptop")
    path.write_text(path.read_text().replace("[tenant.alice]\n", QUOTAS))
    flags = [f"--tokens={path}", f"--recordings={folder / 'recordings'}"]
    audit = folder / "audit"
    site = start(folder / "log", f"--carla={two_free_ports()}=alice", f"--audit={audit}", *flags)
    yield Bounded(site, token, audit)
    stop(site)


def camera(world: carla.World) -> carla.ActorBlueprint:
    blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
    for name in ("image_size_x", "image_size_y"):
        blueprint.set_attribute(name, str(SIDE_PX))
    return blueprint


def test_a_world_of_a_carla_port_has_no_more_actors_and_cameras_than_it_may(bounded):
    world = connect(bounded.site.carla_port).load_world("Town10HD_Opt")
    places = [carla.Transform(carla.Location(z=50.0 + index)) for index in range(4)]
    with synchronous(world):
        cameras = [world.spawn_actor(camera(world), place) for place in places[:2]]
        with pytest.raises(RuntimeError, match=r"found 2 cameras .*cameras_per_world = 2.*alice"):
            world.spawn_actor(camera(world), places[2])
        cars = [spawn_car(world, index) for index in range(2)]
        with pytest.raises(RuntimeError, match=r"found 4 actors .*actors_per_world = 4"):
            spawn_car(world, 2)
        library = world.get_blueprint_library()
        box, bird = library.find("static.prop.box01"), library.find("sensor.other.gnss")
        cars.pop().destroy()
        client = connect(bounded.site.carla_port)
        spawns = [
            carla.command.SpawnActor(box, places[3]),
            carla.command.SpawnActor(bird, places[3]),
        ]
        first, second = client.apply_batch_sync(spawns)
        assert not first.error and "actors_per_world = 4" in second.error
        world.get_actor(first.actor_id).destroy()
        for actor in cars + cameras:
            actor.destroy()


def test_pictures_beyond_the_quota_come_later_and_all_of_them(bounded):
    """A program that waits for each picture goes as fast as the quota allows."""
    world = connect(bounded.site.carla_port).load_world("Town10HD_Opt")
    pictures, count = queue.Queue(), 10
    with synchronous(world):
        eye = world.spawn_actor(camera(world), carla.Transform(carla.Location(z=50.0)))
        eye.listen(pictures.put)
        begun = time.monotonic()
        for _ in range(count):
            frame = world.tick()
            while pictures.get(timeout=60.0).frame < frame:
                pass
        taken_secs = time.monotonic() - begun
        eye.destroy()
    # Whatever had gathered came at once, at most two seconds of it.
    assert taken_secs > (count - 4) / 2 - 0.5, taken_secs


def test_recordings_fill_their_folder_and_no_more(bounded):
    client = connect(bounded.site.carla_port)
    world = client.load_world("Town10HD_Opt")
    with synchronous(world):
        path = Path(client.start_recorder("first.log"))
        for _ in range(20):
            world.tick()
        client.stop_recorder()
        eventually("recording", lambda: path.stat().st_size > 1_000)
        (path.parent / "old.log").write_bytes(bytes(1 << 20))
        with pytest.raises(RuntimeError, match=r"recordings_mib = 1 .*remove some"):
            client.start_recorder("second.log")
        (path.parent / "old.log").unlink()
        assert client.start_recorder("second.log").endswith("second.log")
        client.stop_recorder()


def test_an_episode_with_too_many_actors_is_refused_and_the_one_before_goes_on(bounded):
    with causeway.Session(bounded.site.base_url, token=bounded.token) as session:
        session.reset("trolley_saves", seed=2)
        crowd = {"num_npc_vehicles": 10}
        with pytest.raises(causeway.SessionError, match="actors_per_world = 4"):
            session.reset("free_roam", scenario_config=crowd, seed=2)
        assert session.step().observation["scenario_name"] == "trolley_saves"


def test_who_did_what_is_written_down(bounded):
    alice = {"tenant": "alice", "token": "alice-laptop"}
    with causeway.Session(bounded.site.base_url, token=bounded.token) as session:
        session.reset("trolley_saves", seed=2)
    wrong = "cw_alice-laptop_" + "x" * 43
    with pytest.raises(PermissionError):
        causeway.Session(bounded.site.base_url, token=wrong)
    client = connect(bounded.site.carla_port)
    world = client.load_world("Town10HD_Opt")
    boxes = [world.get_blueprint_library().find("static.prop.box01")] * 5
    places = [carla.Transform(carla.Location(z=50.0 + 5.0 * index)) for index in range(5)]
    spawns = [carla.command.SpawnActor(*one) for one in zip(boxes, places, strict=True)]
    refused = [done.error for done in client.apply_batch_sync(spawns)]
    assert not any(refused[:4]) and "actors_per_world = 4" in refused[4], refused
    client.start_recorder("written.log")
    client.stop_recorder()
    for service, members in [
        ("scenario", {**alice, "action": "open session"}),
        ("scenario", {**alice, "action": "close session"}),
        ("scenario", {"action": "enter refused"}),
        ("gateway", {"action": "a CARLA client connects", "tenant": "alice"}),
        ("gateway", {"action": "a recording begins", "tenant": "alice"}),
        ("gateway", {"action": "a recording ends", "tenant": "alice"}),
        ("gateway", {"action": "episode", "tenant": "alice"}),
        ("gateway", {"action": "quota refused", "quota": "actors_per_world", "tenant": "alice"}),
    ]:
        eventually(f"{service} {members}", lambda s=service, m=members: bounded.wrote(s, **m))
    said = bounded.site.said() + "".join(path.read_text() for path in bounded.audit.iterdir())
    assert bounded.token not in said and "x" * 43 not in said
