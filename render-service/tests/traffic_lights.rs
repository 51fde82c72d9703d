//! Do the lamps of traffic lights show what a frame says?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::Arc;

use common::{camera, draw, frame, job, pixel, project, renderers};
use render_service::{Renderer, TownScene};
use roads::{Landmark, Map};
use schemas::{
    ActorId, Camera, Frame, HiddenScenery, Image, ImageKind, MapRef, Pose, TrafficLightColour,
    TrafficLightState, Vec3, Weather, level_pose,
};

const COLOURS: [TrafficLightColour; 5] = [
    TrafficLightColour::Red,
    TrafficLightColour::Yellow,
    TrafficLightColour::Green,
    TrafficLightColour::Off,
    TrafficLightColour::Unknown,
];

/// A map, its scene, and what tells one of its lights from the others.
struct Town {
    map: Map,
    scene: Arc<TownScene>,
}

impl Town {
    fn built_in(name: &str) -> Self {
        let map = Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
        Self { scene: Arc::new(TownScene::of_map(&map)), map }
    }

    /// A frame in which the lights show these colours, one after the other.
    fn frame(&self, colours: impl Iterator<Item = TrafficLightColour>, frozen: bool) -> Frame {
        let map = MapRef { name: String::new(), digest: self.map.digest().to_owned() };
        let state = |(at, colour)| TrafficLightState {
            // Ids say nothing: another world may count from elsewhere.
            actor: ActorId::new(900 + 3 * at as u32).unwrap(),
            colour,
            group: 0,
            frozen,
            elapsed_secs: 0.0,
            green_secs: 10.0,
            yellow_secs: 3.0,
            red_secs: 2.0,
        };
        let count = self.map.traffic_lights().lights.len();
        let traffic_lights = colours.take(count).enumerate().map(state).collect();
        Frame { map, traffic_lights, hidden: self.everything(), ..frame(vec![]) }
    }

    /// Houses and trees, which stand before some lights.
    fn everything(&self) -> HiddenScenery {
        let mut hidden = HiddenScenery::default();
        (0..self.map.scenery().len()).for_each(|place| hidden.set(place as u32, true));
        hidden
    }

    fn landmark(&self, light: usize) -> &Landmark {
        let id = &self.map.traffic_lights().lights[light].id;
        self.map.landmarks().iter().find(|landmark| landmark.id == *id).unwrap()
    }

    fn draw(&self, renderer: &mut Renderer, frame: &Frame, camera: &Camera) -> Image {
        draw(renderer, &self.scene, &job(frame.clone(), vec![camera.clone()])).remove(0)
    }
}

/// Where the lamps of a light are, and a camera before them.
fn lamps_and_camera(landmark: &Landmark, away_m: f32) -> ([Vec3; 3], Camera) {
    let head: Pose = landmark.light_head().cast();
    let lamp = |z: f32| head * nalgebra::Point3::new(-0.12, 0.0, z);
    let before = head * level_pose(Vec3::new(-away_m, 0.0, 0.0), 0.0);
    let lens = 0.6;
    let camera = Camera { carrier_from_camera: before, horizontal_fov_rad: lens, ..camera() };
    ([0.34, 0.0, -0.34].map(|z| lamp(z).coords), camera)
}

/// Colours of the three lamps, from the top.
fn seen(image: &Image, lamps: &[Vec3; 3], camera: &Camera) -> [[i32; 3]; 3] {
    lamps.map(|lamp| {
        let (column, row) = project(camera, &lamp);
        pixel(image, column, row)
    })
}

/// The lamp that is lit, from its colour; panics when two are, or one in a wrong colour.
fn lit_lamp(lamps: [[i32; 3]; 3]) -> Option<usize> {
    let is_lit = |[red, green, blue]: [i32; 3]| red.max(green).max(blue) > 170;
    let lit: Vec<usize> = (0..3).filter(|lamp| is_lit(lamps[*lamp])).collect();
    assert!(lit.len() < 2, "{lamps:?}");
    let lit = *lit.first()?;
    let [red, green, blue] = lamps[lit];
    match lit {
        0 => assert!(red > 200 && green < 100 && blue < 100, "{lamps:?}"),
        1 => assert!(red > 200 && (100..red).contains(&green) && blue < 100, "{lamps:?}"),
        _ => assert!(green > 200 && red < 120 && blue < green - 40, "{lamps:?}"),
    }
    Some(lit)
}

fn lamp_of(colour: TrafficLightColour) -> Option<usize> {
    Some(match colour {
        TrafficLightColour::Red => 0,
        TrafficLightColour::Yellow => 1,
        TrafficLightColour::Green => 2,
        TrafficLightColour::Off | TrafficLightColour::Unknown => return None,
    })
}

#[test]
fn a_light_shows_its_colour_by_day_and_night_frozen_or_not_and_nothing_when_off() {
    for mut renderer in renderers() {
        let town = Town::built_in("Town10HD_Opt");
        let (lamps, camera) = lamps_and_camera(town.landmark(0), 8.0);
        for (colour, frozen, sun_altitude_rad) in COLOURS
            .into_iter()
            .flat_map(|colour| [(colour, false, 1.2), (colour, true, 1.2), (colour, false, -0.8)])
        {
            let weather = Weather { sun_altitude_rad, ..Weather::CLEAR_NOON };
            let frame = Frame { weather, ..town.frame(std::iter::repeat(colour), frozen) };
            let image = town.draw(&mut renderer, &frame, &camera);
            let found = lit_lamp(seen(&image, &lamps, &camera));
            assert_eq!(found, lamp_of(colour), "{colour:?}, frozen {frozen}, {sun_altitude_rad}");
        }
    }
}

/// Each light shows its own colour, not its neighbour's.
#[test]
fn every_light_of_every_town_shows_its_own_colour() {
    // Many pictures: only by what draws fast.
    let mut renderer = renderers().next().unwrap();
    let mut found = 0;
    for town in roads::town::names().map(Town::built_in) {
        let colours = COLOURS.into_iter().cycle();
        let frame = town.frame(colours.clone(), false);
        for (light, colour) in (0..frame.traffic_lights.len()).zip(colours) {
            let (lamps, camera) = lamps_and_camera(town.landmark(light), 3.0);
            let camera = Camera { width_px: 160, height_px: 90, ..camera };
            let image = town.draw(&mut renderer, &frame, &camera);
            let lit = lit_lamp(seen(&image, &lamps, &camera));
            assert_eq!(lit, lamp_of(colour), "light {light} of {}", town.map.name());
            found += 1;
        }
    }
    assert!(found > 20, "{found} lights");
}

#[test]
fn lamps_are_dark_in_a_world_without_lights() {
    for mut renderer in renderers() {
        let town = Town::built_in("Town10HD_Opt");
        let (lamps, camera) = lamps_and_camera(town.landmark(0), 8.0);
        let frame = town.frame(std::iter::empty(), false);
        let image = town.draw(&mut renderer, &frame, &camera);
        assert_eq!(lit_lamp(seen(&image, &lamps, &camera)), None);
    }
}

/// A car 60 m before a light must be able to tell red from green, though it is drawn coarsely.
#[test]
fn the_colour_is_seen_from_60_metres() {
    for mut renderer in renderers() {
        let town = Town::built_in("Town10HD_Opt");
        for colour in &COLOURS[..3] {
            let (lamps, camera) = lamps_and_camera(town.landmark(0), 60.0);
            let frame = town.frame(std::iter::repeat(*colour), false);
            let image = town.draw(&mut renderer, &frame, &camera);
            assert_eq!(lit_lamp(seen(&image, &lamps, &camera)), lamp_of(*colour), "{colour:?}");
        }
    }
}

#[test]
fn lights_look_the_same_to_cameras_of_tags_whatever_they_show() {
    for mut renderer in renderers() {
        let town = Town::built_in("Town10HD_Opt");
        let (_, camera) = lamps_and_camera(town.landmark(0), 8.0);
        let tags = common::of_kind(ImageKind::Instance, &camera);
        let mut of = |colour| {
            let frame = town.frame(std::iter::repeat(colour), false);
            town.draw(&mut renderer, &frame, &tags)
        };
        assert!(of(TrafficLightColour::Red) == of(TrafficLightColour::Off));
    }
}
