//! Traffic lights and signs of a map: posts with lamps or boards, placed once per map. Which lamp
//! is lit is a colour of an instance, so that it changes without any geometry.

use std::f32::consts::{FRAC_PI_4, PI};

use bodies::{Placer, Shape, glowing, linear, opaque};
use nalgebra::Matrix4;
use roads::{Carried, Landmark, Post};
use schemas::{Frame, SemanticTag, TagId, TrafficLightColour, Vec3};

use super::Body;
use super::numerals::{Stroke, strokes};

/// Stretch of the shape of a board across its thickness.
const BOARD_STRETCH: f32 = 0.5;
/// Where the strokes of a number are, just before the face of a board, and half as thick as they.
const NUMBER_X_M: f32 = -0.028;
const NUMBER_HALF_THICK_M: f32 = 0.004;

/// A lamp of a traffic light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Lamp {
    Red = 0,
    Amber = 1,
    Green = 2,
}

/// One signal of a map.
#[derive(Clone, Debug)]
pub(crate) struct Signal {
    /// With dark lamps, then with each lamp lit; one if it has no lamps.
    bodies: Vec<Body>,
    /// The same where the post is hidden.
    carried: Vec<Body>,
    /// Where what it carries is hidden.
    post: Body,
    /// Its position among the map's traffic lights, if it is one of them.
    light: Option<usize>,
    /// Of its post and of what that carries, by which they are hidden.
    places: [u32; 2],
}

/// Every signal that stands beside the roads of a map.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    /// In the order of the map's posts.
    all: Vec<Signal>,
    /// How many traffic lights the map has.
    light_count: usize,
}

impl Signals {
    pub(crate) fn of_map(map: &roads::Map) -> Self {
        let light_count = map.traffic_lights().lights.len();
        let all = map.posts_with_places();
        Self { all: all.map(|(place, post)| place_signal(map, post, place)).collect(), light_count }
    }

    /// What is to be drawn in a frame, without what is hidden. Lamps are dark in a world that does
    /// not have the map's lights.
    pub(crate) fn bodies<'a>(&'a self, frame: &'a Frame) -> impl Iterator<Item = &'a Body> {
        let states = &frame.traffic_lights;
        let states = if states.len() == self.light_count { states.as_slice() } else { &[] };
        let lit_lamp_of = |signal: &Signal| lit_lamp(states.get(signal.light?)?.colour);
        self.all.iter().filter_map(move |signal| {
            let is_hidden = signal.places.map(|place| frame.hidden.contains(place));
            signal.body(lit_lamp_of(signal), is_hidden)
        })
    }
}

impl Signal {
    fn body(&self, lit: Option<Lamp>, is_hidden: [bool; 2]) -> Option<&Body> {
        let bodies = match is_hidden {
            [true, true] => return None,
            [false, true] => return Some(&self.post),
            [true, false] => &self.carried,
            [false, false] => &self.bodies,
        };
        let lit = lit.map_or(0, |lamp| lamp as usize + 1);
        bodies.get(lit).or_else(|| bodies.first())
    }
}

/// The lamp that shows a colour.
fn lit_lamp(colour: TrafficLightColour) -> Option<Lamp> {
    match colour {
        TrafficLightColour::Red => Some(Lamp::Red),
        TrafficLightColour::Yellow => Some(Lamp::Amber),
        TrafficLightColour::Green => Some(Lamp::Green),
        TrafficLightColour::Off | TrafficLightColour::Unknown => None,
    }
}

fn place_signal(map: &roads::Map, post: &Post, place: u32) -> Signal {
    let foot_m: Vec3 = post.foot.translation.vector.cast();
    let world_from_actor = post.foot.to_matrix().cast();
    let label = TagId::of_scenery(SemanticTag::Poles, place);
    let mut placer = Placer::new(world_from_actor, label);
    put_post(&mut placer, post);
    let head = match post.carried {
        Carried::Lamps => {
            placer.label = TagId::of_scenery(SemanticTag::TrafficLight, place);
            let at = post.post_from_carried.to_homogeneous().cast();
            placer.put(Shape::LightHead, at, lamps(None));
            Some(placer.parts.len() - 1)
        }
        Carried::Board => {
            placer.label = TagId::of_scenery(SemanticTag::TrafficSigns, place);
            let landmark = map.landmarks().get(post.landmark);
            let signal_type = landmark.map_or("", |landmark| &landmark.signal_type);
            put_board(&mut placer, post, signal_type);
            if let Some(limit) = landmark.and_then(limit) {
                put_number(&mut placer, post, limit);
            }
            None
        }
    };
    let top_m = post.top_m as f32;
    let body = Body {
        actor: None,
        centre_m: foot_m + Vec3::z() * (top_m / 2.0),
        radius_m: top_m / 2.0 + 1.0,
        parts: placer.parts,
        lamps: Vec::new(),
        occluder: None,
    };
    let mut bodies = vec![body];
    if let (Some(body), Some(head)) = (bodies.first().cloned(), head) {
        for lamp in [Lamp::Red, Lamp::Amber, Lamp::Green] {
            let mut body = body.clone();
            if let Some(part) = body.parts.get_mut(head) {
                part.instance.tints = lamps(Some(lamp));
            }
            bodies.push(body);
        }
    }
    // The post is the first part.
    let without = |body: &Body, is_post: bool| {
        let parts = if is_post { body.parts.get(1..) } else { body.parts.get(..1) };
        Body { parts: parts.unwrap_or_default().to_vec(), ..body.clone() }
    };
    let places = [place, map.carried_place(place)];
    let carried = bodies.iter().map(|body| without(body, true)).collect();
    let post_alone = without(&bodies[0], false);
    Signal { bodies, carried, post: post_alone, light: post.light, places }
}

fn put_board(placer: &mut Placer, post: &Post, signal_type: &str) {
    let (shape, colour, turn_rad) = match signal_type {
        "206" => (Shape::StopSign, 0xb01218, 0.0),
        "205" => (Shape::YieldSign, 0xc01820, 0.0),
        "274" => (Shape::RoundSign, 0xc01820, 0.0),
        "306" => (Shape::SquareSign, 0xf0b010, FRAC_PI_4),
        danger if is_danger(danger) => (Shape::YieldSign, 0xc01820, PI),
        _ => (Shape::SquareSign, 0x1c4fa0, 0.0),
    };
    let half_m: Vec3 = post.carried_half_m.cast();
    let middle_m: Vec3 = post.post_from_carried.vector.cast();
    let size = Vec3::new(BOARD_STRETCH, half_m.y, half_m.z);
    let board = Matrix4::new_translation(&middle_m)
        * Matrix4::new_nonuniform_scaling(&size)
        * Matrix4::from_axis_angle(&Vec3::x_axis(), turn_rad);
    placer.put(shape, board, [opaque(linear(colour)); 4]);
}

/// Whether a sign warns of something: Germany's 101 to 199.
fn is_danger(signal_type: &str) -> bool {
    signal_type.parse().is_ok_and(|number: u32| (101..200).contains(&number))
}

/// What a speed limit allows, in its own unit.
fn limit(landmark: &Landmark) -> Option<u32> {
    let told = [landmark.value, landmark.subtype.parse().unwrap_or_default()];
    let limit = told.into_iter().find(|limit| *limit >= 1.0)?;
    (landmark.signal_type == "274").then_some(limit.round() as u32)
}

/// Writes a number on a board.
fn put_number(placer: &mut Placer, post: &Post, number: u32) {
    let half_m: Vec3 = post.carried_half_m.cast();
    let middle_m: Vec3 = post.post_from_carried.vector.cast();
    for Stroke { middle: [right, up], along, half: [length, width] } in strokes(number) {
        // Left is y; whoever reads it looks along x.
        let on_board = |right: f32, up: f32| Vec3::new(0.0, -right * half_m.y, up * half_m.z);
        let at = middle_m + Vec3::new(NUMBER_X_M, 0.0, 0.0) + on_board(right, up);
        let stroke = Matrix4::from_columns(&[
            Vec3::new(NUMBER_HALF_THICK_M, 0.0, 0.0).push(0.0),
            on_board(-along[0] * length, -along[1] * length).push(0.0),
            on_board(-along[1] * width, along[0] * width).push(0.0),
            at.push(1.0),
        ]);
        placer.put(Shape::Block, stroke, [opaque([0.012; 3]); 4]);
    }
}

fn put_post(placer: &mut Placer, post: &Post) {
    let (radius_m, root_m) = (post.radius_m as f32, post.root_m as f32);
    let size = Vec3::new(radius_m, radius_m, post.top_m as f32 + root_m);
    let at = Matrix4::new_translation(&(Vec3::z() * -root_m));
    placer.put(Shape::Post, at * Matrix4::new_nonuniform_scaling(&size), [opaque([1.0; 3]); 4]);
}

/// Colours of the lamps; all but the lit one are dark glass.
fn lamps(lit: Option<Lamp>) -> [[u8; 4]; 4] {
    let lens = |lamp: Lamp, colour: [f32; 3]| {
        if lit == Some(lamp) {
            glowing(colour, 1.0)
        } else {
            opaque(colour.map(|part| 0.05 * part + 0.01))
        }
    };
    [
        lens(Lamp::Red, [1.0, 0.012, 0.010]),
        lens(Lamp::Amber, [1.0, 0.42, 0.01]),
        lens(Lamp::Green, [0.01, 1.0, 0.10]),
        [0; 4],
    ]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const SHOWN: [bool; 2] = [false; 2];

    fn signals() -> Signals {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        Signals::of_map(&roads::Map::parse("Town10HD_Opt", &text).unwrap())
    }

    #[test]
    fn every_signal_of_a_town_stands_upright_beside_its_road_and_every_light_has_lamps() {
        let signals = signals();
        let lights: Vec<usize> = signals.all.iter().filter_map(|signal| signal.light).collect();
        let known: BTreeSet<usize> = lights.iter().copied().collect();
        // Near the line, and beyond the junction.
        assert!(signals.light_count > 0 && lights.len() == 2 * known.len());
        assert_eq!(known, (0..signals.light_count).collect());
        for signal in &signals.all {
            let z = signal.bodies[0].centre_m.z;
            assert!(z > 0.5 && z < 4.0, "{signal:?}");
            assert!(signal.light.is_none() || signal.bodies.len() == 4, "{signal:?}");
        }
    }

    #[test]
    fn speed_limits_tell_their_number() {
        let signals = signals();
        let has_number = |signal: &&Signal| {
            let parts = &signal.bodies[0].parts;
            parts.iter().filter(|part| part.shape == Shape::Block).count() > 2
        };
        let text = roads::town::build("Town10HD_Opt").unwrap();
        let map = roads::Map::parse("Town10HD_Opt", &text).unwrap();
        let posts = map.posts().iter();
        let limits: Vec<u32> =
            posts.filter_map(|post| limit(&map.landmarks()[post.landmark])).collect();
        assert!(!limits.is_empty() && limits.iter().all(|limit| (20..=130).contains(limit)));
        assert_eq!(signals.all.iter().filter(has_number).count(), limits.len());
    }

    #[test]
    fn posts_and_what_they_carry_are_hidden_one_by_one() {
        let signals = signals();
        let light = signals.all.iter().find(|signal| signal.light.is_some()).unwrap();
        let shapes = |is_hidden| -> Vec<Shape> {
            let body = light.body(Some(Lamp::Red), is_hidden);
            body.into_iter().flat_map(|body| &body.parts).map(|part| part.shape).collect()
        };
        assert_eq!(shapes(SHOWN), [Shape::Post, Shape::LightHead]);
        assert_eq!(shapes([true, false]), [Shape::LightHead]);
        assert_eq!(shapes([false, true]), [Shape::Post]);
        assert_eq!(shapes([true, true]), []);
    }

    #[test]
    fn a_lit_lamp_changes_the_colours_of_the_head_and_nothing_else() {
        let signals = signals();
        let light = signals.all.iter().find(|signal| signal.bodies.len() == 4).unwrap();
        let (dark, green) =
            (light.body(None, SHOWN).unwrap(), light.body(Some(Lamp::Green), SHOWN).unwrap());
        let mut differing = Vec::new();
        for (dark, green) in dark.parts.iter().zip(&green.parts) {
            if dark.instance.tints != green.instance.tints {
                differing.push(green.instance.tints.map(|[.., glow]| glow));
            }
            assert_eq!(dark.instance.world_from_shape, green.instance.world_from_shape);
        }
        assert_eq!(differing, [[0, 0, 255, 0]]);
    }
}
