//! Does a pixel show one thing in pictures of every kind that are taken at one pose?

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use common::{camera, car, draw, frame, job, of_kind, renderers};
use render_service::TownScene;
use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, Image, ImageKind, MapRef, PictureQuality, Pose,
    TagId, Vec3, level_pose,
};

const KINDS: [ImageKind; 4] =
    [ImageKind::Rgb, ImageKind::Depth, ImageKind::Semantic, ImageKind::Instance];

/// What a pixel shows in each kind of picture.
struct Pixel {
    colour: [u8; 3],
    depth_m: f32,
    tag: u8,
    label: [u8; 4],
}

fn pixels(images: &[Image]) -> Vec<Pixel> {
    let [colour, depth, tag, label] = images else { panic!("{} pictures", images.len()) };
    let fours = |image: &Image| image.data.as_chunks::<4>().0.to_vec();
    let (colours, depths, labels) = (fours(colour), fours(depth), fours(label));
    let pixel = |at: usize| Pixel {
        colour: [colours[at][0], colours[at][1], colours[at][2]],
        depth_m: f32::from_le_bytes(depths[at]),
        tag: tag.data[at],
        label: labels[at],
    };
    (0..tag.data.len()).map(pixel).collect()
}

/// Whether all around a pixel have its label: colours of a device mix at edges.
fn is_inside(pixels: &[Pixel], at: usize, width: usize) -> bool {
    let (row, column) = (at / width, at % width);
    let rows = row.saturating_sub(1)..(row + 2).min(pixels.len() / width);
    rows.flat_map(|row| {
        (column.saturating_sub(1)..(column + 2).min(width)).map(move |column| row * width + column)
    })
    .all(|other| pixels[other].label == pixels[at].label)
}

/// Cars in this paint and people beside a street.
fn actors(start: &Pose, colour_rgb: u32) -> Vec<ActorState> {
    let mut actors = Vec::new();
    for at in 0..8u32 {
        let row = at as f32;
        let ahead = Vec3::new(9.0 + 7.0 * row, 3.5 * (at % 3) as f32, 0.0);
        actors.push(car(1 + at, start * level_pose(ahead, 0.2 * row), colour_rgb));
        let aside = start * level_pose(Vec3::new(6.0 + 3.0 * row, -2.5, 0.93), row);
        actors.push(ActorState {
            type_index: 1,
            box_half_extent_m: Vec3::new(0.19, 0.19, 0.93),
            ..ActorState::at_rest(ActorId::new(100 + at).unwrap(), ActorKind::Walker, 1, aside)
        });
    }
    actors.sort_by_key(|actor| actor.id);
    actors
}

/// Pixels that all around have the label of, and of them those that kinds do not agree on.
#[derive(Debug, Default)]
struct Count {
    inside: usize,
    of_actors: usize,
    repainted: usize,
    depth_alone: usize,
    repainted_alone: usize,
}

/// The same street without actors, and with the cars in two paints.
fn count([empty, blue, red]: [&[Pixel]; 3], width: usize) -> Count {
    let mut count = Count::default();
    for (at, pixel) in blue.iter().enumerate() {
        let TagId { tag, id } = TagId::unpack(pixel.label);
        assert_eq!(tag.map(|tag| tag as u8), Some(pixel.tag), "{at}: two tags");
        assert_eq!(pixel.label, red[at].label, "{at}: a label depends on the paint");
        if !is_inside(blue, at, width) {
            continue;
        }
        let is_actor = id != 0 && id < TagId::SCENERY;
        let is_elsewhere = pixel.depth_m != empty[at].depth_m;
        let is_repainted = pixel.colour != red[at].colour;
        count.inside += 1;
        count.of_actors += usize::from(is_actor);
        count.repainted += usize::from(is_repainted);
        count.depth_alone += usize::from(is_actor != is_elsewhere);
        count.repainted_alone += usize::from(is_repainted && !(1..100).contains(&id));
    }
    count
}

/// Goal: colour, depth, semantic and instance pictures agree on what is at a pixel. Method: an
/// actor's label, another depth than the street's and, of cars, another colour under another paint
/// must be at the same pixels.
#[test]
fn a_pixel_belongs_to_one_thing_in_colour_depth_and_labels() {
    let name = "Town10HD_Opt";
    let map = roads::Map::parse(name, &roads::town::build(name).unwrap()).unwrap();
    let town = Arc::new(TownScene::of_map(&map));
    let start: Pose = map.spawn_points()[3].cast();
    for mut renderer in renderers() {
        for quality in [PictureQuality::High, PictureQuality::Low] {
            let eye = Camera {
                carrier_from_camera: start * level_pose(Vec3::new(0.0, 0.0, 1.6), 0.0),
                horizontal_fov_rad: FRAC_PI_2,
                quality: Some(quality),
                ..camera()
            };
            let mut seen = |actors: Vec<ActorState>| {
                let map = MapRef { name: name.to_owned(), digest: map.digest().to_owned() };
                let types = ["vehicle.tesla.model3", "walker.pedestrian.0001"].map(str::to_owned);
                let frame = Frame { map, types: types.to_vec(), ..frame(actors) };
                let cameras = KINDS.map(|kind| of_kind(kind, &eye)).to_vec();
                pixels(&draw(&mut renderer, &town, &job(frame, cameras)))
            };
            let empty = seen(vec![]);
            let [blue, red] = [0x20_20_a0, 0xd0_20_20].map(|paint| seen(actors(&start, paint)));
            let count = count([&empty, &blue, &red], eye.width_px as usize);
            eprintln!("{quality:?}: {count:?}");
            assert!(count.of_actors > 5_000 && count.repainted > 1_000, "{count:?}");
            assert_eq!((count.depth_alone, count.repainted_alone), (0, 0), "{count:?}");
        }
    }
}
