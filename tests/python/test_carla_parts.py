"""Parts of actors and of the map through CARLA's own client: wheels, bones, lamps, objects."""

import math
import queue

import carla
import pytest

from carla_site import connect, spawn_car, ticks, ticks_until


def spawn_walker(world: carla.World) -> carla.Walker:
    blueprint = world.get_blueprint_library().find("walker.pedestrian.0001")
    place = world.get_map().get_spawn_points()[3]
    place.location.z += 1.0
    return world.spawn_actor(blueprint, place)


def test_loading_a_world_resets_the_settings_unless_told_otherwise(client):
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.02
    world.apply_settings(settings)
    kept = client.reload_world(False).get_settings()
    assert kept.synchronous_mode and kept.fixed_delta_seconds == pytest.approx(0.02)
    fresh_settings = client.reload_world().get_settings()
    assert not fresh_settings.synchronous_mode
    client.get_world().wait_for_tick()


def test_a_heading_of_half_a_turn_stays_positive(world):
    place = world.get_map().get_spawn_points()[0]
    place.rotation = carla.Rotation(yaw=180.0)
    place.location.z += 5.0
    prop = world.get_blueprint_library().find("static.prop.streetbarrier")
    for yaw in (180.0, -180.0):
        place.rotation.yaw = yaw
        actor = world.spawn_actor(prop, place)
        world.tick()
        assert actor.get_transform().rotation.yaw == pytest.approx(180.0, abs=1e-3)
        actor.destroy()


def test_two_wheelers_have_four_wheels_of_physics(world):
    blueprint = world.get_blueprint_library().find("vehicle.kawasaki.ninja")
    ninja = world.spawn_actor(blueprint, world.get_map().get_spawn_points()[0])
    world.tick()
    physics = ninja.get_physics_control()
    assert len(physics.wheels) == 4
    wheels = physics.wheels
    for wheel in wheels:
        wheel.tire_friction = 0.7
    physics.wheels = wheels
    ninja.apply_physics_control(physics)
    world.tick()
    assert [wheel.tire_friction for wheel in ninja.get_physics_control().wheels] == pytest.approx(
        [0.7] * 4
    )
    ticks(world, 40)
    telemetry = ninja.get_telemetry_data()
    carried = sum(wheel.tire_load for wheel in telemetry.wheels)
    assert carried == pytest.approx(physics.mass * 9.81, rel=0.1)


def test_numbers_may_be_written_with_a_point(world):
    blueprint = world.get_blueprint_library().find("sensor.lidar.ray_cast")
    blueprint.set_attribute("channels", "16.0")
    lidar = world.spawn_actor(blueprint, carla.Transform(carla.Location(z=30.0)))
    assert lidar.attributes["channels"] == "16"


def test_every_walker_may_be_asked_to_use_a_wheelchair(world):
    library = world.get_blueprint_library().filter("walker.pedestrian.*")
    unable = next(one for one in library if not one.get_attribute("can_use_wheelchair").as_bool())
    unable.set_attribute("use_wheelchair", "true")
    place = world.get_map().get_spawn_points()[3]
    place.location.z += 1.0
    assert world.spawn_actor(unable, place).is_alive


def test_wheels_steer_by_ackermann_and_are_held_without_physics(world):
    car = spawn_car(world)
    car.apply_control(carla.VehicleControl(steer=1.0, hand_brake=True))
    ticks(world, 40)
    wheel = carla.VehicleWheelLocation
    left, right, rear = (
        car.get_wheel_steer_angle(at) for at in (wheel.FL_Wheel, wheel.FR_Wheel, wheel.BL_Wheel)
    )
    assert right > left > 10.0 and rear == 0.0
    for physics, held in ((True, left), (False, -20.0), (True, left)):
        car.set_simulate_physics(physics)
        car.set_wheel_steer_direction(wheel.FL_Wheel, -20.0)
        car.set_wheel_pitch_angle(wheel.FR_Wheel, 5.0)
        world.tick()
        assert car.get_wheel_steer_angle(wheel.FL_Wheel) == pytest.approx(held, abs=2.0)
        pitch = car.get_wheel_pitch_angle(wheel.FR_Wheel)
        assert pitch == pytest.approx(0.0 if physics else 5.0, abs=2.0 if physics else 1e-6)


def test_bones_of_a_car_are_where_its_wheels_are(world):
    car = spawn_car(world)
    ticks(world, 10)
    names = car.get_bone_names()
    assert len(names) == len(car.get_bone_world_transforms()) == 5
    place = car.get_transform().location
    hubs = car.get_vehicle_bone_world_transforms()[1:]
    assert all(0.9 < hub.location.distance(place) < 2.5 for hub in hubs)


def test_wheels_roll_as_far_as_the_car_drives(world):
    car = spawn_car(world)
    radius_m = car.get_physics_control().wheels[2].radius / 100.0
    rear = (carla.VehicleWheelLocation.BL_Wheel, carla.VehicleWheelLocation.BR_Wheel)
    car.apply_control(carla.VehicleControl(throttle=0.6))
    ticks(world, 40)
    place, turned = car.get_location(), [car.get_wheel_pitch_angle(wheel) for wheel in rear]
    bones = car.get_vehicle_bone_world_transforms()[3:5]
    for wheel, bone in zip(rear, bones, strict=True):
        up = math.cos(math.radians(car.get_wheel_pitch_angle(wheel)))
        assert bone.get_up_vector().z == pytest.approx(up, abs=0.02)
    world.tick()
    driven_m = car.get_location().distance(place)
    assert 0.1 < driven_m < math.tau * radius_m / 2.0
    for wheel, before in zip(rear, turned, strict=True):
        rolled = (before - car.get_wheel_pitch_angle(wheel)) % 1800.0
        assert math.radians(rolled) * radius_m == pytest.approx(driven_m, rel=0.02)


def test_bones_of_wheels_stand_as_they_are_held(world):
    car = spawn_car(world)
    car.set_simulate_physics(False)
    world.tick()
    wheel = carla.VehicleWheelLocation
    assert car.get_wheel_pitch_angle(wheel.FL_Wheel) == 0.0
    car.set_wheel_steer_direction(wheel.FL_Wheel, 20.0)
    car.set_wheel_pitch_angle(wheel.BR_Wheel, 30.0)
    world.tick()
    bones = car.get_bone_relative_transforms()
    turned = [(bone.rotation.pitch, bone.rotation.yaw, bone.rotation.roll) for bone in bones]
    wanted = [(0.0, 0.0, 0.0) for _ in bones]
    wanted[1], wanted[4] = (0.0, 20.0, 0.0), (30.0, 0.0, 0.0)
    for angles, expected in zip(turned, wanted, strict=True):
        assert angles == pytest.approx(expected, abs=1e-3)


def test_components_of_a_car_are_where_its_body_has_them(world):
    car = spawn_car(world)
    ticks(world, 10)
    names = car.get_component_names()
    assert names[:2] == ["VehicleMesh", "VehicleBounds"]
    here = car.get_transform()
    for name in names[1:]:
        relative = car.get_component_relative_transform(name).location
        inside = carla.BoundingBox(car.bounding_box.location, car.bounding_box.extent)
        assert inside.contains(relative, carla.Transform()), name
        at = car.get_component_world_transform(name).location
        assert at.distance(here.transform(relative)) < 0.01, name
    blinker = car.get_component_relative_transform("front-blinker-r-1").location
    assert blinker.x > 1.5 and blinker.y > 0.5
    mesh = car.get_component_relative_transform("VehicleMesh")
    assert mesh.location.distance(here.location) < 0.01
    assert car.get_socket_names() == car.get_bone_names()
    relatives, worlds = car.get_socket_relative_transforms(), car.get_socket_world_transforms()
    for relative, at in zip(relatives, worlds, strict=True):
        assert at.location.distance(here.transform(relative.location)) < 0.01
    with pytest.raises(RuntimeError, match="fifth-wheel"):
        car.get_component_world_transform("fifth-wheel")


def test_a_walkers_bones_walk_with_it(world):
    walker = spawn_walker(world)
    ticks(world, 30)
    bones = {bone.name: bone for bone in walker.get_bones().bone_transforms}
    head, foot = bones["crl_Head__C"].world.location, bones["crl_foot__L"].world.location
    assert 1.2 < head.z - foot.z < 1.9
    assert head.distance_2d(walker.get_location()) < 0.2
    walker.apply_control(carla.WalkerControl(walker.get_transform().get_forward_vector(), 1.5))
    strides = set()
    for _ in range(30):
        world.tick()
        bones = {bone.name: bone for bone in walker.get_bones().bone_transforms}
        apart = bones["crl_foot__L"].world.location - bones["crl_foot__R"].world.location
        strides.add(round(apart.dot(walker.get_transform().get_forward_vector()), 2))
    assert max(strides) > 0.2 and min(strides) < -0.2


def test_a_pose_of_bones_is_told_as_far_as_it_is_blended(world):
    walker = spawn_walker(world)
    ticks(world, 10)
    raised = carla.Transform(carla.Location(z=0.5))
    walker.set_bones(carla.WalkerBoneControlIn([("crl_neck__C", raised)]))
    world.tick()

    def neck() -> float:
        bones = walker.get_bones().bone_transforms
        return next(bone.relative.location.z for bone in bones if bone.name == "crl_neck__C")

    own = neck()
    walker.show_pose()
    world.tick()
    assert neck() == pytest.approx(0.5, abs=1e-4)
    walker.blend_pose(0.5)
    world.tick()
    assert neck() == pytest.approx((own + 0.5) / 2, abs=1e-4)


def raise_arm(walker: carla.Walker) -> None:
    """The right arm straight out to the side."""
    aside = carla.Transform(carla.Location(y=0.17), carla.Rotation(roll=-90.0))
    walker.set_bones(carla.WalkerBoneControlIn([("crl_arm__R", aside)]))
    walker.blend_pose(1.0)


def test_lidars_meet_a_raised_arm_where_the_bones_say_it_is(site, world):
    walker = spawn_walker(world)
    ticks(world, 10)
    blueprint = world.get_blueprint_library().find("sensor.lidar.ray_cast_semantic")
    for name, value in {
        "channels": "64",
        "points_per_second": "1000000",
        "rotation_frequency": "20",
        "upper_fov": "20",
        "lower_fov": "-20",
    }.items():
        blueprint.set_attribute(name, value)
    place = walker.get_transform()
    place.location += 3.0 * place.get_forward_vector()
    lidar = world.spawn_actor(blueprint, place)
    measured = queue.Queue()
    lidar.listen(measured.put)

    def points_aside() -> list[carla.Location]:
        """On the walker, out to its right, in the world."""
        world.tick()
        while (scan := measured.get(timeout=30.0)).frame < world.get_snapshot().frame:
            pass
        here = walker.get_transform()
        met = [place.transform(one.point) for one in scan if one.object_idx == walker.id]
        right = here.get_right_vector()
        return [point for point in met if (point - here.location).dot(right) > 0.4]

    assert not points_aside()
    raise_arm(walker)
    points = points_aside()
    assert len(points) > 10
    # Another client is told of the same bones.
    other = connect(site.carla_port).get_world().get_actor(walker.id)
    bones = {bone.name: bone.world.location for bone in other.get_bones().bone_transforms}
    elbow, hand = bones["crl_foreArm__R"], bones["crl_handMiddleEnd__R"]
    along = hand - elbow
    for point in points:
        share = (point - elbow).dot(along) / along.dot(along)
        nearest = elbow + min(max(share, 0.0), 1.0) * along
        assert point.distance(nearest) < 0.12
    walker.hide_pose()
    assert not points_aside()
    lidar.stop()


def test_friction_triggers_hold_inside_their_box(world):
    car = spawn_car(world)
    ticks(world, 5)
    own = car.get_physics_control().wheels[0].tire_friction
    blueprint = world.get_blueprint_library().find("static.trigger.friction")
    for name, value in {
        "friction": "0.2",
        "extent_x": "500",
        "extent_y": "500",
        "extent_z": "500",
    }.items():
        blueprint.set_attribute(name, value)
    trigger = world.spawn_actor(blueprint, car.get_transform())
    world.tick()
    assert car.get_physics_control().wheels[0].tire_friction == pytest.approx(0.2)
    trigger.destroy()
    world.tick()
    assert car.get_physics_control().wheels[0].tire_friction == pytest.approx(own)


def test_street_lights_burn_by_night_and_obey(site, world):
    world.tick()
    # A client keeps the lights of every map that it has seen.
    manager = connect(site.carla_port).get_world().get_lightmanager()
    lights = manager.get_all_lights(carla.LightGroup.Street)
    assert len(lights) > 20 and not any(light.is_on for light in lights)
    weather = world.get_weather()
    weather.sun_altitude_angle = -30.0
    world.set_weather(weather)
    ticks_until(world, lambda: all(light.is_on for light in manager.get_all_lights()))
    lights = manager.get_all_lights(carla.LightGroup.Street)
    assert all(light.is_on for light in lights)
    manager.set_day_night_cycle(False)
    manager.turn_off(lights[:3])
    wanted = [False] * 3 + [True]
    ticks_until(world, lambda: [one.is_on for one in manager.get_all_lights()[:4]] == wanted)
    assert [one.is_on for one in manager.get_all_lights()[:4]] == wanted


def test_the_map_tells_its_objects_with_boxes(world):
    label = carla.CityObjectLabel
    for tag in (label.Buildings, label.Vegetation, label.TrafficLight, label.Roads, label.Poles):
        objects = world.get_environment_objects(tag)
        assert objects and all(one.type == tag for one in objects)
        assert len(world.get_level_bbs(tag)) == len(objects)
    ids = [one.id for one in world.get_environment_objects(label.Any)]
    assert len(set(ids)) == len(ids)


def test_gravity_of_inertial_sensors_can_be_set(world):

    car = spawn_car(world)
    ticks(world, 40)
    blueprint = world.get_blueprint_library().find("sensor.other.imu")
    imu = world.spawn_actor(blueprint, carla.Transform(), attach_to=car)
    measured = queue.Queue()
    imu.listen(measured.put)
    world.set_imui_sensor_gravity(3.7)
    assert world.get_imui_sensor_gravity() == pytest.approx(3.7)
    world.tick()
    assert measured.get(timeout=30.0).accelerometer.z == pytest.approx(3.7, abs=0.2)
    world.set_imui_sensor_gravity(9.81)
    imu.stop()


def test_long_frames_give_one_scan_each(world):

    settings = world.get_settings()
    settings.fixed_delta_seconds = 0.2
    world.apply_settings(settings)
    blueprint = world.get_blueprint_library().find("sensor.lidar.ray_cast_semantic")
    blueprint.set_attribute("points_per_second", "10000")
    blueprint.set_attribute("range", "200")
    place = world.get_map().get_spawn_points()[0]
    place.location.z += 2.0
    lidar = world.spawn_actor(blueprint, place)
    measured = queue.Queue()
    lidar.listen(measured.put)
    frames = [world.tick() for _ in range(3)]
    scans = [measured.get(timeout=30.0) for _ in frames]
    assert [scan.frame for scan in scans] == frames and measured.empty()
    assert 1_000 < len(scans[-1]) <= 2_000
    assert math.isclose(sum(scans[-1].get_point_count(at) for at in range(32)), len(scans[-1]))
    lidar.stop()


def test_boxes_of_the_level_have_those_of_props(world):
    blueprint = world.get_blueprint_library().find("static.prop.container")
    prop = world.spawn_actor(blueprint, world.get_map().get_spawn_points()[5])
    world.tick()
    (box,) = [box for box in world.get_level_bbs() if box.actor_id == prop.id]
    own = prop.bounding_box.get_world_vertices(prop.get_transform())
    found = box.get_world_vertices(carla.Transform())
    assert all(a.distance(b) < 0.01 for a, b in zip(own, found, strict=True))
    prop.destroy()


def test_boxes_of_the_level_have_those_of_vehicles_and_walkers(world):
    label = carla.CityObjectLabel
    assert not world.get_level_bbs(label.Car) and not world.get_level_bbs(label.Pedestrians)
    of_map = len(world.get_level_bbs())
    car, walker = spawn_car(world), spawn_walker(world)
    ticks(world, 3)
    for actor, its_label in ((car, label.Car), (walker, label.Pedestrians)):
        (box,) = world.get_level_bbs(its_label)
        own = actor.bounding_box.get_world_vertices(actor.get_transform())
        found = box.get_world_vertices(carla.Transform())
        assert all(a.distance(b) < 0.01 for a, b in zip(own, found, strict=True))
    assert len(world.get_level_bbs()) == of_map + 2
    car.destroy()
    walker.destroy()
    world.tick()
    assert not world.get_level_bbs(label.Car) and not world.get_level_bbs(label.Pedestrians)
