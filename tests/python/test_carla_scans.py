"""Lidars and radars measure what their attributes ask for, through CARLA's own client."""

import math

import carla
import numpy as np
import pytest

from carla_site import attach, spawn_car, ticks

WAIT_SECS = 30.0
HIGH = 2.0
LIDAR, SEMANTIC = "sensor.lidar.ray_cast", "sensor.lidar.ray_cast_semantic"
EXACT = {
    "dropoff_general_rate": "0",
    "dropoff_intensity_limit": "1",
    "dropoff_zero_intensity": "0",
    "range": "100",
    "rotation_frequency": "20",
    "points_per_second": "64000",
}


def above_the_road(world: carla.World, high_m: float = HIGH) -> carla.Transform:
    point = world.get_map().get_spawn_points()[0]
    ground = world.ground_projection(point.location, 5.0).location
    return carla.Transform(ground + carla.Location(z=high_m), carla.Rotation())


def scan_of(world: carla.World, kind: str, place: carla.Transform, **attributes: str):
    sensor, measured = attach(world, None, kind, place, **attributes)
    world.tick()
    scan = measured.get(timeout=WAIT_SECS)
    sensor.destroy()
    return scan


def rows(scan: carla.LidarMeasurement) -> np.ndarray:
    """Rows of x, y, z, intensity; the client keeps its own only as long as the scan."""
    return np.frombuffer(scan.raw_data, np.float32).reshape(-1, 4).copy()


def downwards(**attributes: str) -> dict[str, str]:
    """All rays meet the ground near by."""
    return {**EXACT, "channels": "4", "upper_fov": "-40", "lower_fov": "-70", **attributes}


def test_channels_are_spread_from_the_upper_limit_to_the_lower(world):
    scan = scan_of(world, LIDAR, above_the_road(world), **downwards())
    points = rows(scan)
    assert scan.channels == 4
    assert [scan.get_point_count(channel) for channel in range(4)] == [800] * 4
    assert len(scan) == len(points) == 3200
    down_deg = np.degrees(np.arctan2(-points[:, 2], np.hypot(points[:, 0], points[:, 1])))
    for channel, wanted_deg in enumerate((40.0, 50.0, 60.0, 70.0)):
        found = down_deg[800 * channel : 800 * (channel + 1)]
        assert np.abs(found - wanted_deg).max() < 0.01
    assert np.abs(points[:, 2] + HIGH).max() < 0.2, "the ground, and kerbs on it"


def test_a_scan_that_goes_round_in_two_ticks_covers_one_side_and_then_the_other(world):
    place = above_the_road(world)
    wanted = downwards(rotation_frequency="10")
    sensor, measured = attach(world, None, LIDAR, place, **wanted)
    ticks(world, 2)
    first, second = (measured.get(timeout=WAIT_SECS) for _ in range(2))
    sensor.destroy()
    # It starts behind and goes clockwise: left first.
    assert rows(first)[1:, 1].max() < 0.01 and rows(second)[1:, 1].min() > -0.01
    assert first.horizontal_angle == pytest.approx(math.pi, abs=1e-3)
    assert second.horizontal_angle == pytest.approx(0.0, abs=1e-3)


def test_the_horizontal_field_of_view_is_about_the_middle(world):
    place = above_the_road(world)
    points = rows(scan_of(world, LIDAR, place, **downwards(horizontal_fov="90")))
    azimuth_deg = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    assert azimuth_deg.min() == pytest.approx(-45.0, abs=0.2)
    assert azimuth_deg.max() == pytest.approx(45.0, abs=0.2)


def test_nothing_is_farther_than_the_range(world):
    place = above_the_road(world)
    wanted = EXACT | {"channels": "16", "upper_fov": "10", "lower_fov": "-30", "range": "12"}
    points = rows(scan_of(world, LIDAR, place, **wanted))
    distances_m = np.linalg.norm(points[:, :3], axis=1)
    assert 10.0 < distances_m.max() <= 12.0 + 1e-3


def test_intensity_fades_with_distance_at_the_rate_of_the_air(world):
    place = above_the_road(world)
    wanted = downwards(upper_fov="-5", atmosphere_attenuation_rate="0.02")
    points = rows(scan_of(world, LIDAR, place, **wanted))
    distances_m = np.linalg.norm(points[:, :3], axis=1)
    assert np.ptp(distances_m) > 10.0
    assert points[:, 3] == pytest.approx(np.exp(-0.02 * distances_m), abs=1e-4)


def test_points_drop_off_at_the_general_rate(world):
    place = above_the_road(world)
    scan = scan_of(world, LIDAR, place, **downwards(dropoff_general_rate="0.45"))
    assert len(scan) / 3200 == pytest.approx(0.55, abs=0.04)


def test_noise_moves_points_along_their_rays_as_its_seed_says(world):
    place = above_the_road(world)
    exact = rows(scan_of(world, LIDAR, place, **downwards()))[:, :3]
    noisy = rows(scan_of(world, LIDAR, place, **downwards(noise_stddev="0.1")))[:, :3]
    exact_m, noisy_m = (np.linalg.norm(points, axis=1) for points in (exact, noisy))
    assert np.std(noisy_m - exact_m) == pytest.approx(0.1, rel=0.1)
    assert noisy / noisy_m[:, None] == pytest.approx(exact / exact_m[:, None], abs=1e-4)


def test_a_scan_is_saved_as_the_points_it_has(world, tmp_path):
    scan = scan_of(world, LIDAR, above_the_road(world), **downwards())
    scan.save_to_disk(str(tmp_path / "scan.ply"))
    header, body = (tmp_path / "scan.ply").read_text().split("end_header\n")
    assert f"element vertex {len(scan)}" in header
    saved = np.loadtxt(body.splitlines())
    assert saved == pytest.approx(rows(scan), abs=1e-3)
    detection = scan[7]
    assert [detection.point.x, detection.point.y] == pytest.approx(saved[7][:2], abs=1e-3)
    assert detection.intensity == pytest.approx(saved[7][3], abs=1e-3)


def test_a_semantic_scan_names_actors_tags_and_angles(world):
    car = spawn_car(world)
    ticks(world, 40)
    place = carla.Transform(car.get_location() + carla.Location(z=5.0), carla.Rotation())
    wanted = {name: EXACT[name] for name in ("range", "rotation_frequency", "points_per_second")}
    wanted |= {"channels": "16", "upper_fov": "-30", "lower_fov": "-90"}
    hits = list(scan_of(world, SEMANTIC, place, **wanted))
    on_car = [hit for hit in hits if hit.object_idx == car.id]
    assert len(on_car) > 100
    assert {int(hit.object_tag) for hit in on_car} == {int(carla.CityObjectLabel.Car)}
    box = carla.BoundingBox(car.bounding_box.location, car.bounding_box.extent)
    box.extent += carla.Vector3D(0.02, 0.02, 0.02)
    assert all(box.contains(place.transform(hit.point), car.get_transform()) for hit in on_car)
    on_road = [hit for hit in hits if hit.object_tag == carla.CityObjectLabel.Roads]
    assert on_road and {hit.object_idx for hit in on_road} == {0}
    for hit in on_road:
        level_cos = -hit.point.z / math.hypot(hit.point.x, hit.point.y, hit.point.z)
        assert hit.cos_inc_angle == pytest.approx(level_cos, abs=1e-3)


@pytest.mark.parametrize("towards_mps", [8.0, -6.0])
def test_a_radar_measures_the_speed_of_a_car_with_its_sign(world, towards_mps):
    car = spawn_car(world)
    ticks(world, 20)
    here = car.get_transform()
    forward = here.get_forward_vector()
    eye = here.location + forward * 25.0 + carla.Location(z=0.6)
    place = carla.Transform(eye, carla.Rotation(yaw=here.rotation.yaw + 180.0))
    narrow = {"horizontal_fov": "4", "vertical_fov": "1", "range": "60"}
    radar, measured = attach(world, None, "sensor.other.radar", place, **narrow)
    car.enable_constant_velocity(carla.Vector3D(towards_mps, 0.0, 0.0))
    ticks(world, 10)
    echoes = list([measured.get(timeout=WAIT_SECS) for _ in range(10)][-1])
    radar.destroy()
    gap_m = eye.distance(car.get_location()) - car.bounding_box.extent.x
    near = [echo for echo in echoes if abs(echo.depth - gap_m) < 1.5]
    assert len(near) > 10
    for echo in near:
        assert echo.velocity == pytest.approx(-towards_mps, abs=0.1)


def test_radar_echoes_lie_in_the_field_of_view_on_what_rays_meet(world):
    place = above_the_road(world)
    place.rotation = carla.Rotation(pitch=-20.0, yaw=30.0)
    fov = {"horizontal_fov": "60", "vertical_fov": "20", "points_per_second": "4000"}
    radar, measured = attach(world, None, "sensor.other.radar", place, **fov)
    world.tick()
    echoes = measured.get(timeout=WAIT_SECS)
    assert echoes.get_detection_count() == len(echoes) == len(list(echoes)) <= 200
    assert max(abs(echo.azimuth) for echo in echoes) == pytest.approx(math.radians(30), abs=0.05)
    assert max(abs(echo.altitude) for echo in echoes) == pytest.approx(math.radians(10), abs=0.02)
    right = place.get_right_vector()
    for echo in list(echoes)[:20]:
        flat = math.cos(echo.altitude)
        ahead, aside = flat * math.cos(echo.azimuth), flat * math.sin(echo.azimuth)
        ray = place.get_forward_vector() * ahead + right * aside
        ray += place.get_up_vector() * math.sin(echo.altitude)
        hit = world.project_point(place.location, ray, 100.0)
        assert hit.location.distance(place.location) == pytest.approx(echo.depth, abs=0.02)
    raw = np.frombuffer(echoes.raw_data, np.float32).reshape(-1, 4)
    assert raw[0] == pytest.approx(
        [echoes[0].velocity, echoes[0].azimuth, echoes[0].altitude, echoes[0].depth]
    )
    radar.destroy()
