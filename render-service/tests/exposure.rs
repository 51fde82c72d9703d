//! Do exposure and white balance do what their numbers say, and bones what somebody wants?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::f32::consts::FRAC_PI_2;

use common::{brightness, camera, draw, frame, job, pixel, renderers, town};
use render_service::Renderer;
use schemas::{
    ActorId, ActorKind, ActorState, BonePose, Camera, Exposure, Frame, Image, Pose, RenderJob,
    UnitQuaternion, Vec3, WalkerPose, Weather, skeleton,
};

fn exposed(renderer: &mut Renderer, exposure: Exposure, sun_altitude_rad: f32) -> Image {
    let weather = Weather { sun_altitude_rad, ..Weather::CLEAR_NOON };
    let camera = Camera { exposure, ..camera() };
    let frame = Frame { weather, ..frame(vec![]) };
    draw(renderer, &town(&[]), &job(frame, vec![camera])).remove(0)
}

#[test]
fn stops_brighten_and_darken_and_a_fixed_exposure_does_not_follow_the_night() {
    for mut renderer in renderers() {
        let mut road = |exposure: Exposure, sun: f32| {
            brightness(&exposed(&mut renderer, exposure, sun), 320, 320)
        };
        let plain = Exposure::PLAIN;
        let by = |compensation_ev: f32| Exposure { compensation_ev, ..plain };
        let (dark, noon, bright) = (road(by(-1.5), 1.0), road(plain, 1.0), road(by(1.5), 1.0));
        assert!(dark + 20.0 < noon && noon + 20.0 < bright, "{dark} {noon} {bright}");
        let fixed = |ev100: f32| Exposure { fixed_ev100: Some(ev100), ..plain };
        assert!((road(fixed(12.5), 1.0) - noon).abs() < 1.5);
        assert!(road(fixed(8.6), 1.0) > 180.0 && road(fixed(20.0), 1.0) < 25.0);
        assert!(road(fixed(12.5), -0.8) < road(plain, -0.8));
    }
}

#[test]
fn a_colour_temperature_takes_its_colour_out_of_the_picture() {
    for mut renderer in renderers() {
        let mut warmth = |temperature_k: f32, tint: f32| {
            let exposure = Exposure { temperature_k, tint, ..Exposure::PLAIN };
            let [red, green, blue] = pixel(&exposed(&mut renderer, exposure, 1.0), 320, 320);
            (red - blue, green - (red + blue) / 2)
        };
        let (plain, green) = warmth(6_500.0, 0.0);
        assert!(warmth(3_200.0, 0.0).0 < plain - 30);
        assert!(warmth(12_000.0, 0.0).0 > plain + 12);
        assert!((warmth(6_500.0, 1.0).1 - green).abs() > 8);
    }
}

#[test]
fn a_walker_shows_its_limbs_as_somebody_posed_its_bones() {
    for mut renderer in renderers() {
        let id = ActorId::new(7).unwrap();
        let pose = Pose::translation(4.0, 0.0, 0.9);
        let walker = ActorState {
            box_half_extent_m: Vec3::new(0.19, 0.19, 0.9),
            ..ActorState::at_rest(id, ActorKind::Walker, 0, pose)
        };
        let types = vec!["walker.pedestrian.0001".to_owned()];
        let frame = Frame { types, ..frame(vec![walker]) };
        let plain = job(frame, vec![camera()]);
        // Arms straight out to both sides.
        let aside = |bone: &str, side: f32| BonePose {
            bone: skeleton::number_of(bone).unwrap(),
            parent_from_bone: Pose::from_parts(
                Vec3::new(0.0, side * 0.17, 0.0).into(),
                UnitQuaternion::from_axis_angle(&Vec3::x_axis(), side * FRAC_PI_2),
            ),
        };
        let bones = vec![aside("crl_arm__L", 1.0), aside("crl_arm__R", -1.0)];
        let posed = |share| {
            let walker_poses = vec![WalkerPose { walker: id, share, bones: bones.clone() }];
            let frame = Frame { walker_poses, ..plain.frame.clone() };
            RenderJob { frame, ..plain.clone() }
        };
        let (hidden, posed) = (posed(0.0), posed(1.0));
        let mut at = |job: &RenderJob, y: f32, z: f32| {
            let image = draw(&mut renderer, &town(&[]), job).remove(0);
            let (column, row) = common::project(&camera(), &Vec3::new(4.0, y, z));
            pixel(&image, column, row)
        };
        let empty = job(Frame { actors: Vec::new(), ..plain.frame.clone() }, vec![camera()]);
        for y in [0.75, -0.75] {
            for down in [&plain, &hidden] {
                assert_eq!(at(down, y, 1.45), at(&empty, y, 1.45), "arms hang down");
            }
            assert_ne!(at(&posed, y, 1.45), at(&empty, y, 1.45), "arms are out");
        }
        assert_ne!(at(&posed, 0.0, 1.2), at(&empty, 0.0, 1.2), "the trunk is there");
        assert_ne!(at(&posed, -0.09, 0.2), at(&empty, -0.09, 0.2), "the shin is there");
    }
}
