//! Traffic lights and signs of a map: posts with lamps or boards, placed once per map. Which lamp
//! is lit is a colour of an instance, so that it changes without any geometry.

use std::collections::BTreeSet;

use nalgebra::Matrix4;
use roads::Landmark;
use schemas::{SemanticTag, TagId, Vec3};

use super::super::shape::Shape;
use super::{Body, Placer, glowing, linear, opaque};

/// Height of a light's post, in metres.
const LIGHT_POST_M: f32 = 3.9;
/// Radius of a light's and of a sign's post, in metres.
const POST_RADIUS_M: [f32; 2] = [0.07, 0.035];
/// How deep posts begin below the road, in metres: the land beside it is lower.
const FOOT_M: f32 = 0.5;
/// Size of a sign whose map gives none or nonsense, in metres.
const SIGN_SIZE_M: f32 = 0.7;

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
    /// Its OpenDRIVE id.
    id: String,
    /// With dark lamps.
    body: Body,
    /// Place of the lamps among the body's parts.
    head: Option<usize>,
}

impl Signal {
    /// What is to be drawn while this says which lamp is lit of the signal with an id.
    pub(crate) fn body(&self, lit_lamp_of: impl Fn(&str) -> Option<Lamp>) -> Body {
        let mut body = self.body.clone();
        if let Some(part) = self.head.and_then(|head| body.parts.get_mut(head)) {
            part.instance.tints = lamps(lit_lamp_of(&self.id));
        }
        body
    }
}

/// All signals that stand beside the roads of a map, each once.
///
/// **Order:** that of the map's landmarks.
pub(crate) fn of_map(map: &roads::Map) -> Vec<Signal> {
    let mut known = BTreeSet::new();
    let scenery_count = u32::try_from(map.scenery().len()).unwrap_or_default();
    let upright = |landmark: &&Landmark| !landmark.name.contains("Stencil");
    let landmarks = map.landmarks().iter().filter(upright);
    landmarks
        .filter(|landmark| known.insert(landmark.id.as_str()))
        .zip(scenery_count..)
        .map(|(landmark, place)| place_signal(landmark, place))
        .collect()
}

fn place_signal(landmark: &Landmark, place: u32) -> Signal {
    let foot = landmark.foot();
    let foot_m: Vec3 = foot.translation.vector.cast();
    let world_from_actor = foot.to_matrix().cast();
    let label = TagId::of_scenery(SemanticTag::Poles, place);
    let mut placer = Placer { world_from_actor, label, parts: Vec::new() };
    let (top_m, head) = if landmark.dynamic {
        (LIGHT_POST_M, Some(put_light(&mut placer, landmark, place)))
    } else {
        (put_sign(&mut placer, landmark, place), None)
    };
    let body = Body {
        actor: None,
        centre_m: foot_m + Vec3::z() * (top_m / 2.0),
        radius_m: top_m / 2.0 + 1.0,
        parts: placer.parts,
    };
    Signal { id: landmark.id.clone(), body, head }
}

/// Returns the place of the lamps.
fn put_light(placer: &mut Placer, landmark: &Landmark, place: u32) -> usize {
    put_post(placer, LIGHT_POST_M, POST_RADIUS_M[0]);
    placer.label = TagId::of_scenery(SemanticTag::TrafficLight, place);
    let head = landmark.foot().inv_mul(&landmark.light_head());
    placer.put(Shape::LightHead, head.to_matrix().cast(), lamps(None));
    placer.parts.len() - 1
}

/// Returns the height of its top.
fn put_sign(placer: &mut Placer, landmark: &Landmark, place: u32) -> f32 {
    let sane = |size_m: f64| {
        if (0.2..=6.0).contains(&size_m) { size_m as f32 } else { SIGN_SIZE_M }
    };
    let half = Vec3::new(0.5, sane(landmark.width_m) / 2.0, sane(landmark.height_m) / 2.0);
    let foot_m = (landmark.z_offset_m as f32).clamp(0.5, 8.0);
    let top_m = foot_m + 2.0 * half.z;
    put_post(placer, top_m, POST_RADIUS_M[1]);
    placer.label = TagId::of_scenery(SemanticTag::TrafficSigns, place);
    let (shape, colour) = match landmark.signal_type.as_str() {
        "206" => (Shape::StopSign, 0xb01218),
        "205" => (Shape::YieldSign, 0xc01820),
        "274" => (Shape::RoundSign, 0xc01820),
        _ => (Shape::SquareSign, 0x1c4fa0),
    };
    // Before the post.
    let middle = Vec3::new(-0.06, 0.0, foot_m + half.z);
    let board = Matrix4::new_translation(&middle) * Matrix4::new_nonuniform_scaling(&half);
    placer.put(shape, board, [opaque(linear(colour)); 4]);
    top_m
}

fn put_post(placer: &mut Placer, top_m: f32, radius_m: f32) {
    let size = Vec3::new(radius_m, radius_m, top_m + FOOT_M);
    let post =
        Matrix4::new_translation(&(Vec3::z() * -FOOT_M)) * Matrix4::new_nonuniform_scaling(&size);
    placer.put(Shape::Post, post, [opaque([1.0; 3]); 4]);
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
        lens(Lamp::Red, [1.0, 0.03, 0.02]),
        lens(Lamp::Amber, [1.0, 0.42, 0.01]),
        lens(Lamp::Green, [0.03, 1.0, 0.25]),
        [0; 4],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals() -> Vec<Signal> {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        of_map(&roads::Map::parse("Town10HD_Opt", &text).unwrap())
    }

    #[test]
    fn every_signal_of_a_town_stands_once_and_upright_beside_its_road() {
        let signals = signals();
        let ids: BTreeSet<&str> = signals.iter().map(|signal| signal.id.as_str()).collect();
        assert!(!signals.is_empty() && ids.len() == signals.len());
        assert!(signals.iter().any(|signal| signal.head.is_some()));
        for signal in &signals {
            assert!(signal.body.centre_m.z > 0.5 && signal.body.centre_m.z < 4.0, "{signal:?}");
        }
    }

    #[test]
    fn a_lit_lamp_changes_the_colours_of_the_head_and_nothing_else() {
        let signals = signals();
        let light = signals.iter().find(|signal| signal.head.is_some()).unwrap();
        let (dark, green) = (light.body(|_| None), light.body(|_| Some(Lamp::Green)));
        for (place, (dark, green)) in dark.parts.iter().zip(&green.parts).enumerate() {
            let is_head = Some(place) == light.head;
            assert_eq!(dark.instance.tints != green.instance.tints, is_head);
            assert_eq!(dark.instance.world_from_shape, green.instance.world_from_shape);
        }
        let lit = green.parts[light.head.unwrap()].instance.tints;
        assert_eq!(lit.map(|[.., glow]| glow), [0, 0, 255, 0]);
    }
}
