//! Goal: things of towns show the textures that frames say they have, and nothing else changes.
//! Method: look at a wall of a house squarely, with and without.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use std::sync::{Arc, LazyLock};

use common::{camera, of_kind, renderers};
use render_service::{AdapterChoice, Renderer, Textures, TownScene};
use schemas::{
    Camera, Coat, Frame, Image, ImageKind, MapRef, Paint, PictureQuality, Pose, RenderJob, TagId,
    Texture, UnitQuaternion, Vec3, WorldId,
};

/// A town, and a place from which one of its houses fills much of a picture.
struct Place {
    town: Arc<TownScene>,
    digest: String,
    /// Of the house, in the scenery.
    house: u32,
    world_from_camera: Pose,
}

static PLACE: LazyLock<Place> = LazyLock::new(|| {
    let text = roads::town::build("Town02_Opt").unwrap();
    let map = roads::Map::parse("Town02_Opt", &text).unwrap();
    let (town, digest) = (Arc::new(TownScene::of_map(&map)), map.digest().to_owned());
    let mut renderer = Renderer::new(AdapterChoice::Software).unwrap();
    let houses = map.environment_objects().iter();
    let houses = houses.filter(|object| object.label == schemas::SemanticTag::Buildings);
    for object in houses {
        let Some(house) = object.scenery else { continue };
        let (pose, half_m): (Pose, Vec3) = (object.pose.cast(), object.half_extent_m.cast());
        for (way, across_m) in [(0.0, half_m.x), (1.0, half_m.y), (2.0, half_m.x), (3.0, half_m.y)]
        {
            let turn =
                UnitQuaternion::from_euler_angles(0.0, 0.0, way * std::f32::consts::FRAC_PI_2);
            let back = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f32::consts::PI);
            let outside = turn * Vec3::new(across_m + 9.0, 0.0, 2.0 - half_m.z);
            let world_from_camera = pose * Pose::from_parts(outside.into(), turn * back);
            let place =
                Place { town: Arc::clone(&town), digest: digest.clone(), house, world_from_camera };
            let labels = place.draw(&mut renderer, &Paint::default(), &[], ImageKind::Instance);
            let shown = is_house(&labels, house).iter().filter(|is_it| **is_it).count();
            if shown * 2 > labels.data.len() / 4 {
                return place;
            }
        }
    }
    panic!("no house can be seen well");
});

impl Place {
    fn job(&self, paint: &Paint, kind: ImageKind) -> RenderJob {
        let map = MapRef { name: "Town02_Opt".to_owned(), digest: self.digest.clone() };
        let frame = Frame { paint: paint.clone(), ..Frame::empty(WorldId::new(1).unwrap(), map) };
        let (width_px, height_px) = (320, 180);
        let carrier_from_camera = self.world_from_camera;
        let seen = Camera { carrier_from_camera, width_px, height_px, ..of_kind(kind, &camera()) };
        RenderJob {
            tenant: "local".parse().unwrap(),
            frame,
            cameras: vec![seen],
            staging: schemas::Staging::default(),
        }
    }

    fn draw(
        &self,
        renderer: &mut Renderer,
        paint: &Paint,
        textures: &[&Texture],
        kind: ImageKind,
    ) -> Image {
        let mut known = Textures::default();
        textures.iter().for_each(|texture| known.keep(texture));
        drawn(renderer, (Arc::clone(&self.town), &self.job(paint, kind)), &known)
    }

    /// With textures for the house's colour and for its light.
    fn paint(&self, diffuse: Option<&Texture>, emissive: Option<&Texture>) -> Paint {
        let all = [diffuse, emissive].into_iter().flatten();
        let textures: Vec<String> = all.map(|texture| texture.digest().to_owned()).collect();
        let position = |of: Option<&Texture>| {
            let is_it = |digest: &String| of.is_some_and(|of| of.digest() == digest);
            textures.iter().position(is_it).map(|position| position as u16)
        };
        let (diffuse, emissive) = (position(diffuse), position(emissive));
        Paint { coats: vec![Coat { place: self.house, diffuse, emissive }], textures }
    }
}

fn drawn(renderer: &mut Renderer, job: (Arc<TownScene>, &RenderJob), textures: &Textures) -> Image {
    renderer.render_painted(&[job], textures).remove(0).unwrap().images.remove(0)
}

/// Which pixels of a picture of instances show a house.
fn is_house(labels: &Image, house: u32) -> Vec<bool> {
    let (pixels, _) = labels.data.as_chunks::<4>();
    let place = |pixel: &[u8; 4]| TagId::place_of(u32::from_le_bytes(*pixel));
    pixels.iter().map(|pixel| place(pixel) == Some(house)).collect()
}

/// A texture of columns of these colours, from left to right.
fn columns(colours: &[[u8; 3]]) -> Texture {
    Texture::new([colours.len() as u32, 1], 1.0, colours.as_flattened()).unwrap()
}

/// Which of red, green and blue a pixel has most of.
fn hue([r, g, b, _]: [u8; 4]) -> usize {
    let parts = [r, g, b];
    (0..3).max_by_key(|at| parts[*at]).unwrap()
}

#[test]
fn a_wall_shows_its_texture_the_right_way_round() {
    let place = &*PLACE;
    let texture = columns(&[[200, 0, 0], [0, 200, 0], [0, 0, 200]]);
    let paint = place.paint(Some(&texture), None);
    for mut renderer in renderers() {
        let labels = place.draw(&mut renderer, &paint, &[&texture], ImageKind::Instance);
        let shows = is_house(&labels, place.house);
        let picture = place.draw(&mut renderer, &paint, &[&texture], ImageKind::Rgb);
        let (pixels, _) = picture.data.as_chunks::<4>();
        let row = 320 * 100;
        let hues: Vec<usize> = (0..320)
            .filter(|column| shows[row + column])
            .map(|column| hue(pixels[row + column]))
            .collect();
        assert!(hues.is_sorted() && hues.contains(&0) && hues.contains(&2), "{hues:?}");
    }
}

#[test]
fn nothing_but_colours_of_the_thing_changes() {
    let place = &*PLACE;
    let texture = columns(&[[200, 10, 10], [0, 0, 200]]);
    let (bare, paint) = (Paint::default(), place.paint(Some(&texture), Some(&texture)));
    for mut renderer in renderers() {
        let mut kinds = [ImageKind::Depth, ImageKind::Semantic, ImageKind::Instance]
            .into_iter()
            .chain([ImageKind::Normals]);
        assert!(kinds.all(|kind| {
            let with = place.draw(&mut renderer, &paint, &[&texture], kind);
            with.data == place.draw(&mut renderer, &bare, &[], kind).data
        }));
    }
    // What light the thing throws on others is not drawn.
    let mut renderer = Renderer::new(AdapterChoice::Software).unwrap();
    let labels = place.draw(&mut renderer, &bare, &[], ImageKind::Instance);
    let with = place.draw(&mut renderer, &paint, &[&texture], ImageKind::Rgb);
    let without = place.draw(&mut renderer, &bare, &[], ImageKind::Rgb);
    let (with, _) = with.data.as_chunks::<4>();
    let (without, _) = without.data.as_chunks::<4>();
    // Edges are soft: what is beside the thing may take on some of it, and the other way round.
    let shows = is_house(&labels, place.house);
    let width = labels.width_px as usize;
    for (at, is_it) in shows.iter().enumerate() {
        let beside = [at.wrapping_sub(width), at.wrapping_sub(1), at + 1, at + width];
        let is_inside = beside.iter().all(|at| shows.get(*at).is_none_or(|other| other == is_it));
        assert!(!is_inside || (with[at] != without[at]) == *is_it, "pixel {at}");
    }
}

#[test]
fn what_the_frame_does_not_paint_and_what_nobody_has_stays_as_it_is() {
    let place = &*PLACE;
    let texture = columns(&[[200, 10, 10], [0, 0, 200]]);
    let paint = place.paint(Some(&texture), None);
    let mut renderer = Renderer::new(AdapterChoice::Software).unwrap();
    let bare = place.draw(&mut renderer, &Paint::default(), &[], ImageKind::Rgb);
    let unpainted = place.draw(&mut renderer, &Paint::default(), &[&texture], ImageKind::Rgb);
    assert_eq!(unpainted.data, bare.data);
    assert_eq!(place.draw(&mut renderer, &paint, &[], ImageKind::Rgb).data, bare.data);
    let other = Paint { coats: vec![Coat { place: 999_999, ..paint.coats[0] }], ..paint };
    assert_eq!(place.draw(&mut renderer, &other, &[&texture], ImageKind::Rgb).data, bare.data);
}

#[test]
fn light_is_added_by_night_and_leaves_the_wall_beneath() {
    let place = &*PLACE;
    let (black, lamp) = (columns(&[[0, 0, 0]]), columns(&[[0, 255, 0]]));
    let mut renderer = Renderer::new(AdapterChoice::Software).unwrap();
    let mut by_night = |emissive: Option<&Texture>| {
        let paint = place.paint(None, emissive);
        let mut job = place.job(&paint, ImageKind::Rgb);
        job.frame.weather.sun_altitude_rad = -1.0;
        let mut known = Textures::default();
        emissive.into_iter().for_each(|texture| known.keep(texture));
        drawn(&mut renderer, (Arc::clone(&place.town), &job), &known).data
    };
    let (bare, dark, lit) = (by_night(None), by_night(Some(&black)), by_night(Some(&lamp)));
    assert_eq!(dark, bare);
    let greens = |picture: &[u8]| {
        let (pixels, _) = picture.as_chunks::<4>();
        pixels.iter().filter(|[r, g, b, _]| *g > 200 && *g / 2 > (*r).max(*b)).count()
    };
    assert_eq!(greens(&bare), 0);
    assert!(greens(&lit) > 320 * 180 / 2);
}

#[test]
fn far_walls_show_the_mean_of_fine_stripes_in_both_qualities() {
    let place = &*PLACE;
    let stripes: Vec<[u8; 3]> = (0..512).map(|at| [(at % 2) as u8 * 255; 3]).collect();
    let (fine, grey) = (columns(&stripes), columns(&[[188, 188, 188]]));
    let mut renderer = Renderer::new(AdapterChoice::Software).unwrap();
    for quality in [PictureQuality::High, PictureQuality::Low] {
        let mut look = |texture: &Texture| {
            let mut job = place.job(&place.paint(Some(texture), None), ImageKind::Rgb);
            job.cameras[0].quality = Some(quality);
            (job.cameras[0].width_px, job.cameras[0].height_px) = (96, 54);
            let mut known = Textures::default();
            known.keep(texture);
            drawn(&mut renderer, (Arc::clone(&place.town), &job), &known).data
        };
        let (seen, mean) = (look(&fine), look(&grey));
        let off = seen.iter().zip(&mean).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(off <= 16, "{quality:?}: {off}");
    }
}
