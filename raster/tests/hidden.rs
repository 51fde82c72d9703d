//! Goal: what is left out because nearer things hide it is seen nowhere. Method: in every pixel a
//! picture of many things shows what the nearest one shows in a picture of its own.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use fearless_simd::Level;
use raster::{Canvas, Corner, Model, PIXEL_BYTES, Placed, Prospect, Scene, View};

const MOST_M: f32 = 1_000.0;

/// A number from 0 to 1 that follows from another.
fn random(seed: u32) -> f32 {
    let mixed = seed.wrapping_mul(0x9e37_79b1) ^ (seed >> 3);
    ((mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 8) as f32 / 16_777_216.0
}

fn model(triangles: &[[[f32; 3]; 3]]) -> Model {
    let place = |position: &[f32; 3]| Corner { position: *position, ..Corner::default() };
    let corners: Vec<_> = triangles.iter().flatten().map(place).collect();
    let numbers = (0..triangles.len() as u32).map(|at| [0, 1, 2].map(|corner| 3 * at + corner));
    Model::new(corners, &numbers.collect::<Vec<_>>(), &[])
}

/// A rectangle across the view, as two triangles that face it.
fn wall(ahead: f32, [left, right]: [f32; 2], [low, high]: [f32; 2]) -> [[[f32; 3]; 3]; 2] {
    let at = |y: f32, z: f32| [ahead, y, z];
    let [a, b, c, d] = [at(left, low), at(right, low), at(right, high), at(left, high)];
    [[a, b, c], [a, c, d]]
}

/// Walls with gaps between them, and swarms of triangles before, between and behind them.
fn models() -> Vec<Model> {
    let mut models = Vec::new();
    for (ahead, left) in [(9.0, 9.0), (9.0, -1.5), (21.0, 4.0), (45.0, 30.0)] {
        models.push(model(&wall(ahead, [left, left - 7.5], [-3.0, 0.6 * ahead])));
    }
    for swarm in 0..60u32 {
        let part = |at: u32| random(swarm * 977 + at);
        let ahead = 4.0 + 70.0 * part(0);
        let middle = [ahead, ahead * (2.0 * part(1) - 1.0), 0.3 * ahead * part(2)];
        let triangles: Vec<_> = (0..12u32)
            .map(|at| {
                let off = |which: u32| part(7 + at * 9 + which) * 2.0 - 1.0;
                [0, 3, 6].map(|first| [0, 1, 2].map(|axis| middle[axis] + off(first + axis as u32)))
            })
            .collect();
        models.push(model(&triangles));
    }
    models
}

/// Depths of all pixels, drawn in bands of so many rows.
fn depths(view: &View, models: &[Model], band: u32) -> Vec<f32> {
    let place = |model| Placed {
        model,
        world_from_model: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        tints: [[255; 4]; 4],
        label: 1,
    };
    let placed: Vec<_> = models.iter().map(place).collect();
    let scene = Scene { placed: &placed, ..Scene::EMPTY };
    let prospect = Prospect::of(Level::new(), view, &scene, 0.5);
    let (mut canvas, mut bytes) = (Canvas::default(), Vec::new());
    let pitch = view.width_px as usize * PIXEL_BYTES;
    for start in (0..view.height_px).step_by(band as usize) {
        let rows = start..(start + band).min(view.height_px);
        let mut part = vec![0; pitch * rows.len()];
        canvas.look(Level::new(), view, rows, (&scene, &prospect));
        canvas.depth(Level::new(), MOST_M, (&mut part, pitch));
        bytes.extend(part);
    }
    bytes.as_chunks::<4>().0.iter().map(|raw| f32::from_le_bytes(*raw)).collect()
}

#[test]
fn what_nearer_things_hide_is_all_that_is_left_out() {
    let models = models();
    for (width_px, height_px) in [(203, 96), (84, 84), (640, 360)] {
        let view = View {
            eye_m: [0.0, 0.0, 1.2],
            forward: [1.0, 0.0, 0.0],
            left: [0.0, 1.0, 0.0],
            up: [0.0, 0.0, 1.0],
            half_extent: [1.0, height_px as f32 / width_px as f32],
            width_px,
            height_px,
            near_m: 0.08,
        };
        let mut nearest = vec![MOST_M; (width_px * height_px) as usize];
        for model in &models {
            let alone = depths(&view, std::slice::from_ref(model), height_px);
            nearest.iter_mut().zip(alone).for_each(|(least, depth)| *least = least.min(depth));
        }
        assert!(nearest.iter().filter(|depth| **depth < MOST_M).count() > nearest.len() / 3);
        for band in [height_px, 45, 7] {
            let all = depths(&view, &models, band);
            let differing = all.iter().zip(&nearest).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{width_px} × {height_px} in bands of {band}");
        }
    }
}
