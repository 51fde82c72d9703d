//! Are the right things at the right places of a picture? Each test knows where a pixel comes from
//! and would fail with another projection, another order, or another light.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::Arc;

use common::{
    brightness, camera, camera_above, car, draw, frame, job, of_kind, pillar, pixel, places,
    renderers, town,
};
use render_service::{AdapterChoice, Material, Renderer};
use schemas::{
    ActorId, Camera, ErrorCode, ImageEncoding, ImageKind, RenderJob, Vec3, Weather, level_pose,
};

fn is_red([red, green, blue]: [i32; 3]) -> bool {
    red > 60 && red > 3 * green && red > 3 * blue
}

#[test]
fn the_sky_is_bright_and_blue_and_the_road_dark_and_grey() {
    for mut renderer in renderers() {
        let image = draw(&mut renderer, &town(&[]), &job(frame(vec![]), vec![camera()])).remove(0);
        let [sky_red, _, sky_blue] = pixel(&image, 320, 20);
        let [road_red, road_green, road_blue] = pixel(&image, 320, 340);
        assert!(sky_blue > sky_red + 40, "sky {:?}", pixel(&image, 320, 20));
        assert!((road_red - road_blue).abs() < 25 && (road_red - road_green).abs() < 15);
        assert!(brightness(&image, 320, 20) > brightness(&image, 320, 340) + 30.0);
    }
}

#[test]
fn a_pole_stands_where_a_pinhole_camera_of_90_degrees_sees_it() {
    for mut renderer in renderers() {
        let pole = pillar(Material::MarkingYellow, [20.0, 5.0], 0.15, 6.0);
        let image =
            draw(&mut renderer, &town(&[pole]), &job(frame(vec![]), vec![camera()])).remove(0);
        let yellow = places(&image, |[red, _, blue]| red > blue + 60);
        assert!(!yellow.is_empty());
        let mean = |of: fn(&(u32, u32)) -> u32| {
            yellow.iter().map(of).sum::<u32>() as f32 / yellow.len() as f32
        };
        // 320 px from the middle at 45°: 5 m left of 20 m is 80 px left.
        assert!((mean(|(x, _)| *x) + 0.5 - 240.0).abs() < 1.5, "column {}", mean(|(x, _)| *x));
        // From 1.5 m below the eye to 4.5 m above it, at 19.85 m.
        let top = yellow.iter().map(|(_, y)| *y).min().unwrap() as f32;
        let foot = yellow.iter().map(|(_, y)| *y).max().unwrap() as f32 + 1.0;
        assert!((top - (180.0 - 4.5 / 19.85 * 320.0)).abs() < 2.0, "top {top}");
        assert!((foot - (180.0 + 1.5 / 19.85 * 320.0)).abs() < 2.0, "foot {foot}");
    }
}

#[test]
fn a_red_car_ahead_is_where_it_is_projected() {
    for mut renderer in renderers() {
        let red_car = car(3, level_pose(Vec3::new(15.0, -3.0, 0.0), 0.0), 0xc01010);
        let image =
            draw(&mut renderer, &town(&[]), &job(frame(vec![red_car]), vec![camera()])).remove(0);
        let red = places(&image, is_red);
        assert!(red.len() > 280, "{} red pixels", red.len());
        let (left, right) = (
            red.iter().map(|(x, _)| *x).min().unwrap(),
            red.iter().map(|(x, _)| *x).max().unwrap(),
        );
        // Its rear is 12.6 m ahead, from 2 m to 4 m right; the body narrows towards its ends.
        let column = |right_m: f32| 320.0 + right_m / 12.6 * 320.0;
        assert!((left as f32 - column(2.0)).abs() < 12.0, "left {left}, wanted {}", column(2.0));
        assert!((right as f32 - column(4.0)).abs() < 12.0, "right {right}, wanted {}", column(4.0));
    }
}

#[test]
fn the_camera_of_a_carrier_moves_with_it() {
    for mut renderer in renderers() {
        let turned = level_pose(Vec3::new(-30.0, 10.0, 0.0), std::f32::consts::FRAC_PI_2);
        let actors = vec![
            car(3, turned, 0x303030),
            car(4, turned * level_pose(Vec3::new(15.0, 0.0, 0.0), 0.0), 0xc01010),
        ];
        let carried = Camera { carrier: ActorId::new(3), ..camera() };
        let image = draw(&mut renderer, &town(&[]), &job(frame(actors), vec![carried])).remove(0);
        let red = places(&image, is_red);
        let mean = red.iter().map(|(x, _)| *x as f32).sum::<f32>() / red.len() as f32;
        assert!(
            red.len() > 300 && (mean - 319.5).abs() < 3.0,
            "{} red pixels around {mean}",
            red.len()
        );
    }
}

#[test]
fn an_ignored_car_and_its_shadow_are_missing_from_that_picture_alone() {
    for mut renderer in renderers() {
        let red_car = || car(3, level_pose(Vec3::new(15.0, -3.0, 0.0), 0.0), 0xc01010);
        let blind = Camera { ignored: vec![ActorId::new(3).unwrap()], ..camera() };
        for kind in [ImageKind::Rgb, ImageKind::Depth, ImageKind::Instance] {
            let cameras = vec![of_kind(kind, &blind), of_kind(kind, &camera())];
            let with_car = draw(&mut renderer, &town(&[]), &job(frame(vec![red_car()]), cameras));
            let empty = job(frame(vec![]), vec![of_kind(kind, &camera())]);
            let empty = draw(&mut renderer, &town(&[]), &empty).remove(0);
            assert!(with_car[0].data == empty.data, "{kind:?}: something of the car is left");
            assert!(with_car[1].data != empty.data, "{kind:?}: the other camera sees no car");
        }
    }
}

#[test]
fn a_shadow_lies_away_from_the_sun_and_is_darker_than_lit_ground() {
    for mut renderer in renderers() {
        let tower = pillar(Material::Wall, [0.0, 0.0], 2.0, 12.0);
        let mut sunny = frame(vec![]);
        // From the east, half up: the shadow is as long as the tower is high, and lies west.
        sunny.weather = Weather {
            cloudiness_percent: 0.0,
            sun_azimuth_rad: 0.0,
            sun_altitude_rad: std::f32::consts::FRAC_PI_4,
            ..Weather::CLEAR_NOON
        };
        let image =
            draw(&mut renderer, &town(&[tower]), &job(sunny, vec![camera_above(60.0)])).remove(0);
        // 320 px are 60 m; the top of the picture is east.
        let row = |east_m: f32| (180.0 - east_m / 60.0 * 320.0) as u32;
        let (shadow, lit) = (brightness(&image, 320, row(-8.0)), brightness(&image, 320, row(8.0)));
        assert!(shadow < 0.75 * lit, "shadow {shadow}, lit {lit}");
        let beyond = brightness(&image, 320, row(-20.0));
        assert!((beyond - lit).abs() < 0.15 * lit, "beyond the shadow {beyond}, lit {lit}");
    }
}

#[test]
fn cameras_come_back_in_their_order_and_size() {
    for mut renderer in renderers() {
        let small = Camera { id: 1, width_px: 84, height_px: 84, ..camera() };
        let odd = Camera { id: 2, width_px: 33, height_px: 7, ..camera() };
        let job = job(frame(vec![]), vec![small, odd, camera()]);
        let results = renderer.render(&[(town(&[]), &job)]).remove(0).unwrap();
        assert_eq!((results.tick, results.state_hash), (job.frame.tick, job.frame.state_hash));
        let seen: Vec<_> = results
            .images
            .iter()
            .map(|i| (i.camera, i.width_px, i.height_px, i.data.len()))
            .collect();
        assert_eq!(
            seen,
            [(1, 84, 84, 84 * 84 * 4), (2, 33, 7, 33 * 7 * 4), (7, 640, 360, 640 * 360 * 4)]
        );
    }
}

#[test]
fn equal_jobs_give_equal_bytes_whatever_is_drawn_beside_them() {
    for mut renderer in renderers() {
        let town = town(&[pillar(Material::Wall, [30.0, 8.0], 5.0, 9.0)]);
        let wanted = job(
            frame(vec![car(3, level_pose(Vec3::new(12.0, 1.0, 0.0), 0.3), 0x20a040)]),
            vec![camera()],
        );
        let other =
            job(frame(vec![]), vec![camera_above(20.0), Camera { width_px: 100, ..camera() }]);
        let alone = draw(&mut renderer, &town, &wanted);
        let jobs = [&other, &wanted, &other].map(|job| (Arc::clone(&town), job));
        let together = renderer.render(&jobs).remove(1).unwrap().images;
        assert!(alone == together, "the picture depends on its neighbours");
        assert!(
            alone == draw(&mut renderer, &town, &wanted),
            "the picture changes when drawn again"
        );
    }
}

#[test]
fn a_jpeg_shows_what_the_raw_picture_shows() {
    for mut renderer in renderers() {
        let compressed =
            Camera { encoding: ImageEncoding::Jpeg, width_px: 321, height_px: 187, ..camera() };
        let raw = Camera { encoding: ImageEncoding::Rgba8, ..compressed.clone() };
        let images = draw(&mut renderer, &town(&[]), &job(frame(vec![]), vec![raw, compressed]));
        let decoded = turbojpeg::decompress(&images[1].data, turbojpeg::PixelFormat::RGBX).unwrap();
        assert_eq!((decoded.width, decoded.height), (321, 187));
        let difference: u64 = decoded
            .pixels
            .chunks(4)
            .zip(images[0].data.chunks(4))
            .flat_map(|(a, b)| a.iter().zip(b).take(3))
            .map(|(a, b)| u64::from(a.abs_diff(*b)))
            .sum();
        let mean = difference as f32 / (321.0 * 187.0 * 3.0);
        assert!(mean < 4.0, "mean difference {mean} of 255");
    }
}

#[test]
fn a_camera_that_cannot_be_is_refused_and_its_neighbours_are_drawn() {
    for mut renderer in renderers() {
        let town = town(&[]);
        let nowhere = level_pose(Vec3::new(f32::NAN, 0.0, 0.0), 0.0);
        let wrong = [
            (Camera { width_px: 0, ..camera() }, ErrorCode::InvalidArgument),
            (Camera { height_px: 4_097, ..camera() }, ErrorCode::InvalidArgument),
            (Camera { horizontal_fov_rad: 0.0, ..camera() }, ErrorCode::InvalidArgument),
            (Camera { horizontal_fov_rad: 3.1, ..camera() }, ErrorCode::InvalidArgument),
            (Camera { horizontal_fov_rad: f32::NAN, ..camera() }, ErrorCode::InvalidArgument),
            (Camera { carrier_from_camera: nowhere, ..camera() }, ErrorCode::InvalidArgument),
            (Camera { carrier: ActorId::new(9), ..camera() }, ErrorCode::UnknownActor),
            (
                Camera { encoding: ImageEncoding::Jpeg, jpeg_quality: 0, ..camera() },
                ErrorCode::InvalidArgument,
            ),
            (Camera { kind: ImageKind::Depth, ..camera() }, ErrorCode::InvalidArgument),
            (
                Camera { kind: ImageKind::Rgb, ..of_kind(ImageKind::Semantic, &camera()) },
                ErrorCode::InvalidArgument,
            ),
        ];
        let mut jobs: Vec<RenderJob> =
            wrong.iter().map(|(camera, _)| job(frame(vec![]), vec![camera.clone()])).collect();
        jobs.push(job(frame(vec![]), vec![Camera { width_px: 16, height_px: 16, ..camera() }]));
        let jobs: Vec<_> = jobs.iter().map(|job| (Arc::clone(&town), job)).collect();
        let mut results = renderer.render(&jobs);
        assert_eq!(results.pop().unwrap().unwrap().images.len(), 1);
        for ((camera, code), result) in wrong.iter().zip(results) {
            let error = result.unwrap_err();
            assert_eq!(error.code, *code, "{camera:?}");
            assert!(!error.wanted.is_empty() && !error.found.is_empty(), "{error}");
        }
    }
}

#[test]
fn too_many_pixels_or_cameras_and_another_map_are_refused() {
    for mut renderer in renderers() {
        let large = Camera { width_px: 4_096, height_px: 4_096, ..camera() };
        let mut elsewhere = job(frame(vec![]), vec![camera()]);
        elsewhere.frame.map.digest = "f".repeat(64);
        let tiny = Camera { width_px: 2, height_px: 2, ..camera() };
        for (job, code) in [
            (job(frame(vec![]), vec![large]), ErrorCode::TooLarge),
            (job(frame(vec![]), vec![tiny; 65]), ErrorCode::TooLarge),
            (elsewhere, ErrorCode::UnknownMap),
        ] {
            let error = renderer.render(&[(town(&[]), &job)]).remove(0).unwrap_err();
            assert_eq!(error.code, code, "{error}");
        }
    }
}

#[test]
fn actors_that_are_no_numbers_are_left_out_of_the_picture() {
    for mut renderer in renderers() {
        let mut broken = car(3, level_pose(Vec3::new(f32::INFINITY, 0.0, 0.0), 0.0), 0xff0000);
        let ok = car(4, level_pose(Vec3::new(15.0, 0.0, 0.0), 0.0), 0xc01010);
        broken.box_half_extent_m.x = f32::NAN;
        let image = draw(&mut renderer, &town(&[]), &job(frame(vec![broken, ok]), vec![camera()]))
            .remove(0);
        assert!(places(&image, is_red).len() > 300);
    }
}

#[test]
fn a_machine_without_the_wanted_adapter_says_what_it_has_and_what_draws_without() {
    let Err(error) = Renderer::new(AdapterChoice::Named("no such adapter".to_owned())) else {
        panic!("an adapter of that name exists");
    };
    let text = error.to_string();
    assert!(text.contains("no such adapter") && text.contains("--adapter cpu"), "{text}");
}
