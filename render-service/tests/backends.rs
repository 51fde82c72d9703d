//! Do processors and a Vulkan device draw the same pictures? Every kind, on a street of a real town
//! with cars and people, at several hours and in several weathers.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::collections::BTreeMap;
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use common::{camera, car, job, of_kind, town};
use render_service::{AdapterChoice, Material, Renderer, TownScene};
use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, Image, ImageKind, MapRef, Pose, RenderJob, Tick,
    Vec3, Weather, WorldId, level_pose,
};

/// Flags of lights of vehicles.
const LOW_BEAM: u32 = 1 << 1;
const BRAKE: u32 = 1 << 3;

/// Processors, and a GPU or Mesa's device; `None`, counted as skipped, where both are missing.
fn both() -> Option<[Renderer; 2]> {
    let ours = Renderer::new(AdapterChoice::Software).unwrap();
    assert!(ours.adapter_name().starts_with("causeway-raster"), "{}", ours.adapter_name());
    let device = common::device();
    match &device {
        Some(device) => eprintln!("compared with {}", device.adapter_name()),
        None => eprintln!("skipped: no Vulkan adapter"),
    }
    device.map(|device| [ours, device])
}

struct Street {
    town: Arc<TownScene>,
    map: roads::Map,
}

impl Street {
    fn new() -> Self {
        let name = "Town10HD_Opt";
        let map = roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
        Self { town: Arc::new(TownScene::of_map(&map)), map }
    }

    /// At a spawn point, with so many cars and people ahead.
    fn frame(&self, spawn: usize, count: u32, weather: Weather) -> (Frame, Pose) {
        let start: Pose = self.map.spawn_points()[spawn].cast();
        let mut actors = Vec::new();
        for at in 0..count {
            let ahead = Vec3::new(12.0 + 9.0 * at as f32, 3.5 * (at % 3) as f32, 0.0);
            let colour = 0x20_20a0 + 0x10_0800 * at;
            actors.push(car(1 + at, start * level_pose(ahead, 0.1 * at as f32), colour));
        }
        for at in 0..count {
            let aside = Vec3::new(7.0 + 3.0 * at as f32, -3.0, 0.95);
            let pose = start * level_pose(aside, at as f32);
            let id = ActorId::new(100 + at).unwrap();
            actors.push(ActorState {
                box_half_extent_m: Vec3::new(0.19, 0.19, 0.93),
                ..ActorState::at_rest(id, ActorKind::Walker, 0, pose)
            });
        }
        let map = MapRef { name: self.map.name().to_owned(), digest: self.map.digest().to_owned() };
        let frame = Frame {
            tick: Tick(20),
            sim_secs: 1.0,
            types: vec!["vehicle.tesla.model3".to_owned()],
            actors,
            weather,
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        };
        (frame, start)
    }

    /// The same picture by both.
    fn pair(&self, both: &mut [Renderer; 2], job: &RenderJob) -> [Image; 2] {
        both.each_mut().map(|renderer| {
            renderer.render(&[(Arc::clone(&self.town), job)]).remove(0).unwrap().images.remove(0)
        })
    }
}

fn looking(start: Pose, kind: ImageKind) -> Camera {
    let camera = Camera {
        carrier_from_camera: start * level_pose(Vec3::new(2.5, 0.0, 1.4), 0.0),
        horizontal_fov_rad: FRAC_PI_2,
        ..camera()
    };
    of_kind(kind, &camera)
}

/// Part of the pixels, of so many bytes each, for which this does not hold.
fn part_that_fails<const BYTES: usize>(
    [a, b]: &[Image; 2],
    holds: impl Fn(&[u8; BYTES], &[u8; BYTES]) -> bool,
) -> f32 {
    assert_eq!(a.data.len(), b.data.len());
    let (a, b) = (a.data.as_chunks::<BYTES>().0, b.data.as_chunks::<BYTES>().0);
    a.iter().zip(b).filter(|(a, b)| !holds(a, b)).count() as f32 / a.len() as f32
}

/// By how much channels of the first picture are outside of what the other one has there and right
/// beside: the mean, and the part of the pixels for which it is more than 16 of 255. Edges of the
/// first one are soft; a GPU's are as well.
fn outside_of_neighbours([a, b]: &[Image; 2]) -> [f32; 2] {
    let (width, height) = (b.width_px as usize, b.height_px as usize);
    let (a, b) = (a.data.as_chunks::<4>().0, b.data.as_chunks::<4>().0);
    let (mut sum, mut many) = (0.0, 0);
    for (at, ours) in a.iter().enumerate() {
        let (column, row) = (at % width, at / width);
        let near = [
            Some(at),
            (column > 0).then(|| at - 1),
            (column + 1 < width).then_some(at + 1),
            (row > 0).then(|| at - width),
            (row + 1 < height).then_some(at + width),
        ];
        let off = (0..3).map(|channel| {
            let theirs = near.iter().flatten().map(|at| b[*at][channel]);
            let (low, high) = (theirs.clone().min().unwrap(), theirs.max().unwrap());
            low.saturating_sub(ours[channel]).max(ours[channel].saturating_sub(high))
        });
        sum += off.clone().map(f32::from).sum::<f32>();
        many += usize::from(off.max().unwrap() > 16);
    }
    [sum / (3 * a.len()) as f32, many as f32 / a.len() as f32]
}

/// Mean difference of channels.
fn mean_difference([a, b]: &[Image; 2]) -> f32 {
    let sum: u64 = a.data.iter().zip(&b.data).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    // A quarter of the bytes is the alpha, the same everywhere.
    sum as f32 / (a.data.len() as f32 * 0.75)
}

/// Labels that many pixels of one picture have and none of the other.
fn labels_of_one_alone([a, b]: &[Image; 2]) -> Vec<[u8; 4]> {
    const PIXELS_MIN: usize = 20;
    let [a, b] = [a, b].map(|image| {
        let mut count: BTreeMap<[u8; 4], usize> = BTreeMap::new();
        for label in image.data.as_chunks::<4>().0 {
            *count.entry(*label).or_default() += 1;
        }
        count
    });
    let missing = |from: &BTreeMap<[u8; 4], usize>, of: &BTreeMap<[u8; 4], usize>| {
        let large =
            of.iter().filter(|(label, count)| **count >= PIXELS_MIN && !from.contains_key(*label));
        large.map(|(label, _)| *label).collect::<Vec<_>>()
    };
    [missing(&a, &b), missing(&b, &a)].concat()
}

#[test]
fn colours_are_those_of_a_device_at_every_hour_and_in_every_weather() {
    let Some(mut both) = both() else { return };
    let street = Street::new();
    let noon = Weather { sun_azimuth_rad: 0.9, ..Weather::CLEAR_NOON };
    let weathers = [
        ("noon", noon),
        ("sunset", Weather { sun_altitude_rad: 0.12, cloudiness_percent: 20.0, ..noon }),
        ("night", Weather { sun_altitude_rad: -0.8, ..noon }),
        (
            "rainy night with lights on",
            Weather {
                sun_altitude_rad: -0.8,
                cloudiness_percent: 90.0,
                precipitation_percent: 40.0,
                wetness_percent: 90.0,
                ..noon
            },
        ),
        (
            "rain",
            Weather {
                cloudiness_percent: 90.0,
                precipitation_percent: 60.0,
                wetness_percent: 80.0,
                ..noon
            },
        ),
        ("fog", Weather { fog_density_percent: 60.0, cloudiness_percent: 60.0, ..noon }),
        ("dust", Weather { dust_storm_percent: 80.0, ..noon }),
    ];
    let mut worst = [0.0f32; 3];
    for (at, (name, weather)) in weathers.into_iter().enumerate() {
        let (mut frame, start) = street.frame(7 * at, 8, weather);
        if name.ends_with("lights on") {
            let cars = frame.actors.iter_mut().filter(|actor| actor.kind == ActorKind::Vehicle);
            cars.for_each(|car| car.lights = LOW_BEAM | BRAKE);
        }
        let pair = street.pair(&mut both, &job(frame, vec![looking(start, ImageKind::Rgb)]));
        let [outside, part] = outside_of_neighbours(&pair);
        let mean = mean_difference(&pair);
        eprintln!(
            "{name}: mean difference {mean:.2} of 255, {outside:.3} outside of neighbours, {:.3} % \
             of another colour",
            100.0 * part
        );
        worst = [worst[0].max(mean), worst[1].max(outside), worst[2].max(part)];
    }
    // A GPU has four samples a pixel and softer shadows.
    let most = if both[1].is_software() { [1.5, 0.1, 0.001] } else { [3.0, 1.0, 0.02] };
    assert!(worst.iter().zip(most).all(|(worst, most)| *worst <= most), "{worst:?}");
}

#[test]
fn depth_of_a_town_is_that_of_a_device_but_for_edges() {
    let Some(mut both) = both() else { return };
    let street = Street::new();
    let mut worst = 0.0f32;
    for spawn in [0, 9, 30, 61] {
        let (frame, start) = street.frame(spawn, 0, Weather::CLEAR_NOON);
        let pair = street.pair(&mut both, &job(frame, vec![looking(start, ImageKind::Depth)]));
        let wrong = part_that_fails::<4>(&pair, |a, b| {
            let (a, b) = (f32::from_le_bytes(*a), f32::from_le_bytes(*b));
            (a - b).abs() <= 1e-4 * a.min(b)
        });
        eprintln!("spawn {spawn}: {:.3} % of depths differ", 100.0 * wrong);
        worst = worst.max(wrong);
    }
    assert!(worst <= 0.002, "{worst}");
}

#[test]
fn labels_and_normals_are_those_of_a_device_but_for_edges() {
    let Some(mut both) = both() else { return };
    let street = Street::new();
    let mut worst = [0.0f32; 3];
    for spawn in [0, 9, 30, 61] {
        let (frame, start) = street.frame(spawn, 6, Weather::CLEAR_NOON);
        let mut pair =
            |kind| street.pair(&mut both, &job(frame.clone(), vec![looking(start, kind)]));
        let labels = pair(ImageKind::Instance);
        let missing = labels_of_one_alone(&labels);
        assert!(missing.is_empty(), "spawn {spawn}: {missing:?} are in one picture alone");
        let wrong = [
            part_that_fails::<1>(&pair(ImageKind::Semantic), |a, b| a == b),
            part_that_fails::<4>(&labels, |a, b| a == b),
            // 12 of 127 are 5 degrees.
            part_that_fails::<3>(&pair(ImageKind::Normals), |a, b| {
                a.iter().zip(b).all(|(a, b)| (*a as i8).abs_diff(*b as i8) <= 12)
            }),
        ];
        eprintln!("spawn {spawn}: {:?} % differ", wrong.map(|part| 100.0 * part));
        worst = [0, 1, 2].map(|at| worst[at].max(wrong[at]));
    }
    assert!(worst.iter().all(|part| *part <= 0.001), "{worst:?}");
}

#[test]
fn what_comes_too_near_or_reaches_far_out_is_cut_like_by_a_device() {
    let Some(mut both) = both() else { return };
    let town = town(&[common::pillar(Material::Wall, [1.0, 0.3], 0.6, 9.0)]);
    let narrow = Camera { horizontal_fov_rad: 0.05, ..camera() };
    let wide = Camera { horizontal_fov_rad: 2.9, ..camera() };
    let low =
        Camera { carrier_from_camera: level_pose(Vec3::new(0.0, 0.0, 0.05), 2.0), ..camera() };
    for (name, camera) in [("narrow", narrow), ("wide", wide), ("low", low)] {
        let job = job(common::frame(vec![]), vec![of_kind(ImageKind::Depth, &camera)]);
        let pair = both.each_mut().map(|renderer| common::draw(renderer, &town, &job).remove(0));
        let wrong = part_that_fails::<4>(&pair, |a, b| {
            let (a, b) = (f32::from_le_bytes(*a), f32::from_le_bytes(*b));
            (a - b).abs() <= 1e-3 * a.min(b)
        });
        assert!(wrong <= 0.005, "{name}: {wrong}");
    }
}
