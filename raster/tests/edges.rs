//! Do edges at high quality show how much of each pixel lies beyond them?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use fearless_simd::Level;
use raster::{
    Canvas, Corner, Family, Light, Material, Model, PIXEL_BYTES, Placed, Prospect, Quality, Scene,
    ShadowMap, SunView, View,
};

const SIDE_PX: u32 = 64;
const IN_PLACE: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// At a place in the picture, so far away.
fn corner([right_px, down_px]: [f32; 2], depth_m: f32, material: u8) -> Corner {
    let position = [32.0, 32.0 - right_px, 32.0 - down_px].map(|part| part * depth_m / 32.0);
    Corner { position, normal: [-1.0, 0.0, 0.0], material, ..Corner::default() }
}

/// A board across the view, from the left border of the picture to a line that leans to the right,
/// cut into stripes that end at these shares of the way. One pixel is a metre.
fn board(ends: &[f32], lean: f32) -> Model {
    let height_m = SIDE_PX as f32;
    let corner = |right_m: f32, down_m: f32| corner([right_m, down_m], 32.0, 0);
    let line = |share: f32| {
        let middle_m = 64.0 * share - 32.0;
        let at = |down_m: f32| 32.0 + middle_m + share * lean * (down_m - height_m / 2.0);
        [corner(at(0.0), 0.0), corner(at(height_m), height_m)]
    };
    let corners: Vec<Corner> =
        std::iter::once(&0.0).chain(ends).flat_map(|share| line(*share)).collect();
    let stripe = |at: u32| {
        let first = 2 * at;
        [[first, first + 1, first + 2], [first + 1, first + 3, first + 2]]
    };
    let triangles: Vec<[u32; 3]> = (0..ends.len() as u32).flat_map(stripe).collect();
    Model::new(corners, &triangles, &[])
}

/// Dark sky, and everything lit alike from ahead.
fn light() -> Light {
    Light {
        to_light: [-1.0, 0.0, 0.0],
        direct: [0.4; 3],
        zenith: [0.0; 3],
        horizon: [0.0; 3],
        bounce: [0.0; 3],
        disc: 0.0,
        cloud: 0.0,
        haze_per_m: 0.0,
        haze_start_m: 0.0,
        haze_fall_per_m: 0.0,
        rain: 0.0,
        rain_phase: 0.0,
        wet: 0.0,
        night: 0.0,
        gain: 1.0,
        white: None,
    }
}

/// How many pixels of each row the board covers, by its light.
fn covered(model: &Model, quality: Quality) -> Vec<f32> {
    let view = View {
        eye_m: [0.0; 3],
        forward: [1.0, 0.0, 0.0],
        left: [0.0, 1.0, 0.0],
        up: [0.0, 0.0, 1.0],
        half_extent: [1.0, 1.0],
        width_px: SIDE_PX,
        height_px: SIDE_PX,
        near_m: 0.1,
    };
    let level = Level::new();
    let placed = [Placed { model, world_from_model: IN_PLACE, tints: [[255; 4]; 4], label: 1 }];
    let materials = [0.5, 0.0].map(|grey| Material {
        colour: [grey; 3],
        gloss: 0.0,
        family: Family::Body,
        pattern: 0,
        tint: 4,
    });
    let scene = Scene { placed: &placed, materials: &materials, ..Scene::EMPTY };
    let sun = SunView { right: [0.0; 4], up: [0.0; 4], depth: [0.0; 4], side_px: 8 };
    let shadow = ShadowMap::empty(sun);
    let prospect = Prospect::of(level, &view, &scene, 0.5);
    let pitch = (SIDE_PX as usize) * PIXEL_BYTES;
    let mut out = vec![0; pitch * SIDE_PX as usize];
    let mut canvas = Canvas::default();
    canvas.look(level, &view, 0..SIDE_PX, (&scene, &prospect));
    canvas.colour(level, &view, &scene, (&light(), &shadow, quality), (&mut out, pitch));
    let squared = |value: u8| f32::from(value) * f32::from(value);
    let full = out.as_chunks::<4>().0.iter().map(|[r, ..]| squared(*r)).fold(0.0, f32::max);
    assert!(full > 2_500.0, "the board is lit");
    let of_row = |row: &[u8]| row.as_chunks::<4>().0.iter().map(|[r, ..]| squared(*r) / full).sum();
    out.chunks(pitch).map(of_row).collect()
}

/// How far rows are from what the board covers of them, at most.
fn worst(ends: &[f32], lean: f32, quality: Quality) -> f32 {
    let covered = covered(&board(ends, lean), quality);
    let share = ends.last().unwrap();
    let off = |(row, covered): (usize, &f32)| {
        let down = row as f32 + 0.5 - SIDE_PX as f32 / 2.0;
        (covered - (64.0 * share + share * lean * down)).abs()
    };
    covered.iter().enumerate().map(off).fold(0.0, f32::max)
}

#[test]
fn a_leaning_edge_covers_as_much_of_each_row_as_lies_before_it() {
    for lean in [0.0, 0.07, -0.31] {
        let end = 0.503;
        let (soft, hard) = (worst(&[end], lean, Quality::High), worst(&[end], lean, Quality::Low));
        assert!(soft < 0.1, "{lean}: {soft} pixels");
        assert!(hard > 0.15, "{lean}: {hard} pixels without");
    }
}

#[test]
fn stripes_too_thin_to_be_seen_belong_to_the_edge() {
    // The last two are a fifth of a pixel wide.
    let ends = [0.5, 0.503, 0.506];
    for lean in [0.07, -0.31] {
        let soft = worst(&ends, lean, Quality::High);
        assert!(soft < 0.1, "{lean}: {soft} pixels");
    }
}

#[test]
fn what_comes_out_of_another_thing_has_a_soft_edge_there() {
    let meets_px = 32.4;
    let far_m = 1.0 / (1.0 / 16.0 - 64.0 / meets_px / 32.0);
    // A light board, and a dark one that comes nearer to the left.
    let boards = [([32.0; 2], 0), ([16.0, far_m], 1)];
    let corners: Vec<Corner> = boards
        .into_iter()
        .flat_map(|([left_m, right_m], material)| {
            let places = [[0.0, 0.0], [0.0, 64.0], [64.0, 0.0], [64.0, 64.0]];
            let depths_m = [left_m, left_m, right_m, right_m];
            [0, 1, 2, 3].map(|at| corner(places[at], depths_m[at], material))
        })
        .collect();
    let model = Model::new(corners, &[[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]], &[]);
    for row in covered(&model, Quality::High) {
        assert!((row - (64.0 - meets_px)).abs() < 0.05, "{row}");
    }
}
