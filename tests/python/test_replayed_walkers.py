"""What a replay shows of walkers."""

import itertools

import carla
import pytest

import carla_log
from carla_log import BONES
from carla_site import ticks
from recorded_drive import finished, is_near, shows


def test_walkers_walk_again_as_they_did_with_all_their_bones(client, world, tmp_path):
    path = tmp_path / "walk.log"
    place = world.get_map().get_spawn_points()[0].location + carla.Location(z=1.0)
    blueprint = world.get_blueprint_library().find("walker.pedestrian.0005")
    client.start_recorder(str(path), True)
    walker = world.spawn_actor(blueprint, carla.Transform(place))
    walker.apply_control(carla.WalkerControl(carla.Vector3D(x=1.0), 1.5))
    ticks(world, 20)
    walker.blend_pose(1.0)
    waving = carla.Transform(carla.Location(x=0.3), carla.Rotation(roll=75.0))
    walker.set_bones(carla.WalkerBoneControlIn([("crl_arm__R", waving)]))
    ticks(world, 20)
    log = finished(client, path)
    frames = log.frames
    assert frames[30].by_actor(carla_log.WALKER)[walker.id] == (150.0,)
    velocity = frames[15].by_actor(carla_log.KINEMATICS)[walker.id]
    assert velocity[0] == pytest.approx(1.5, abs=0.05)
    names = [name for name, _ in frames[30].by_actor(BONES)[walker.id][0]]
    assert {"crl_root", "crl_Head__C", "crl_arm__R"} <= set(names)
    walker.destroy()
    world.tick()
    client.replay_file(str(path), 0.0, 0.0, 0)
    world.tick()
    walker = world.get_actor(walker.id)
    for number in (2, 12, 30):
        while not shows(world, frames[number], [walker.id]):
            assert world.tick() and not shows(world, frames[39], [walker.id])
        wanted = dict(frames[number].by_actor(BONES)[walker.id][0])
        held = {bone.name: bone.relative for bone in walker.get_bones().bone_transforms}
        assert held.keys() == wanted.keys()
        assert all(is_near(wanted[name], held[name]) for name in wanted)
    ticks(world, 20)
    assert walker.get_control().speed == 0.0
    held = {bone.name: bone.relative for bone in walker.get_bones().bone_transforms}
    assert not is_near(wanted["crl_arm__R"], held["crl_arm__R"]), "the replay holds its arm no more"


def test_limbs_swing_in_the_time_of_the_world_however_fast_the_replay_is(client, world, tmp_path):
    path = tmp_path / "walk.log"
    place = world.get_map().get_spawn_points()[0].location + carla.Location(z=1.0)
    blueprint = world.get_blueprint_library().find("walker.pedestrian.0005")
    # Without additional data there are no limbs in the log.
    client.start_recorder(str(path))
    walker = world.spawn_actor(blueprint, carla.Transform(place))
    walker.apply_control(carla.WalkerControl(carla.Vector3D(x=1.0), 1.5))
    ticks(world, 60)
    finished(client, path)
    walker.destroy()
    world.tick()

    def swings(factor: float) -> tuple[list[float], float]:
        """Angles of a leg in successive frames, and how far the walker came meanwhile."""
        client.set_replayer_time_factor(factor)
        client.replay_file(str(path), 1.0, 0.0, 0)
        ticks(world, 2)
        (again,) = world.get_actors().filter("walker.*")
        begin, angles = again.get_location(), []
        for _ in range(10):
            world.tick()
            bones = {bone.name: bone.relative for bone in again.get_bones().bone_transforms}
            angles.append(bones["crl_thigh__L"].rotation.pitch)
        way_m = again.get_location().distance(begin)
        client.stop_replayer(False)
        again.destroy()
        world.tick()
        return angles, way_m

    try:
        usual, usual_m = swings(1.0)
        fast, fast_m = swings(1.9)
    finally:
        client.set_replayer_time_factor(1.0)
    assert fast_m == pytest.approx(1.9 * usual_m, rel=0.1)
    turned = [b - a for a, b in itertools.pairwise(usual)]
    assert max(map(abs, turned)) > 1.0
    assert fast == pytest.approx(usual, abs=1.0)
