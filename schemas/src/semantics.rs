//! What things are, in CARLA 0.9.16's numbers; shared by cameras and the world's own sensors.

use serde::{Deserialize, Serialize};

use crate::ActorKind;

/// What a point of the world belongs to.
///
/// **Source:** the tags of CARLA 0.9.16, which follow the Cityscapes scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum SemanticTag {
    None = 0,
    Roads = 1,
    /// With kerbs.
    Sidewalks = 2,
    Buildings = 3,
    Walls = 4,
    Fences = 5,
    /// Of lamps, lights and signs, with their arms.
    Poles = 6,
    /// The box with the lamps, without its pole.
    TrafficLight = 7,
    /// The board, without its pole.
    TrafficSigns = 8,
    /// Trees with their trunks.
    Vegetation = 9,
    /// Grass and open land.
    Terrain = 10,
    Sky = 11,
    Pedestrians = 12,
    /// A person on two wheels, without the vehicle.
    Rider = 13,
    Car = 14,
    Truck = 15,
    Bus = 16,
    Train = 17,
    Motorcycle = 18,
    Bicycle = 19,
    /// Things that are fixed to the ground.
    Static = 20,
    /// Things that a person could move.
    Dynamic = 21,
    Other = 22,
    Water = 23,
    RoadLines = 24,
    Ground = 25,
    Bridge = 26,
    RailTrack = 27,
    GuardRail = 28,
}

impl SemanticTag {
    /// Every tag, at the place of its number.
    pub const ALL: [Self; 29] = [
        Self::None,
        Self::Roads,
        Self::Sidewalks,
        Self::Buildings,
        Self::Walls,
        Self::Fences,
        Self::Poles,
        Self::TrafficLight,
        Self::TrafficSigns,
        Self::Vegetation,
        Self::Terrain,
        Self::Sky,
        Self::Pedestrians,
        Self::Rider,
        Self::Car,
        Self::Truck,
        Self::Bus,
        Self::Train,
        Self::Motorcycle,
        Self::Bicycle,
        Self::Static,
        Self::Dynamic,
        Self::Other,
        Self::Water,
        Self::RoadLines,
        Self::Ground,
        Self::Bridge,
        Self::RailTrack,
        Self::GuardRail,
    ];

    /// CARLA's number.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The tag of a number, or none for a number that is not CARLA's.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The tag of an actor; of a vehicle on two wheels without its rider, who is a [`Self::Rider`].
    ///
    /// **Source:** CARLA's `base_type` of vehicles, in which a van is a car; props by what their
    /// names say.
    pub fn of_actor(kind: ActorKind, blueprint: &str) -> Self {
        match kind {
            ActorKind::Walker => Self::Pedestrians,
            ActorKind::Vehicle => by_word(blueprint, &VEHICLES, Self::Car),
            ActorKind::Prop => by_word(blueprint, &PROPS, Self::Static),
            ActorKind::TrafficLight => Self::TrafficLight,
            ActorKind::TrafficSign => Self::TrafficSigns,
            ActorKind::Sensor | ActorKind::Marker => Self::None,
        }
    }
}

/// Words of a blueprint id and what they mean.
type Words = (&'static [&'static str], SemanticTag);

const VEHICLES: [Words; 4] = [
    (&["crossbike", "century", "omafiets", "bicycle"], SemanticTag::Bicycle),
    (&["low_rider", "ninja", "zx125", "yzf", "motorcycle"], SemanticTag::Motorcycle),
    (&["carlacola", "firetruck", "european_hgv", "cybertruck", "truck"], SemanticTag::Truck),
    (&["fusorosa", "bus"], SemanticTag::Bus),
];

const PROPS: [Words; 4] = [
    (&["mailbox", "vendingmachine", "streetfountain"], SemanticTag::Static),
    (&["streetsign", "warning"], SemanticTag::TrafficSigns),
    (&["fence", "chainbarrier"], SemanticTag::Fences),
    (
        &[
            "cone",
            "barrel",
            "barrier",
            "box",
            "bag",
            "bin",
            "can",
            "bottle",
            "cart",
            "case",
            "chair",
            "table",
            "container",
            "trolley",
            "garbage",
            "debris",
            "plank",
            "gnome",
            "helmet",
            "laptop",
            "mobile",
            "purse",
        ],
        SemanticTag::Dynamic,
    ),
];

/// By the first row of which the id's last part holds a word.
fn by_word(blueprint: &str, rows: &[Words], otherwise: SemanticTag) -> SemanticTag {
    let name = blueprint.rsplit('.').next().unwrap_or_default();
    let holds = |(words, _): &&Words| words.iter().any(|word| name.contains(word));
    rows.iter().find(holds).map_or(otherwise, |(_, tag)| *tag)
}

/// One pixel of an instance picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TagId {
    /// What it is; none for a number that is no tag.
    pub tag: Option<SemanticTag>,
    /// Which one; see [`TagId::of_actor`] and [`TagId::of_scenery`]. 0 for the sky, roads, land.
    pub id: u32,
}

impl TagId {
    /// The least id of things of the map.
    pub const SCENERY: u32 = 0x80_0000;

    /// The packed pixel of an actor, whose id is taken modulo [`TagId::SCENERY`].
    pub const fn of_actor(tag: SemanticTag, actor: crate::ActorId) -> u32 {
        tag as u32 | (actor.get() % Self::SCENERY) << 8
    }

    /// The packed pixel of a thing of the map by its place among all of them, modulo
    /// [`TagId::SCENERY`].
    pub const fn of_scenery(tag: SemanticTag, place: u32) -> u32 {
        tag as u32 | (Self::SCENERY + place % Self::SCENERY) << 8
    }

    /// The place of a thing of the map in a packed pixel of [`of_scenery`](Self::of_scenery).
    pub const fn place_of(packed: u32) -> Option<u32> {
        (packed >> 8).checked_sub(Self::SCENERY)
    }

    /// From the four bytes of an [`ImageEncoding::TagIdU32`](crate::ImageEncoding::TagIdU32) pixel.
    pub fn unpack(pixel: [u8; 4]) -> Self {
        let number = u32::from_le_bytes(pixel);
        let [tag, ..] = pixel;
        Self { tag: SemanticTag::from_number(tag), id: number >> 8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ActorId;

    #[test]
    fn every_tag_is_at_the_place_of_its_number() {
        for (place, tag) in SemanticTag::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(tag.number()), place, "{tag:?}");
        }
        assert_eq!(SemanticTag::from_number(29), None);
    }

    #[test]
    fn blueprints_of_every_class_have_the_tag_of_their_class() {
        for (blueprint, tag) in [
            ("vehicle.tesla.model3", SemanticTag::Car),
            ("vehicle.ford.ambulance", SemanticTag::Car),
            ("vehicle.tesla.cybertruck", SemanticTag::Truck),
            ("vehicle.carlamotors.european_hgv", SemanticTag::Truck),
            ("vehicle.mitsubishi.fusorosa", SemanticTag::Bus),
            ("vehicle.harley-davidson.low_rider", SemanticTag::Motorcycle),
            ("vehicle.vespa.zx125", SemanticTag::Motorcycle),
            ("vehicle.bh.crossbike", SemanticTag::Bicycle),
        ] {
            assert_eq!(SemanticTag::of_actor(ActorKind::Vehicle, blueprint), tag, "{blueprint}");
        }
        for (blueprint, tag) in [
            ("static.prop.trafficcone01", SemanticTag::Dynamic),
            ("static.prop.streetbarrier", SemanticTag::Dynamic),
            ("static.prop.busstop", SemanticTag::Static),
            ("static.prop.trafficwarning", SemanticTag::TrafficSigns),
        ] {
            assert_eq!(SemanticTag::of_actor(ActorKind::Prop, blueprint), tag, "{blueprint}");
        }
        let person = SemanticTag::of_actor(ActorKind::Walker, "walker.pedestrian.0001");
        assert_eq!(person, SemanticTag::Pedestrians);
    }

    #[test]
    fn a_packed_pixel_tells_tag_and_id() {
        let car = TagId::of_actor(SemanticTag::Car, ActorId::new(0x1234).unwrap());
        let unpacked = TagId::unpack(car.to_le_bytes());
        assert_eq!(unpacked, TagId { tag: Some(SemanticTag::Car), id: 0x1234 });
        let house = TagId::unpack(TagId::of_scenery(SemanticTag::Buildings, 7).to_le_bytes());
        assert_eq!(house, TagId { tag: Some(SemanticTag::Buildings), id: TagId::SCENERY + 7 });
        assert_eq!(TagId::place_of(TagId::of_scenery(SemanticTag::Buildings, 7)), Some(7));
        assert_eq!(TagId::place_of(car), None);
    }
}
