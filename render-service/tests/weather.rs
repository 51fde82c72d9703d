//! Does the weather look like the weather? Each test compares two pictures of one scene.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{
    brightness, camera, camera_above, car, draw, frame, job, pillar, pixel, project, renderers,
    town,
};
use render_service::{Material, Renderer, Surface};
use schemas::{ActorState, Frame, Image, Tick, Vec3, Weather};

/// Cloudless, dry, calm.
const CLEAR: Weather =
    Weather { cloudiness_percent: 0.0, fog_density_percent: 0.0, ..Weather::CLEAR_NOON };

fn picture(renderer: &mut Renderer, things: &[Surface], weather: Weather) -> Image {
    let frame = Frame { weather, ..frame(vec![]) };
    draw(renderer, &town(things), &job(frame, vec![camera()])).remove(0)
}

fn mean(image: &Image) -> f32 {
    let sum: u64 = image
        .data
        .chunks(4)
        .map(|p| p.iter().take(3).map(|part| u64::from(*part)).sum::<u64>())
        .sum();
    sum as f32 / (image.data.len() as f32 * 0.75)
}

#[test]
fn night_is_far_darker_than_noon_and_dusk_lies_between() {
    for mut renderer in renderers() {
        let houses = [pillar(Material::Wall, [30.0, 12.0], 5.0, 9.0)];
        let mut at = |sun_altitude_rad: f32| {
            mean(&picture(&mut renderer, &houses, Weather { sun_altitude_rad, ..CLEAR }))
        };
        let (noon, dusk, night) = (at(1.2), at(0.0), at(-0.8));
        assert!(night < 0.4 * noon, "night {night}, noon {noon}");
        assert!(night < dusk && dusk < 0.9 * noon, "night {night}, dusk {dusk}, noon {noon}");
    }
}

#[test]
fn fog_takes_the_contrast_of_what_is_far_and_leaves_what_is_near() {
    for mut renderer in renderers() {
        let (near, far) = (Vec3::new(8.5, 3.0, 3.0), Vec3::new(69.0, -8.0, 4.0));
        let things = [
            pillar(Material::Metal, [9.0, 3.0], 0.5, 6.0),
            pillar(Material::Metal, [70.0, -8.0], 2.0, 9.0),
        ];
        // Difference to the sky at the same height beside it.
        let contrast = |image: &Image, at: &Vec3| {
            let (column, row) = project(&camera(), at);
            (brightness(image, column, row) - brightness(image, 320, row)).abs()
        };
        let clear = picture(&mut renderer, &things, CLEAR);
        let fog = Weather { fog_density_percent: 70.0, fog_distance_m: 10.0, ..CLEAR };
        let fog = picture(&mut renderer, &things, fog);
        let (before, after) = (contrast(&clear, &far), contrast(&fog, &far));
        assert!(
            before > 30.0 && after < 0.3 * before,
            "far: {before} in clear air, {after} in fog"
        );
        let (before, after) = (contrast(&clear, &near), contrast(&fog, &near));
        assert!(after > 0.6 * before, "near: {before} in clear air, {after} in fog");
    }
}

#[test]
fn fog_thins_with_height_as_its_falloff_says() {
    for mut renderer in renderers() {
        let tower = pillar(Material::Metal, [70.0, 0.0], 6.0, 60.0);
        let mut seen = |weather: Weather, z: f32| {
            let image = picture(&mut renderer, std::slice::from_ref(&tower), weather);
            let (column, row) = project(&camera(), &Vec3::new(64.0, 0.0, z));
            brightness(&image, column, row)
        };
        let fog = |fog_falloff| Weather { fog_density_percent: 60.0, fog_falloff, ..CLEAR };
        let mut veil =
            |fog_falloff: f32, z: f32| (seen(fog(fog_falloff), z) - seen(CLEAR, z)).abs();
        let [foot, top] = [3.0, 30.0].map(|z| veil(2.0, z) / veil(0.0, z));
        assert!(foot > 0.9, "{foot} of even fog at the foot");
        assert!(top < 0.75, "{top} of even fog above");
    }
}

#[test]
fn a_wet_road_is_darker_than_a_dry_one() {
    for mut renderer in renderers() {
        let dry = picture(&mut renderer, &[], CLEAR);
        let wet = picture(&mut renderer, &[], Weather { wetness_percent: 100.0, ..CLEAR });
        let road = |image: &Image| brightness(image, 320, 340);
        assert!(road(&wet) < 0.9 * road(&dry), "wet {}, dry {}", road(&wet), road(&dry));
    }
}

/// Goal: a wet road mirrors who stands on it. Method: the road before a red car and a white one, on
/// a wet and on a dry road, where none of their light falls.
#[test]
fn a_wet_road_mirrors_a_car_and_a_dry_one_does_not() {
    for mut renderer in renderers() {
        let mut redness = |colour_rgb: u32, wetness_percent: f32| {
            let car = car(1, schemas::level_pose(Vec3::new(14.0, 0.0, 0.0), 0.0), colour_rgb);
            let weather = Weather { wetness_percent, cloudiness_percent: 100.0, ..CLEAR };
            let frame = Frame { weather, ..frame(vec![car]) };
            let image = draw(&mut renderer, &town(&[]), &job(frame, vec![camera()])).remove(0);
            // Its middle is mirrored 3 m before its bumper.
            let (_, row) = project(&camera(), &Vec3::new(8.5, 0.0, 0.0));
            let mut sum = 0;
            for (x, y) in (row - 6..row + 6).flat_map(|y| (300..340).map(move |x| (x, y))) {
                let [red, _, blue] = pixel(&image, x, y);
                sum += red - blue;
            }
            sum as f32 / (12.0 * 40.0)
        };
        let [wet, white, dry] =
            [redness(0xd0_1010, 100.0), redness(0xd0_d0d0, 100.0), redness(0xd0_1010, 0.0)];
        eprintln!("red over blue: {wet} before a red car, {white} before a white one, {dry} dry");
        assert!(wet > white + 4.0, "{wet} before a red car, {white} before a white one");
        assert!((dry - redness(0xd0_d0d0, 0.0)).abs() < 0.5, "a dry road mirrors");
    }
}

#[test]
fn rain_falls_in_streaks_that_are_others_in_every_tick_and_the_same_when_drawn_again() {
    for mut renderer in renderers() {
        let weather = Weather { precipitation_percent: 100.0, cloudiness_percent: 100.0, ..CLEAR };
        let mut at = |tick: u64| {
            let frame = Frame { weather, tick: Tick(tick), ..frame(vec![]) };
            draw(&mut renderer, &town(&[]), &job(frame, vec![camera()])).remove(0)
        };
        let (first, again, next) = (at(1), at(1), at(2));
        assert!(first == again, "the rain of one tick changes");
        let differing =
            first.data.chunks(4).zip(next.data.chunks(4)).filter(|(a, b)| a != b).count();
        let share = differing as f32 / (640.0 * 360.0);
        assert!((0.02..0.9).contains(&share), "{share} of the picture changes");
    }
}

#[test]
fn dust_makes_the_air_brown() {
    for mut renderer in renderers() {
        let dusty = picture(&mut renderer, &[], Weather { dust_storm_percent: 90.0, ..CLEAR });
        let clear = picture(&mut renderer, &[], CLEAR);
        let warmth = |image: &Image| {
            let [red, _, blue] = pixel(image, 320, 160);
            red - blue
        };
        assert!(warmth(&dusty) > 40 && warmth(&clear) < 0, "{} {}", warmth(&dusty), warmth(&clear));
    }
}

#[test]
fn under_clouds_the_ground_is_darker_the_nearer_it_is_to_a_car() {
    let overcast = Weather { cloudiness_percent: 100.0, ..CLEAR };
    let car = car(1, schemas::level_pose(Vec3::new(0.0, 0.0, 0.0), 0.0), 0x00ff_ffff);
    for mut renderer in renderers() {
        let camera = camera_above(14.0);
        let mut at = |actors: Vec<ActorState>| {
            let frame = Frame { weather: overcast, ..frame(actors) };
            draw(&mut renderer, &town(&[]), &job(frame, vec![camera.clone()])).remove(0)
        };
        let (alone, beside) = (at(vec![]), at(vec![car.clone()]));
        // On the side of the sun, where no shadow of the car falls.
        let side = if overcast.sun_azimuth_rad.sin() > 0.0 { -1.0 } else { 1.0 };
        let share = |y: f32| {
            let (column, row) = (320.0 - side * y * 320.0 / 14.0, 180.0);
            let at = |image: &Image| brightness(image, column as u32, row as u32);
            at(&beside) / at(&alone)
        };
        let [near, aside, far] = [1.3, 2.5, 6.0].map(share);
        assert!(
            near < 0.93 && near < aside && aside < 0.995 && far > 0.995,
            "{near} {aside} {far}"
        );
    }
}
