//! What surfaces are made of.

use schemas::SemanticTag;

/// What a triangle is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names are the materials")]
pub enum Material {
    Asphalt,
    MarkingWhite,
    MarkingYellow,
    Kerb,
    Sidewalk,
    Grass,
    Roof,
    Concrete,
    Wall,
    Foliage,
    Bark,
    Metal,
    Paint,
    DarkPaint,
    Glass,
    CabinGlass,
    CarWindow,
    VanWindow,
    TruckWindow,
    BusWindow,
    Tyre,
    Rim,
    Chrome,
    BlackPlastic,
    HeadLamp,
    TailLamp,
    Plate,
    Skin,
    Hair,
    Shirt,
    Trousers,
    Shoe,
    Prop,
    PropBand,
}

impl Material {
    /// Every material, at the place of its number.
    pub const ALL: [Self; 34] = [
        Self::Asphalt,
        Self::MarkingWhite,
        Self::MarkingYellow,
        Self::Kerb,
        Self::Sidewalk,
        Self::Grass,
        Self::Roof,
        Self::Concrete,
        Self::Wall,
        Self::Foliage,
        Self::Bark,
        Self::Metal,
        Self::Paint,
        Self::DarkPaint,
        Self::Glass,
        Self::CabinGlass,
        Self::CarWindow,
        Self::VanWindow,
        Self::TruckWindow,
        Self::BusWindow,
        Self::Tyre,
        Self::Rim,
        Self::Chrome,
        Self::BlackPlastic,
        Self::HeadLamp,
        Self::TailLamp,
        Self::Plate,
        Self::Skin,
        Self::Hair,
        Self::Shirt,
        Self::Trousers,
        Self::Shoe,
        Self::Prop,
        Self::PropBand,
    ];

    /// What it belongs to where nothing else is known; none for parts of actors, whose instance
    /// says it.
    pub fn tag(self) -> SemanticTag {
        match self {
            Self::Asphalt => SemanticTag::Roads,
            Self::MarkingWhite | Self::MarkingYellow => SemanticTag::RoadLines,
            Self::Kerb | Self::Sidewalk => SemanticTag::Sidewalks,
            Self::Grass => SemanticTag::Terrain,
            Self::Roof | Self::Wall => SemanticTag::Buildings,
            Self::Concrete => SemanticTag::Static,
            Self::Foliage | Self::Bark => SemanticTag::Vegetation,
            Self::Metal => SemanticTag::Poles,
            _ => SemanticTag::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_material_is_at_the_place_of_its_number() {
        for (place, material) in Material::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(material as u8), place, "{material:?}");
        }
    }
}
