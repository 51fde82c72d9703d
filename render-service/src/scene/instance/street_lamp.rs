//! Street lights of a map: by night they burn, unless somebody set them otherwise.

use std::collections::BTreeMap;

use bodies::{Placer, Shape, glowing, linear};
use nalgebra::{Matrix4, Point3, Vector3};
use raster::Lamp;
use roads::MapLayer;
use schemas::{HiddenScenery, SemanticTag, StreetLight, TagId, Vec3};

use super::Body;

/// From the top of the post's box to the lamp, which hangs over the road: ahead and down.
const ARM_M: f32 = 1.4;
const DROP_M: f32 = 0.13;
/// Half size of the glass.
const GLASS_M: [f32; 3] = [0.28, 0.10, 0.03];
/// As warm as a high-pressure sodium lamp.
const COLOUR_RGB: u32 = 0xff_d6_aa;
/// Radiance of a white wall 1 m below; chosen by eye.
const BRIGHTNESS: f32 = 26.0;
/// How much a light may be turned up.
const BRIGHTNESS_PART_MAX: f32 = 20.0;
const REACH_M: f32 = 26.0;
/// Of the cone: half of the light is left at 1 over this tangent.
const NARROW: [f32; 2] = [0.55, 0.40];

/// Every street light of a map.
#[derive(Clone, Debug, Default)]
pub(crate) struct StreetLamps(Vec<StreetLamp>);

#[derive(Clone, Debug)]
struct StreetLamp {
    /// The post in the world, with the lamp's glass as its origin.
    world_from_glass: Matrix4<f32>,
    /// Among the map's scenery.
    place: Option<u32>,
}

impl StreetLamps {
    pub(crate) fn of_map(map: &roads::Map) -> Self {
        let objects = map.environment_objects();
        let lamps = objects.iter().filter(|object| object.layer == MapLayer::StreetLights);
        Self(
            lamps
                .map(|object| {
                    let top_m = object.half_extent_m.z as f32;
                    let glass_m = Vec3::new(ARM_M, 0.0, top_m - DROP_M);
                    let world_from_post: Matrix4<f32> = object.pose.to_matrix().cast();
                    let world_from_glass = world_from_post * Matrix4::new_translation(&glass_m);
                    StreetLamp { world_from_glass, place: object.scenery }
                })
                .collect(),
        )
    }

    /// Those that burn: by night, which is as long as the sun is down, all that nobody has set.
    pub(crate) fn bodies(
        &self,
        (hidden, is_night): (&HiddenScenery, bool),
        set: &[StreetLight],
    ) -> Vec<Body> {
        if set.is_empty() && !is_night {
            return Vec::new();
        }
        let set: BTreeMap<u32, &StreetLight> = set.iter().map(|one| (one.index, one)).collect();
        let lamps = (0..).zip(&self.0);
        let there = lamps.filter(|(_, lamp)| !lamp.place.is_some_and(|at| hidden.contains(at)));
        let burning = there.filter_map(|(index, lamp)| match set.get(&index) {
            Some(light) => light.on.then(|| lamp.body(light.colour_rgb, light.brightness)),
            None => is_night.then(|| lamp.body(COLOUR_RGB, 1.0)),
        });
        burning.collect()
    }
}

impl StreetLamp {
    fn body(&self, colour_rgb: u32, brightness: f32) -> Body {
        let part = brightness.clamp(0.0, BRIGHTNESS_PART_MAX);
        let colour = linear(colour_rgb);
        let tag = SemanticTag::Poles;
        let label = self.place.map_or(u32::from(tag.number()), |at| TagId::of_scenery(tag, at));
        let mut placer = Placer::new(self.world_from_glass, label);
        let glass = Matrix4::new_nonuniform_scaling(&Vec3::from(GLASS_M));
        placer.put(Shape::Block, glass, [glowing(colour, part.min(1.0)); 4]);
        let place: Vec3 = self.world_from_glass.transform_point(&Point3::origin()).coords;
        let along: Vec3 = self.world_from_glass.transform_vector(&Vector3::x());
        let lamp = Lamp::beam(
            place.into(),
            [0.0, 0.0, -1.0],
            colour.map(|channel| channel * BRIGHTNESS * part),
            REACH_M,
        );
        let left = Vec3::new(-along.y, along.x, 0.0).try_normalize(1e-3).unwrap_or_else(Vec3::y);
        Body {
            actor: None,
            centre_m: place,
            radius_m: 0.4,
            parts: placer.parts,
            occluder: None,
            lamps: vec![Lamp { left: left.into(), narrow: NARROW, ..lamp }],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamps() -> StreetLamps {
        let text = roads::town::build("Town02").unwrap();
        StreetLamps::of_map(&roads::Map::parse("Town02", &text).unwrap())
    }

    #[test]
    fn all_burn_by_night_and_none_by_day() {
        let (lamps, all) = (lamps(), HiddenScenery::default());
        assert!(lamps.0.len() > 20);
        let by_night = lamps.bodies((&all, true), &[]);
        assert_eq!(by_night.len(), lamps.0.len());
        assert!(by_night.iter().all(|body| body.centre_m.z > 3.0 && body.lamps.len() == 1));
        assert!(lamps.bodies((&all, false), &[]).is_empty());
    }

    #[test]
    fn one_that_was_set_is_as_it_was_set() {
        let (lamps, all) = (lamps(), HiddenScenery::default());
        let off = StreetLight { index: 3, on: false, colour_rgb: 0xff, brightness: 1.0 };
        assert_eq!(lamps.bodies((&all, true), &[off]).len(), lamps.0.len() - 1);
        let blue = StreetLight { on: true, brightness: 0.5, ..off };
        let by_day = lamps.bodies((&all, false), &[blue]);
        let [red, _, light] = by_day[0].lamps[0].colour;
        assert!(by_day.len() == 1 && red == 0.0 && (light - 0.5 * BRIGHTNESS).abs() < 1e-3);
    }

    #[test]
    fn a_hidden_one_does_not_burn() {
        let lamps = lamps();
        let mut hidden = HiddenScenery::default();
        hidden.set(lamps.0[0].place.unwrap(), true);
        assert_eq!(lamps.bodies((&hidden, true), &[]).len(), lamps.0.len() - 1);
    }
}
