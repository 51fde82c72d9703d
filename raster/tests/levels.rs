//! Are pictures the same whichever instructions draw them, and in whatever parts?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::Arc;

use fearless_simd::Level;
use raster::{
    Canvas, Coat, Corner, Family, Lamp, Light, Material, Model, Occluder, PIXEL_BYTES, Placed,
    Prospect, Quality, Scene, ShadowMap, SunView, Texture, View,
};

const IN_PLACE: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
const SIZE_PX: (u32, u32) = (203, 96);

/// Every level that this processor has, worst first.
fn levels() -> Vec<Level> {
    let best = Level::new();
    let mut levels = Vec::new();
    #[cfg(target_arch = "x86_64")]
    levels.extend(
        [
            best.as_sse2().map(Level::Sse2),
            best.as_sse4_2().map(Level::Sse4_2),
            best.as_avx2().map(Level::Avx2),
        ]
        .into_iter()
        .flatten(),
    );
    levels.push(best);
    levels
}

/// A number from 0 to 1 that follows from another.
fn random(seed: u32) -> f32 {
    let mixed = seed.wrapping_mul(0x9e37_79b1) ^ (seed >> 3);
    ((mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 8) as f32 / 16_777_216.0
}

/// Ground to the horizon, and a swarm of triangles ahead, above and behind.
fn model() -> Model {
    let corner = |position: [f32; 3], normal: [f32; 3], material: u8| Corner {
        position,
        normal,
        facade_m: [position[0] + position[1], position[2]],
        label: 7,
        material,
        variant: 40,
    };
    let up = [0.0, 0.0, 1.0];
    let mut corners: Vec<Corner> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .into_iter()
        .map(|[x, y]| corner([500.0 * x, 500.0 * y, 0.0], up, 0))
        .collect();
    let mut triangles = vec![[0, 1, 2], [0, 2, 3]];
    for at in 0..400u32 {
        let part = |axis: u32| random(at * 17 + axis);
        let centre = [60.0 * part(0) - 10.0, 40.0 * part(1) - 20.0, 6.0 * part(2)];
        let first = corners.len() as u32;
        for which in 0..3 {
            let off = |axis: u32| 3.0 * part(3 + 3 * which + axis) - 1.5;
            let place = [centre[0] + off(0), centre[1] + off(1), centre[2] + off(2)];
            let normal = [part(20 + which) - 0.5, part(30 + which) - 0.5, 0.6];
            corners.push(corner(place, normal, (at % 3) as u8));
        }
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 1]]);
    }
    let things: Vec<_> = (0..triangles.len() as u32).map(|at| Some(at % 5)).collect();
    Model::new(corners, &triangles, &things)
}

fn light() -> Light {
    Light {
        to_light: [0.6, 0.0, 0.8],
        direct: [2.0, 1.9, 1.7],
        zenith: [0.13, 0.29, 0.66],
        horizon: [0.6, 0.74, 0.9],
        bounce: [0.1; 3],
        disc: 1.0,
        cloud: 0.4,
        haze_per_m: 0.003,
        haze_start_m: 5.0,
        haze_fall_per_m: 0.05,
        rain: 0.5,
        rain_phase: 0.3,
        wet: 0.6,
        night: 0.2,
        gain: 1.14,
        white: Some([[1.1, -0.05, 0.0], [0.02, 0.97, 0.01], [0.0, 0.03, 0.8]]),
    }
}

fn materials() -> [Material; 3] {
    let of = |family, pattern| Material {
        colour: [0.4, 0.3, 0.2],
        gloss: 0.5,
        family,
        pattern,
        tint: 4,
    };
    [of(Family::Ground, 3), of(Family::Facade, 0), of(Family::Body, 0)]
}

/// A beam along the view and a lamp before it.
fn lamps() -> [Lamp; 2] {
    let beam = Lamp::beam([0.0, 0.5, 0.6], [1.0, 0.0, 0.0], [300.0, 280.0, 250.0], 60.0);
    let beam = Lamp { narrow: [2.4, 30.0], cut: -0.01, ..beam };
    [beam, Lamp::round([9.0, -2.0, 3.0], [1.0, 4.0, 9.0], 8.0)]
}

/// A car and a person.
fn occluders() -> [Occluder; 2] {
    let car = Occluder {
        place_m: [8.0, 1.0, 0.0],
        ahead: [0.8, 0.6],
        half_m: [2.3, 0.9],
        height_m: 1.4,
        tall_m: 1.5,
        colour: [0.5, 0.1, 0.1],
    };
    [car, Occluder { place_m: [5.0, -1.0, 0.0], half_m: [0.2, 0.2], height_m: 0.4, ..car }]
}

/// On every second of the things: a colour, both, light.
fn coats() -> [Coat; 3] {
    let texture = |seed: u32, brightness: f32| {
        let rgb: Vec<u8> = (0..13 * 7 * 3).map(|at| (255.0 * random(at + seed)) as u8).collect();
        Some(Arc::new(Texture::new([13, 7], brightness, &rgb).unwrap()))
    };
    let coat = |thing, half_m: [f32; 3], diffuse, emissive| {
        let row = |axis: usize| IN_PLACE[axis].map(|part| part / half_m[axis]);
        Coat { thing, box_from_world: [row(0), row(1), row(2)], half_m, diffuse, emissive }
    };
    [
        coat(0, [500.0, 500.0, 1e-3], texture(1, 1.0), None),
        coat(2, [60.0, 20.0, 6.0], texture(2, 1.0), texture(3, 2.0)),
        coat(4, [60.0, 20.0, 6.0], None, texture(4, 0.5)),
    ]
}

/// Level, ahead.
fn view() -> View {
    View {
        eye_m: [0.0, 0.0, 1.7],
        forward: [1.0, 0.0, 0.0],
        left: [0.0, 1.0, 0.0],
        up: [0.0, 0.0, 1.0],
        half_extent: [1.0, 0.5],
        width_px: SIZE_PX.0,
        height_px: SIZE_PX.1,
        near_m: 0.08,
    }
}

/// Colours of both qualities, depths, labels and normals, drawn in bands of so many rows.
fn picture(level: Level, model: &Model, band: u32, is_hidden: Option<u32>) -> [Vec<u8>; 5] {
    picture_of(level, &view(), (model, IN_PLACE), band, is_hidden)
}

fn picture_of(
    level: Level,
    view: &View,
    (model, world_from_model): (&Model, [[f32; 4]; 3]),
    band: u32,
    is_hidden: Option<u32>,
) -> [Vec<u8>; 5] {
    let placed = [Placed { model, world_from_model, tints: [[255; 4]; 4], label: 0 }];
    let hides = |thing: u32| Some(thing) == is_hidden;
    let hides: &(dyn Fn(u32) -> bool + Sync) = &hides;
    let materials = materials();
    let lamps = lamps();
    let scene = Scene {
        placed: &placed,
        is_hidden: is_hidden.map(|_| hides),
        materials: &materials,
        lamps: &lamps,
        occluders: &occluders(),
        coats: &coats(),
    };
    let sun = SunView {
        right: [0.0, 0.02, 0.0, 0.0],
        up: [-0.016, 0.0, 0.012, 0.3],
        depth: [-0.003, 0.0, -0.004, 0.5],
        side_px: 256,
    };
    let mut shadow = ShadowMap::empty(sun);
    shadow.add(level, &placed, None);
    let pitch = view.width_px as usize * PIXEL_BYTES;
    let mut pictures = [const { Vec::new() }; 5];
    let mut canvas = Canvas::default();
    let prospect = Prospect::of(level, view, &scene, 0.5);
    for start in (0..view.height_px).step_by(band as usize) {
        let rows = start..(start + band).min(view.height_px);
        canvas.look(level, view, rows.clone(), (&scene, &prospect));
        let mut parts = [const { Vec::new() }; 5];
        parts.iter_mut().for_each(|part| *part = vec![0; pitch * rows.len()]);
        let [colour, rough, depth, labels, normals] = &mut parts;
        for (colour, quality) in [(colour, Quality::High), (rough, Quality::Low)] {
            let light = (&light(), &shadow, quality);
            canvas.colour(level, view, &scene, light, (colour, pitch));
        }
        canvas.depth(level, 1_000.0, (depth, pitch));
        canvas.labels(&scene, 11, PIXEL_BYTES, (labels, pitch));
        canvas.normals(level, view, &scene, PIXEL_BYTES, (normals, pitch));
        pictures.iter_mut().zip(parts).for_each(|(all, part)| all.extend(part));
    }
    pictures
}

#[test]
fn every_processor_draws_the_same_bytes() {
    let model = model();
    let levels = levels();
    let first = picture(levels[0], &model, SIZE_PX.1, None);
    for level in levels {
        let other = picture(level, &model, SIZE_PX.1, None);
        for (at, (first, other)) in first.iter().zip(&other).enumerate() {
            let differing = first.iter().zip(other).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "picture {at} by {}", raster::level_name(level));
        }
    }
}

#[test]
fn a_picture_in_bands_is_the_picture_in_one() {
    let model = model();
    let whole = picture(Level::new(), &model, SIZE_PX.1, None);
    for band in [1, 7, 40] {
        assert!(picture(Level::new(), &model, band, None) == whole, "bands of {band} rows");
    }
}

#[test]
fn a_level_ground_has_its_depth_and_nothing_shows_through_it() {
    let model = model();
    let [_, _, depth, labels, normals] = picture(Level::new(), &model, SIZE_PX.1, None);
    let at = |x: u32, y: u32| ((y * SIZE_PX.0 + x) * 4) as usize;
    let depth_m = |x, y| f32::from_le_bytes(depth[at(x, y)..at(x, y) + 4].try_into().unwrap());
    // 1.7 m below the eye, the last row looks 0.5 × 95 / 96 down for each metre ahead.
    let ground_m = 1.7 / (0.5 * 95.0 / 96.0);
    let last = SIZE_PX.1 - 1;
    let ground = (0..SIZE_PX.0).filter(|x| (depth_m(*x, last) - ground_m).abs() < 1e-3).count();
    assert!(ground > 100, "{ground} pixels of {}", SIZE_PX.0);
    for x in 0..SIZE_PX.0 {
        assert!(depth_m(x, last) < ground_m + 1e-3);
        assert_eq!(labels[at(x, last)], 7);
    }
    assert!(labels.chunks(4).any(|label| label == [11, 0, 0, 0]), "no sky");
    assert!(normals.chunks(4).any(|normal| normal == [0, 0, 127, 0]), "no level ground");
}

#[test]
fn hidden_things_are_missing() {
    let model = model();
    let all = picture(Level::new(), &model, SIZE_PX.1, None);
    let some = picture(Level::new(), &model, SIZE_PX.1, Some(3));
    let none = picture(Level::new(), &model, SIZE_PX.1, Some(9));
    assert!(all[3] != some[3] && all == none);
}

/// Goal: nothing panics, and depths are depths, whatever is looked at from wherever. Method: the
/// smallest and the longest pictures, the narrowest and the widest lens, eyes on a corner, among
/// triangles, on the ground and far away.
#[test]
fn views_at_the_limits_are_drawn_by_every_processor_alike() {
    let model = model();
    let sized = |width_px, height_px| View { width_px, height_px, ..view() };
    let lens = |half: f32| View { half_extent: [half, 0.5 * half], ..view() };
    let from = |eye_m| View { eye_m, ..view() };
    let views = [
        sized(1, 1),
        sized(4_096, 1),
        sized(1, 300),
        lens(1e-6),
        lens(1e-30),
        lens(11.43),
        from([500.0, 500.0, 0.0]),
        from([10.0, 0.0, 3.0]),
        from([0.0, 0.0, 0.0]),
        from([1e5, -1e5, 1e5]),
    ];
    for view in views {
        let draw = |level, band| picture_of(level, &view, (&model, IN_PLACE), band, None);
        let whole = draw(Level::new(), view.height_px);
        for depth in whole[2].as_chunks::<4>().0 {
            let depth_m = f32::from_le_bytes(*depth);
            assert!((0.079..=1_000.0).contains(&depth_m), "{depth_m} m in {view:?}");
        }
        for level in levels() {
            let name = raster::level_name(level);
            assert!(draw(level, view.height_px) == whole, "by {name}: {view:?}");
        }
    }
}

/// A placement without a height has a normal all the same.
#[test]
fn what_is_pressed_flat_faces_up() {
    let model = model();
    let flat = [IN_PLACE[0], IN_PLACE[1], [0.0; 4]];
    let [_, _, _, labels, normals] =
        picture_of(Level::new(), &view(), (&model, flat), SIZE_PX.1, None);
    let pixels = labels.as_chunks::<4>().0.iter().zip(normals.as_chunks::<4>().0);
    let shown: Vec<_> = pixels.filter(|(label, _)| **label == [7, 0, 0, 0]).collect();
    assert!(shown.len() > 1_000, "{} pixels", shown.len());
    assert!(shown.iter().all(|(_, normal)| **normal == [0, 0, 127, 0]));
}
