//! Which level of a thing is drawn, by its distance.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use fearless_simd::Level;
use raster::{Canvas, Corner, Model, Placed, Prospect, Scene, ThingLevel, View};

const SIDE_PX: u32 = 64;
const SKY: u32 = 9;

/// A square across the view as two triangles of this label.
fn square(corners: &mut Vec<Corner>, label: u32) -> Vec<[u32; 3]> {
    let first = corners.len() as u32;
    for (y, z) in [(1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        corners.push(Corner { position: [0.0, y, z], label, ..Corner::default() });
    }
    vec![[first, first + 1, first + 2], [first, first + 2, first + 3]]
}

/// A thing whose levels are squares of the labels 1, 2 and 3.
fn thing() -> Model {
    let mut corners = Vec::new();
    let levels = [(1, 0.0), (2, 0.1), (3, 0.4)]
        .map(|(label, error_m)| ThingLevel { triangles: square(&mut corners, label), error_m });
    let mut model = Model::new(corners, &[], &[]);
    model.add(&levels, Some(5));
    model
}

/// What the middle of a picture shows of the thing so far ahead, where it may be off by half a
/// pixel.
fn seen(model: &Model, ahead_m: f32, is_hidden: bool) -> u32 {
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
    let placed = [Placed {
        model,
        world_from_model: [[1.0, 0.0, 0.0, ahead_m], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        tints: [[255; 4]; 4],
        label: 0,
    }];
    let hides = |thing: u32| thing == 5;
    let is_hidden = is_hidden.then_some(&hides as &(dyn Fn(u32) -> bool + Sync));
    let scene = Scene { placed: &placed, is_hidden, ..Scene::EMPTY };
    let prospect = Prospect::of(Level::new(), &view, &scene, 0.5);
    let mut canvas = Canvas::default();
    canvas.look(Level::new(), &view, 0..SIDE_PX, (&scene, &prospect));
    let mut labels = vec![0; (SIDE_PX * SIDE_PX) as usize];
    canvas.labels(&scene, SKY, 1, (&mut labels, SIDE_PX as usize));
    u32::from(labels[(SIDE_PX * SIDE_PX / 2 + SIDE_PX / 2) as usize])
}

#[test]
fn the_coarsest_level_that_is_off_by_little_enough_is_drawn() {
    let model = thing();
    // A metre has 32 pixels at a metre: 0.1 m is half a pixel at 6.4 m, 0.4 m at 25.6 m, both from
    // the near end of a ball of 1.42 m.
    for (ahead_m, label) in
        [(3.0, 1), (7.7, 1), (7.9, 2), (15.0, 2), (26.9, 2), (27.1, 3), (55.0, 3)]
    {
        assert_eq!(seen(&model, ahead_m, false), label, "at {ahead_m} m");
        assert_eq!(seen(&model, ahead_m, true), SKY, "hidden at {ahead_m} m");
    }
}
