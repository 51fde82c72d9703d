//! Do lamps light what is around them, by night and on all that draws?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::Arc;

use common::{brightness, camera, car, draw, frame, job, pillar, pixel, project, renderers, town};
use render_service::{Material, Renderer, Surface, TownScene};
use schemas::{
    ActorState, Camera, Frame, Image, MapRef, Pose, RenderJob, Staging, StreetLight,
    UnitQuaternion, Vec3, Weather, level_pose,
};

const POSITION: u32 = 1;
const LOW_BEAM: u32 = 2;
const HIGH_BEAM: u32 = 4;
const BRAKE: u32 = 8;
const LEFT_BLINKER: u32 = 32;
const REVERSE: u32 = 64;
const FOG: u32 = 128;
const SPECIAL: u32 = 512;

const NIGHT: Weather =
    Weather { sun_altitude_rad: -0.8, cloudiness_percent: 0.0, ..Weather::CLEAR_NOON };

/// From 4 m above the car's tail, looking along it and down.
fn over_the_roof() -> Camera {
    let down = UnitQuaternion::from_euler_angles(0.0, 0.25, 0.0);
    Camera {
        carrier_from_camera: Pose::from_parts(Vec3::new(-3.0, 0.0, 4.0).into(), down),
        ..camera()
    }
}

/// A car at the origin with some lights, as a camera sees it.
fn lit(
    renderer: &mut Renderer,
    things: &[Surface],
    (lights, type_id): (u32, &str),
    (weather, camera): (Weather, &Camera),
) -> Image {
    let actor = ActorState { lights, ..car(3, Pose::identity(), 0x30_3030) };
    let types = vec![type_id.to_owned()];
    let frame = Frame { weather, types, ..frame(vec![actor]) };
    draw(renderer, &town(things), &job(frame, vec![camera.clone()])).remove(0)
}

fn tesla(renderer: &mut Renderer, lights: u32, camera: &Camera) -> Image {
    lit(renderer, &[], (lights, "vehicle.tesla.model3"), (NIGHT, camera))
}

/// Brightness of the road at a place.
fn road(image: &Image, camera: &Camera, x: f32, y: f32) -> f32 {
    let (column, row) = project(camera, &Vec3::new(x, y, 0.0));
    brightness(image, column, row)
}

#[test]
fn low_beams_light_the_road_ahead_high_beams_further_and_fog_lamps_wider() {
    for mut renderer in renderers() {
        let camera = over_the_roof();
        let mut at = |lights: u32, x: f32, y: f32| {
            road(&tesla(&mut renderer, lights, &camera), &camera, x, y)
        };
        let dark = [at(0, 9.0, 0.0), at(0, 45.0, 0.0), at(0, 7.0, 4.0)];
        let low = [at(LOW_BEAM, 9.0, 0.0), at(LOW_BEAM, 45.0, 0.0), at(LOW_BEAM, 7.0, 4.0)];
        let high = at(HIGH_BEAM, 45.0, 0.0);
        let fog = at(FOG, 7.0, 4.0);
        assert!(low[0] > dark[0] + 40.0, "{} after {}", low[0], dark[0]);
        assert!(high > 1.3 * low[1], "{high} after {}", low[1]);
        assert!(fog > dark[2] + 15.0, "{fog} after {}", dark[2]);
        assert!(at(POSITION, 9.0, 0.0) < dark[0] + 10.0);
    }
}

#[test]
fn by_day_beams_change_nothing_on_the_road() {
    for mut renderer in renderers() {
        let camera = over_the_roof();
        let mut at = |lights: u32| {
            let noon = (Weather::CLEAR_NOON, &camera);
            let image = lit(&mut renderer, &[], (lights, "vehicle.tesla.model3"), noon);
            [pixel(&image, 320, 140), pixel(&image, 320, 100), pixel(&image, 100, 200)]
        };
        assert_eq!(at(LOW_BEAM | HIGH_BEAM), at(0));
    }
}

#[test]
fn a_low_beam_ends_below_the_eyes_of_who_comes_and_a_high_beam_does_not() {
    for mut renderer in renderers() {
        let wall = pillar(Material::Concrete, [26.0, 0.0], 6.0, 6.0);
        let camera = over_the_roof();
        let mut at = |lights: u32, z: f32| {
            let tesla = (lights, "vehicle.tesla.model3");
            let image = lit(&mut renderer, std::slice::from_ref(&wall), tesla, (NIGHT, &camera));
            let (column, row) = project(&camera, &Vec3::new(20.0, 0.0, z));
            brightness(&image, column, row)
        };
        let (low, above) = (at(LOW_BEAM, 0.25), at(LOW_BEAM, 2.2));
        assert!(low > 150.0 && above < 0.6 * low, "{low} {above}");
        assert!(at(HIGH_BEAM, 1.4) > at(LOW_BEAM, 1.4) + 30.0);
    }
}

#[test]
fn brakes_redden_the_road_behind_and_reversing_lamps_and_beacons_colour_it() {
    for mut renderer in renderers() {
        let turned = level_pose(Vec3::new(6.0, 0.0, 8.0), std::f32::consts::PI);
        let down = UnitQuaternion::from_euler_angles(0.0, 0.7, 0.0);
        let pose = Pose::from_parts(turned.translation, turned.rotation * down);
        let camera = Camera { carrier_from_camera: pose, ..camera() };
        let mut at = |lights: u32, type_id: &str, x: f32, y: f32| {
            let image = lit(&mut renderer, &[], (lights, type_id), (NIGHT, &camera));
            let (column, row) = project(&camera, &Vec3::new(x, y, 0.0));
            pixel(&image, column, row)
        };
        let tesla = "vehicle.tesla.model3";
        let [red, _, blue] = at(BRAKE, tesla, -4.0, 0.0);
        let [was, ..] = at(0, tesla, -4.0, 0.0);
        assert!(red > was + 15 && red > blue + 15, "{red} {blue}, {was} before");
        let white = at(REVERSE, tesla, -4.5, 0.0);
        assert!(white.iter().all(|part| *part > was + 15), "{white:?}, {was} before");
        let [red, _, blue] = at(LEFT_BLINKER, tesla, 1.8, 2.2);
        let dark = at(0, tesla, 1.8, 2.2);
        assert!(red > dark[0] + 10 && red > blue + 10, "{red} {blue}, {dark:?} before");
        let police = at(SPECIAL, "vehicle.dodge.charger_police", -5.0, -3.0);
        let dark = at(0, "vehicle.dodge.charger_police", -5.0, -3.0);
        let most = (0..3).map(|part| police[part] - dark[part]).max().unwrap();
        assert!(most > 15, "{police:?} after {dark:?}");
    }
}

#[test]
fn two_wheelers_have_lamps_that_light_the_road() {
    for mut renderer in renderers() {
        let camera = over_the_roof();
        for (type_id, half_m) in [
            ("vehicle.kawasaki.ninja", [1.0, 0.4, 0.75]),
            ("vehicle.bh.crossbike", [0.75, 0.3, 0.8]),
        ] {
            let mut at = |lights: u32| {
                let half = Vec3::from(half_m);
                let actor = ActorState {
                    lights,
                    box_centre_m: Vec3::z() * half.z,
                    box_half_extent_m: half,
                    ..car(3, Pose::identity(), 0x30_3030)
                };
                let types = vec![type_id.to_owned()];
                let frame = Frame { weather: NIGHT, types, ..frame(vec![actor]) };
                let image =
                    draw(&mut renderer, &town(&[]), &job(frame, vec![camera.clone()])).remove(0);
                road(&image, &camera, 8.0, 0.0)
            };
            let (dark, low) = (at(0), at(LOW_BEAM));
            assert!(low > dark + 20.0, "{type_id}: {low} after {dark}");
        }
    }
}

/// A car that comes along on a dry and on a wet road, with and without its beams.
#[test]
fn a_wet_road_mirrors_lamps_in_streaks_towards_the_eye() {
    for mut renderer in renderers() {
        let camera = camera();
        let mut picture = |lights: u32, deposits: f32| {
            let pose = level_pose(Vec3::new(30.0, 0.0, 0.0), std::f32::consts::PI);
            let actor = ActorState { lights, ..car(3, pose, 0x30_3030) };
            let weather = Weather { precipitation_deposits_percent: deposits, ..NIGHT };
            let frame = Frame { weather, ..frame(vec![actor]) };
            draw(&mut renderer, &town(&[]), &job(frame, vec![camera.clone()])).remove(0)
        };
        let [dry, wet] = [0.0, 100.0].map(|deposits| [0, LOW_BEAM].map(|on| picture(on, deposits)));
        // Where the road mirrors a lamp 0.65 m high to the eye, and as far ahead but aside.
        let mirror_x = 27.6 * 1.5 / (1.5 + 0.65);
        let gain = |[off, on]: &[Image; 2], y: f32| {
            road(on, &camera, mirror_x, y) - road(off, &camera, mirror_x, y)
        };
        let at = |pair: &[Image; 2]| [gain(pair, 0.7), gain(pair, 4.0)];
        let ([dry_below, dry_aside], [wet_below, wet_aside]) = (at(&dry), at(&wet));
        assert!(wet_below > 2.0 * dry_below, "{wet_below} where it was {dry_below} dry");
        assert!(wet_aside < dry_aside, "{wet_aside} aside where it was {dry_aside} dry");
        assert!(wet_below > 3.0 * wet_aside, "{wet_below} below, {wet_aside} aside");
    }
}

/// A town with street lights, a job that looks at the first of them, and where it is.
fn street() -> (Arc<TownScene>, RenderJob, Vec3) {
    let name = "Town02";
    let map = roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
    let objects = map.environment_objects();
    let lamp = objects.iter().find(|object| object.layer == roads::MapLayer::StreetLights).unwrap();
    let glass = lamp.pose * nalgebra::Point3::new(1.4, 0.0, lamp.half_extent_m.z);
    let glass: Vec3 = glass.coords.cast();
    let along: Vec3 = lamp.pose.rotation.cast::<f32>() * Vec3::y();
    let yaw_rad = along.y.atan2(along.x);
    let down = UnitQuaternion::from_euler_angles(0.0, 0.3, 0.0);
    let level = level_pose(glass - along * 12.0 - Vec3::z() * 2.0, yaw_rad);
    let pose = Pose::from_parts(level.translation, level.rotation * down);
    let map = MapRef { name: name.to_owned(), digest: map.digest().to_owned() };
    let empty = frame(vec![]);
    let frame = Frame { map: map.clone(), weather: NIGHT, ..empty };
    let camera = Camera { carrier_from_camera: pose, ..camera() };
    let name = "Town02";
    let map = roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
    (Arc::new(TownScene::of_map(&map)), job(frame, vec![camera]), glass)
}

#[test]
fn street_lights_light_the_road_below_by_night_as_they_were_set() {
    let (scene, plain, glass) = street();
    let set = |on: bool, colour_rgb: u32, brightness: f32| {
        let light = |index: u32| StreetLight { index, on, colour_rgb, brightness };
        let street_lights = (0..2_000).map(light).collect();
        RenderJob { staging: Staging { street_lights }, ..plain.clone() }
    };
    for mut renderer in renderers() {
        let mut seen = |job: &RenderJob| draw(&mut renderer, &scene, job).remove(0);
        let below = |image: &Image| {
            let (column, row) = project(&plain.cameras[0], &(glass - Vec3::z() * 6.3));
            (brightness(image, column, row), pixel(image, column, row))
        };
        let glows = |image: &Image| {
            let (column, row) = project(&plain.cameras[0], &(glass - Vec3::z() * 0.13));
            brightness(image, column, row)
        };
        let (night, off) = (seen(&plain), seen(&set(false, 0xff_d6_aa, 1.0)));
        assert!(below(&night).0 > below(&off).0 + 30.0, "{:?} {:?}", below(&night), below(&off));
        assert!(glows(&night) > glows(&off) + 40.0, "{} {}", glows(&night), glows(&off));
        let (_, [red, _, blue]) = below(&seen(&set(true, 0x00_00_ff, 1.0)));
        assert!(blue > red + 30, "{red} {blue}");
        let weak = below(&seen(&set(true, 0xff_d6_aa, 0.2))).0;
        assert!(weak < below(&night).0 - 10.0 && weak > below(&off).0, "{weak}");
        let mut noon = plain.clone();
        noon.frame.weather = Weather::CLEAR_NOON;
        let dark = set(false, 0, 1.0);
        let mut noon_off = RenderJob { staging: dark.staging, ..noon.clone() };
        noon_off.frame.weather = Weather::CLEAR_NOON;
        assert!(seen(&noon) == seen(&noon_off), "street lights burn by day");
    }
}
