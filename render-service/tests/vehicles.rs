//! Do vehicles show the lights and the doors that a frame tells of?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::f32::consts::PI;

use common::{camera, car, draw, frame, job, of_kind, pixel, places, project, renderers, town};
use render_service::Renderer;
use schemas::{
    ActorState, Camera, Frame, Image, ImageKind, Pose, TagId, Vec3, VehicleControl, Weather,
    level_pose,
};

const CAR: u32 = 3;

const NONE: u32 = 0;
const POSITION: u32 = 1;
const LOW_BEAM: u32 = 2;
const HIGH_BEAM: u32 = 4;
const BRAKE: u32 = 8;
const RIGHT_BLINKER: u32 = 16;
const LEFT_BLINKER: u32 = 32;
const REVERSE: u32 = 64;
const FOG: u32 = 128;
const INTERIOR: u32 = 256;
const SPECIAL: u32 = 512;

/// Places on the car's box from -1 to 1.
const TAIL: [f32; 3] = [-0.99, 0.76, 0.09];
const HEAD: [f32; 3] = [0.985, 0.68, -0.13];
const REAR_BLINKER: [f32; 3] = [-0.996, 0.88, -0.01];
const FRONT_BLINKER: [f32; 3] = [0.992, 0.90, -0.13];
const REVERSE_LAMP: [f32; 3] = [-0.996, 0.53, 0.08];
const HIGH_LAMP: [f32; 3] = [0.992, 0.48, -0.13];
const FRONT_FOG: [f32; 3] = [1.018, 0.56, -0.565];
const REAR_FOG: [f32; 3] = [-1.018, 0.59, -0.555];

/// Flags, and the lamps that they light: where, and whether on the left and on the right.
type Row = (u32, &'static [([f32; 3], [bool; 2])]);

/// The car by night, 6 m ahead, seen from behind or from before.
struct Scene {
    renderer: Renderer,
    from_behind: bool,
    sim_secs: f64,
}

impl Scene {
    fn pose(&self) -> Pose {
        level_pose(Vec3::new(6.0, 0.0, 0.0), if self.from_behind { 0.0 } else { PI })
    }

    fn draw(&mut self, lights: u32) -> Image {
        let mut actor = car(CAR, self.pose(), 0x30_50a0);
        actor.lights = lights;
        self.draw_actor(actor, "vehicle.tesla.model3", &camera())
    }

    fn draw_actor(&mut self, actor: ActorState, type_id: &str, camera: &Camera) -> Image {
        let weather = Weather { sun_altitude_rad: -0.8, ..Weather::CLEAR_NOON };
        let types = vec![type_id.to_owned()];
        let frame = Frame { weather, types, sim_secs: self.sim_secs, ..frame(vec![actor]) };
        draw(&mut self.renderer, &town(&[]), &job(frame, vec![camera.clone()])).remove(0)
    }

    /// The colours of the left and the right one of two lamps.
    fn colours(&self, image: &Image, [x, y, z]: [f32; 3]) -> [[i32; 3]; 2] {
        let at = |y: f32| {
            let point = nalgebra::Point3::new(2.4 * x, y, 0.74 + 0.74 * z);
            let (column, row) = project(&camera(), &(self.pose() * point).coords);
            pixel(image, column, row)
        };
        [at(y), at(-y)]
    }

    fn lit(&self, image: &Image, lamp: [f32; 3]) -> [bool; 2] {
        self.colours(image, lamp).map(|colour| colour.into_iter().max().unwrap() > 170)
    }
}

/// For all that draws, at a moment at which blinkers are lit.
fn scenes(from_behind: bool) -> impl Iterator<Item = Scene> {
    renderers().map(move |renderer| Scene { renderer, from_behind, sim_secs: 1.0 })
}

#[test]
fn a_vehicle_without_lights_is_dark_by_night_even_when_it_brakes() {
    for mut scene in [true, false].into_iter().flat_map(scenes) {
        let mut braking = car(CAR, scene.pose(), 0x30_50a0);
        braking.control = VehicleControl { brake: 1.0, reverse: true, ..braking.control };
        let image = scene.draw_actor(braking, "vehicle.tesla.model3", &camera());
        let bright = places(&image, |colour| colour.into_iter().max().unwrap() > 150);
        assert!(bright.is_empty(), "{} bright pixels", bright.len());
    }
}

#[test]
fn each_light_flag_lights_its_own_lamps_and_no_others() {
    const BOTH: [bool; 2] = [true; 2];
    const LEFT: [bool; 2] = [true, false];
    const RIGHT: [bool; 2] = [false, true];
    let lamps = [TAIL, REAR_BLINKER, REVERSE_LAMP, REAR_FOG];
    let rear: [Row; 9] = [
        (NONE, &[]),
        (LOW_BEAM, &[]),
        (HIGH_BEAM, &[]),
        (BRAKE, &[(TAIL, BOTH), (REAR_BLINKER, BOTH)]),
        (RIGHT_BLINKER, &[(REAR_BLINKER, RIGHT)]),
        (LEFT_BLINKER, &[(REAR_BLINKER, LEFT)]),
        (REVERSE, &[(REVERSE_LAMP, BOTH)]),
        (FOG, &[(REAR_FOG, BOTH)]),
        (RIGHT_BLINKER | LEFT_BLINKER, &[(REAR_BLINKER, BOTH)]),
    ];
    check(true, &lamps, &rear);
    let lamps = [HEAD, FRONT_BLINKER, HIGH_LAMP, FRONT_FOG];
    let front: [Row; 8] = [
        (NONE, &[]),
        (LOW_BEAM, &[(HEAD, BOTH)]),
        (HIGH_BEAM, &[(HEAD, BOTH), (HIGH_LAMP, BOTH)]),
        (BRAKE, &[]),
        (RIGHT_BLINKER, &[(FRONT_BLINKER, RIGHT)]),
        (LEFT_BLINKER, &[(FRONT_BLINKER, LEFT)]),
        (REVERSE, &[]),
        (FOG, &[(FRONT_FOG, BOTH)]),
    ];
    check(false, &lamps, &front);
}

fn check(from_behind: bool, lamps: &[[f32; 3]], rows: &[Row]) {
    for mut scene in scenes(from_behind) {
        for (lights, lit) in rows {
            let image = scene.draw(*lights);
            for lamp in lamps {
                let wanted =
                    lit.iter().find(|(of, _)| of == lamp).map_or([false; 2], |(_, on)| *on);
                let colours = scene.colours(&image, *lamp);
                assert_eq!(
                    scene.lit(&image, *lamp),
                    wanted,
                    "lights {lights:#x}, lamp {lamp:?}, {colours:?}"
                );
            }
        }
    }
}

#[test]
fn position_lights_glow_less_than_brakes_and_beams() {
    for (from_behind, lamp, stronger) in [(true, TAIL, BRAKE), (false, HEAD, LOW_BEAM)] {
        for mut scene in scenes(from_behind) {
            let [dark, dim, bright] = [NONE, POSITION, stronger].map(|lights| {
                let image = scene.draw(lights);
                scene.colours(&image, lamp)[0][0]
            });
            assert!(dark + 30 < dim && dim + 30 < bright, "{dark} {dim} {bright}");
        }
    }
}

#[test]
fn blinkers_flash_between_60_and_120_times_a_minute_of_simulated_time() {
    // Many pictures: only by what draws fast.
    let mut scene = scenes(true).next().unwrap();
    let mut changes = 0;
    let mut before = None;
    for tick in 0..400 {
        scene.sim_secs = f64::from(tick) * 0.05;
        let image = scene.draw(LEFT_BLINKER);
        let lit = scene.lit(&image, REAR_BLINKER)[0];
        changes += u32::from(before.is_some_and(|before| before != lit));
        before = Some(lit);
    }
    // 20 s have 20 to 40 flashes, each two changes.
    assert!((40..=80).contains(&changes), "{changes} changes");
}

#[test]
fn the_light_in_the_cabin_is_seen_through_the_windows() {
    for mut scene in scenes(true) {
        let rear_window = [-0.62, 0.3, 0.5];
        let [dark, lit] = [NONE, INTERIOR].map(|lights| {
            let image = scene.draw(lights);
            scene.colours(&image, rear_window)[0][0]
        });
        assert!(dark < 60 && lit > dark + 80, "{dark}, {lit} with light");
    }
}

#[test]
fn beacons_flash_red_and_blue_in_turn_while_they_are_on() {
    for mut scene in scenes(true) {
        let mut seen = |lights: u32, sim_secs: f64| {
            scene.sim_secs = sim_secs;
            let mut police = car(CAR, scene.pose(), 0xe8_e8e8);
            police.lights = lights;
            let image = scene.draw_actor(police, "vehicle.dodge.charger_police", &camera());
            let blue = places(&image, |[red, green, blue]| blue > 180 && red < 120 && green < 160);
            let red = places(&image, |[red, green, blue]| red > 180 && green < 100 && blue < 100);
            (red.len() > 20, blue.len() > 20)
        };
        assert_eq!(seen(NONE, 0.1), (false, false));
        assert_eq!(seen(SPECIAL, 0.1), (false, true));
        assert_eq!(seen(SPECIAL, 0.3), (true, false));
    }
}

/// Doors, from where they are seen, and a place that an open leaf reaches, in the car's axes.
#[test]
fn each_open_door_stands_out_of_the_body_where_its_hinge_is() {
    for mut scene in scenes(true) {
        let above = Camera {
            carrier_from_camera: Pose::from_parts(
                Vec3::new(6.0, 0.0, 9.0).into(),
                schemas::UnitQuaternion::from_euler_angles(0.0, PI / 2.0, 0.0),
            ),
            ..camera()
        };
        let aside = Camera {
            carrier_from_camera: level_pose(Vec3::new(6.0, -7.0, 1.2), PI / 2.0),
            ..camera()
        };
        let doors = [
            (0, &above, Vec3::new(0.5, 1.8, 0.7)),
            (1, &above, Vec3::new(0.5, -1.8, 0.7)),
            (2, &above, Vec3::new(-0.75, 1.61, 0.7)),
            (3, &above, Vec3::new(-0.75, -1.61, 0.7)),
            (4, &aside, Vec3::new(1.6, 0.0, 1.5)),
            (5, &aside, Vec3::new(-1.95, 0.0, 1.35)),
        ];
        for (open, ..) in doors {
            for (door, camera, at) in &doors {
                let mut actor = car(CAR, scene.pose(), 0x30_50a0);
                actor.doors = 1 << open;
                let camera = of_kind(ImageKind::Instance, camera);
                let image = scene.draw_actor(actor, "vehicle.tesla.model3", &camera);
                let (column, row) =
                    project(&camera, &(scene.pose() * nalgebra::Point3::from(*at)).coords);
                let at = ((row * image.width_px + column) * 4) as usize;
                let id = TagId::unpack(image.data[at..at + 4].try_into().unwrap()).id;
                let stands_out = id == CAR;
                assert_eq!(
                    stands_out,
                    open == *door,
                    "door {open} is open, at the place of {door}"
                );
            }
        }
    }
}

#[test]
fn windows_show_seats_and_what_is_behind_them() {
    for mut scene in scenes(true) {
        let actor = car(CAR, scene.pose(), 0x30_50a0);
        let frame = Frame { types: vec!["vehicle.tesla.model3".to_owned()], ..frame(vec![actor]) };
        let image = draw(&mut scene.renderer, &town(&[]), &job(frame, vec![camera()])).remove(0);
        // On the rear window, before a head rest and between two of them.
        let [[seat, _], [gap, _]] = [[-0.60, 0.40, 0.62], [-0.60, 0.02, 0.62]]
            .map(|place| scene.colours(&image, place).map(|[r, g, b]| r + g + b));
        assert!(gap - seat > 40, "{seat} before a head rest, {gap} beside it");
    }
}

#[test]
fn bodies_have_no_holes_through_which_the_road_is_seen() {
    const TYPES: [&str; 8] = [
        "vehicle.tesla.model3",
        "vehicle.audi.tt",
        "vehicle.mini.cooper_s",
        "vehicle.nissan.patrol",
        "vehicle.tesla.cybertruck",
        "vehicle.mercedes.sprinter",
        "vehicle.carlamotors.firetruck",
        "vehicle.mitsubishi.fusorosa",
    ];
    let mut renderer = renderers().next().unwrap();
    let camera = of_kind(ImageKind::Instance, &camera());
    for (type_id, turn) in TYPES.iter().flat_map(|one| (0..8).map(move |turn| (one, turn))) {
        let pose = level_pose(Vec3::new(5.0, 0.4, 0.0), 0.3 + turn as f32 * PI / 4.0);
        let frame = Frame { types: vec![(*type_id).to_owned()], ..frame(vec![car(CAR, pose, 0)]) };
        let image = draw(&mut renderer, &town(&[]), &job(frame, vec![camera.clone()])).remove(0);
        let width = image.width_px as usize;
        let (labels, _) = image.data.as_chunks::<4>();
        let is_car: Vec<bool> =
            labels.iter().map(|label| TagId::unpack(*label).id == CAR).collect();
        let holes = (width + 1..is_car.len() - width - 1).filter(|at| {
            !is_car[*at] && [at - 1, at + 1, at - width, at + width].iter().all(|at| is_car[*at])
        });
        let places: Vec<_> = holes.map(|at| (at % width, at / width)).collect();
        // Between a wheel and the lowest edge of the body there is a gap.
        assert!(places.len() <= 2, "{type_id} turned by {turn} eighths: {places:?}");
    }
}
