"""Cars of CARLA's clients answer the throttle as CARLA's cars do."""

import math

import carla
import pytest

import carla_log
from carla_site import synchronous, ticks

STEP_SECS = 0.01
#: Throttle, and the speed in m/s that CARLA's Tesla Model 3 holds with it.
HELD = [(0.193, 3.40), (0.264, 5.00), (0.423, 9.95), (0.515, 14.75)]

#: Gear, throttle, speed in m/s, and what CARLA's Lincoln MKZ 2017 gained or lost there in m/s²,
#: from `DistanceBetweenVehicles.log` and `DistanceToLaneCenter.log` of scenario_runner's metrics.
RECORDED = [
    (1, 1.0, 4.3, 6.7),
    (3, 1.0, 12.7, 5.1),
    (4, 1.0, 16.7, 4.4),
    (2, 0.0, 8.0, -4.0),
    (3, 0.0, 11.8, -3.0),
]


@pytest.fixture
def motorway(client):
    """A world of steps as short as those of CARLA's physics, and the start of a straight road."""
    with synchronous(client.load_world("Town06"), STEP_SECS) as world:
        starts = world.get_map().get_spawn_points()
        lanes = [world.get_map().get_waypoint(start.location) for start in starts]
        yield world, max(zip(starts, lanes, strict=True), key=lambda one: straight(one[1]))[0]


def straight(lane: carla.Waypoint, most: float = 500.0) -> float:
    """How far a lane leads straight on, in metres."""
    direction, length = lane.transform.get_forward_vector(), 0.0
    while length < most:
        (lane, *others) = lane.next(20.0) or [None]
        if lane is None or others:
            break
        if direction.dot(lane.transform.get_forward_vector()) < math.cos(math.radians(0.5)):
            break
        length += 20.0
    return length


def spawn(motorway, blueprint: str) -> carla.Vehicle:
    world, start = motorway
    car = world.spawn_actor(world.get_blueprint_library().find(blueprint), start)
    ticks(world, 100)
    return car


def speed(velocity) -> float:
    return math.hypot(velocity.x, velocity.y)


def test_each_throttle_holds_the_speed_that_it_holds_in_carla(motorway):
    world, start = motorway
    car = spawn(motorway, "vehicle.tesla.model3")
    for throttle, held in HELD:
        car.set_target_velocity(held * start.get_forward_vector())
        car.apply_control(carla.VehicleControl(throttle=throttle))
        ticks(world, 800)
        assert speed(car.get_velocity()) == pytest.approx(held, rel=0.08), throttle


def test_a_closed_throttle_brakes(motorway):
    """By 2 to 5 m/s² in the mean of a second."""
    world, start = motorway
    for blueprint in ("vehicle.tesla.model3", "vehicle.lincoln.mkz_2020", "vehicle.audi.tt"):
        car = spawn(motorway, blueprint)
        car.set_target_velocity(10.0 * start.get_forward_vector())
        ticks(world, 100)
        assert 5.0 < speed(car.get_velocity()) < 8.0, blueprint
        car.destroy()


def test_the_box_changes_down_at_the_speeds_of_a_recording(motorway):
    """4 to 3, 3 to 2 and 2 to 1 of the Lincoln with a closed throttle, in m/s."""
    world, start = motorway
    car = spawn(motorway, "vehicle.lincoln.mkz_2017")
    car.set_target_velocity(15.0 * start.get_forward_vector())
    changes, gear = {}, 9
    for _ in range(600):
        world.tick()
        now = car.get_control().gear
        if 0 < now < gear:
            changes[now], gear = speed(car.get_velocity()), now
    for gear, recorded_speed in ((3, 13.7), (2, 11.1), (1, 7.3)):
        assert changes[gear] == pytest.approx(recorded_speed, rel=0.1), changes


@pytest.mark.parametrize(("gear", "throttle", "at", "recorded"), RECORDED)
def test_a_gear_pulls_and_brakes_as_in_a_recording(motorway, gear, throttle, at, recorded):
    world, start = motorway
    car = spawn(motorway, "vehicle.lincoln.mkz_2017")
    # So much earlier that engine and tyres have settled when it comes to that speed.
    begin = at - 0.5 * recorded
    car.set_target_velocity(begin * start.get_forward_vector())
    control = carla.VehicleControl(throttle=throttle, manual_gear_shift=True, gear=gear)
    car.apply_control(control)
    speeds = [begin]
    while (speeds[-1] - at) * recorded < 0.0 and len(speeds) < 300:
        world.tick()
        speeds.append(speed(car.get_velocity()))
    ticks(world, 10)
    found = (speed(car.get_velocity()) - speeds[-11]) / (20 * STEP_SECS)
    assert found == pytest.approx(recorded, rel=0.2)


def test_a_car_stands_in_neutral_until_its_engine_has_revved_up(motorway):
    """CARLA's Lincoln moves 0.5 s after the pedal is down, with the gear of the recording."""
    world, _ = motorway
    car = spawn(motorway, "vehicle.lincoln.mkz_2017")
    assert car.get_control().gear == 0
    car.apply_control(carla.VehicleControl(throttle=1.0))
    still = 0
    while speed(car.get_velocity()) < 0.1 and still < 100:
        world.tick()
        still += 1
    assert still * STEP_SECS == pytest.approx(0.5, abs=0.15)
    assert car.get_control().gear == 1


def test_little_throttle_moves_a_car_that_has_stood_for_long(motorway):
    """Its body sleeps by then, and goes on doing so while the engine revs up."""
    world, _ = motorway
    car = spawn(motorway, "vehicle.lincoln.mkz_2017")
    ticks(world, 200)
    car.apply_control(carla.VehicleControl(throttle=0.2))
    ticks(world, 300)
    assert speed(car.get_velocity()) > 0.3


def test_the_engine_pushes_the_car_after_a_change_up(motorway):
    """By 10 to 15 m/s² when the Lincoln's box comes to the second gear, after 0.1 s in neutral."""
    world, _ = motorway
    car = spawn(motorway, "vehicle.lincoln.mkz_2017")
    car.apply_control(carla.VehicleControl(throttle=1.0))
    speeds, gears = [], []
    while len(gears) < 400 and gears[-8:] != [2] * 8:
        world.tick()
        speeds.append(speed(car.get_velocity()))
        gears.append(car.get_control().gear)
    between = gears[gears.index(1) : gears.index(2)].count(0)
    assert between * STEP_SECS == pytest.approx(0.1, abs=0.021)
    push = max(later - now for now, later in zip(speeds[-8:], speeds[-7:], strict=False))
    assert push / STEP_SECS == pytest.approx(12.5, abs=2.5)


def test_the_pedals_of_a_recording_give_its_speeds(motorway):
    """From the first touch of the throttle, through five gears, up to 18 m/s."""
    world, _ = motorway
    log = carla_log.read(carla_log.genuine("DistanceToLaneCenter"))
    lincoln = next(actor[0] for actor in log.frames[0].records[carla_log.ADD] if "mkz" in actor[4])
    frames = [frame for frame in log.frames if lincoln in frame.by_actor(carla_log.CONTROL)]
    pedals = [frame.by_actor(carla_log.CONTROL)[lincoln] for frame in frames]
    first = next(index for index, control in enumerate(pedals) if control[1] > 0.0)
    car = spawn(motorway, "vehicle.lincoln.mkz_2017")
    now, squares = frames[first].elapsed, []
    for frame, (_, throttle, brake, *_) in zip(frames[first:], pedals[first:], strict=True):
        while now < frame.elapsed:
            world.tick()
            now += STEP_SECS
        recorded = math.hypot(*frame.by_actor(carla_log.KINEMATICS)[lincoln][:2])
        squares.append((speed(car.get_velocity()) - recorded) ** 2)
        car.apply_control(carla.VehicleControl(throttle=throttle, brake=brake))
    assert math.sqrt(sum(squares) / len(squares)) < 0.8
