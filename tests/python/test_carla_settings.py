"""Settings, weather, time stamps and snapshots of a world through CARLA's own client."""

import threading
import time

import carla
import pytest

from carla_site import STEP_SECS, connect, spawn_car, synchronous, ticks

SOON_SECS = 30.0

PRESETS = {
    name: preset
    for name, preset in vars(carla.WeatherParameters).items()
    if isinstance(preset, carla.WeatherParameters)
}
WEATHER = {
    "cloudiness": 11.0,
    "precipitation": 12.0,
    "precipitation_deposits": 13.0,
    "wind_intensity": 14.0,
    "sun_azimuth_angle": 15.0,
    "sun_altitude_angle": -16.0,
    "fog_density": 17.0,
    "fog_distance": 18.0,
    "fog_falloff": 1.5,
    "wetness": 20.0,
    "scattering_intensity": 0.5,
    "mie_scattering_scale": 0.25,
    "rayleigh_scattering_scale": 0.125,
    "dust_storm": 24.0,
}
SETTINGS = {
    "no_rendering_mode": True,
    "substepping": True,
    "max_substep_delta_time": 0.02,
    "max_substeps": 8,
    "max_culling_distance": 123.0,
    "deterministic_ragdolls": False,
    "tile_stream_distance": 1500.0,
    "actor_active_distance": 1200.0,
    "spectator_as_ego": False,
}


def test_every_field_of_the_settings_comes_back(world):
    settings = world.get_settings()
    assert (settings.synchronous_mode, settings.fixed_delta_seconds) == (True, STEP_SECS)
    for name, value in SETTINGS.items():
        assert getattr(settings, name) != value or name == "substepping"
        setattr(settings, name, value)
    world.apply_settings(settings)
    found = world.get_settings()
    for name, value in SETTINGS.items():
        assert getattr(found, name) == pytest.approx(value), name


def test_tiles_are_there_as_far_as_actors_are_active(world):
    settings = world.get_settings()
    settings.tile_stream_distance, settings.actor_active_distance = 1000.0, 1500.0
    world.apply_settings(settings)
    found = world.get_settings()
    assert (found.tile_stream_distance, found.actor_active_distance) == (1500.0, 1500.0)


def test_applying_settings_returns_a_frame_that_has_been(world):
    before = world.tick()
    assert world.apply_settings(world.get_settings()) >= before
    assert world.get_snapshot().frame >= before


def test_a_step_too_long_for_its_substeps_is_warned_of_and_taken(world, capfd):
    settings = world.get_settings()
    settings.fixed_delta_seconds = 0.5
    assert 0.5 > settings.max_substep_delta_time * settings.max_substeps
    world.apply_settings(settings)
    assert "max_substep_delta_time * max_substeps" in "".join(capfd.readouterr())
    world.tick()
    assert world.get_snapshot().delta_seconds == 0.5


def test_without_a_fixed_step_a_tick_takes_the_time_that_passed(world):
    settings = world.get_settings()
    settings.fixed_delta_seconds = None
    world.apply_settings(settings)
    started = time.monotonic()
    world.tick()
    time.sleep(0.05)
    world.tick()
    passed = time.monotonic() - started
    assert 0.045 <= world.get_snapshot().delta_seconds <= passed


def test_every_field_of_the_weather_comes_back(world):
    world.set_weather(carla.WeatherParameters(**WEATHER))
    world.tick()
    found = world.get_weather()
    assert {name: getattr(found, name) for name in WEATHER} == pytest.approx(WEATHER)


def test_all_presets_of_the_weather_come_back(world):
    assert len(PRESETS) == 23
    found = {}
    for name, preset in PRESETS.items():
        world.set_weather(preset)
        found[name] = world.get_weather()
    assert found == PRESETS


def test_weather_is_that_of_the_world_for_all_clients(site, world):
    world.set_weather(carla.WeatherParameters.WetNight)
    world.tick()
    assert connect(site.carla_port).get_world().get_weather() == carla.WeatherParameters.WetNight


@pytest.mark.parametrize("step_secs", [0.05, 0.01, 1 / 30])
def test_a_hundred_ticks_take_a_hundred_steps(client, step_secs):
    with synchronous(client.get_world(), step_secs) as world:
        world.tick()
        first = world.get_snapshot().timestamp
        ticks(world, 100)
        last = world.get_snapshot().timestamp
    assert last.delta_seconds == pytest.approx(step_secs, abs=1e-8)
    assert last.elapsed_seconds - first.elapsed_seconds == pytest.approx(100 * step_secs, abs=1e-6)
    assert (last.frame, last.frame_count) == (first.frame + 100, first.frame_count + 100)
    assert last.platform_timestamp > first.platform_timestamp


def test_a_snapshot_tells_of_all_actors_what_they_tell_themselves(world):
    car = spawn_car(world)
    car.apply_control(carla.VehicleControl(throttle=1.0, steer=0.2))
    ticks(world, 40)
    snapshot = world.get_snapshot()
    assert snapshot.id == world.id
    assert {one.id for one in snapshot} == {actor.id for actor in world.get_actors()}
    assert len(snapshot) == len(world.get_actors())
    told = snapshot.find(car.id)
    assert (told.get_transform(), told.get_velocity()) == (car.get_transform(), car.get_velocity())
    assert told.get_angular_velocity() == car.get_angular_velocity()
    assert told.get_acceleration() == car.get_acceleration()
    assert snapshot.has_actor(car.id) and not snapshot.has_actor(2**31)
    assert snapshot.find(2**31) is None


def test_velocity_and_acceleration_are_what_positions_change_by(world):
    car = spawn_car(world)
    ticks(world, 20)
    car.apply_control(carla.VehicleControl(throttle=0.8))
    # Past the first gear's jerk.
    ticks(world, 20)
    before = world.get_snapshot().find(car.id)
    world.tick()
    after = world.get_snapshot().find(car.id)
    way = (after.get_transform().location - before.get_transform().location) / STEP_SECS
    assert after.get_velocity().x == pytest.approx(way.x, abs=0.2)
    change = (after.get_velocity() - before.get_velocity()) / STEP_SECS
    assert change.length() > 1.0
    assert (after.get_acceleration() - change).length() < 0.05


def test_callbacks_of_ticks_come_once_a_frame_until_they_are_removed(world):
    frames, other = [], []
    # The callbacks of this frame may come when it has been seen.
    before = world.tick()
    callback = world.on_tick(lambda snapshot: frames.append(snapshot.frame))
    kept = world.on_tick(lambda snapshot: other.append(snapshot.frame))
    wanted = [world.tick() for _ in range(10)]
    deadline = time.monotonic() + SOON_SECS
    while frames[-1:] != wanted[-1:] and time.monotonic() < deadline:
        time.sleep(0.01)
    assert [frame for frame in frames if frame > before] == wanted
    world.remove_on_tick(callback)
    last = ticks(world, 5)
    while other[-1:] != [last] and time.monotonic() < deadline:
        time.sleep(0.01)
    assert frames[-1:] == wanted[-1:]
    assert [frame for frame in other if frame > before] == list(range(before + 1, last + 1))
    world.remove_on_tick(kept)


def test_who_waits_for_a_tick_gets_its_snapshot(site, world):
    other, found = connect(site.carla_port).get_world(), []
    # Whoever comes is told the newest frame first.
    deadline = time.monotonic() + SOON_SECS
    while other.get_snapshot().frame < world.get_snapshot().frame:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    waiting = threading.Thread(target=lambda: found.append(other.wait_for_tick(SOON_SECS)))
    waiting.start()
    frames, deadline = [], time.monotonic() + SOON_SECS
    # The first ticks may come before anybody waits.
    while waiting.is_alive() and time.monotonic() < deadline:
        frames.append(world.tick())
        waiting.join(0.2)
    assert len(found) == 1 and found[0].frame in frames


def test_waiting_for_a_tick_that_nobody_gives_times_out_in_carlas_words(world):
    # Who waits for the frame of the last tick may still be about to be told.
    with pytest.raises(RuntimeError, match="time-out of 300ms while waiting for the simulator"):
        for _ in range(3):
            world.wait_for_tick(0.3)


def test_a_synchronous_world_stands_still_and_runs_again_when_released(client):
    with synchronous(client.get_world()) as world:
        frame = world.tick()
        time.sleep(0.5)
        assert world.get_snapshot().frame == frame
        assert world.tick() == frame + 1
    # It times out when no more come.
    while world.wait_for_tick(SOON_SECS).frame <= frame + 1:
        pass


def test_an_asynchronous_world_with_a_fixed_step_takes_that_step(client):
    world = client.get_world()
    settings = world.get_settings()
    settings.fixed_delta_seconds = 0.02
    world.apply_settings(settings)
    snapshots = [world.wait_for_tick() for _ in range(3)]
    assert [one.delta_seconds for one in snapshots] == pytest.approx([0.02] * 3, abs=1e-8)
    settings.fixed_delta_seconds = None
    world.apply_settings(settings)
    assert world.get_settings().fixed_delta_seconds in (None, 0.0)


def test_a_world_that_was_replaced_shows_the_new_one_and_its_actors_are_gone(client):
    old = client.get_world()
    car = spawn_car(old)
    fresh = client.reload_world()
    assert fresh.id == old.id + 1
    assert old.get_snapshot().id == old.wait_for_tick().id == fresh.id
    assert fresh.get_actor(car.id) is None and not car.is_alive
    with pytest.raises(RuntimeError, match=str(car.id)):
        car.get_physics_control()
    assert len(fresh.get_actors().filter("vehicle.*")) == 0
