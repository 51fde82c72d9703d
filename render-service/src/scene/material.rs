//! What surfaces are made of: one table, shared with the shaders.

use bytemuck::{Pod, Zeroable};
use schemas::SemanticTag;

/// The fragment shader that draws a material. Materials of one family share a draw call; software
/// rasterisers run every branch of a shader, so each family has a shader of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Family {
    /// Roads, sidewalks, lawns, roofs: patterns from the world position.
    Ground,
    /// Walls with windows: patterns from the facade coordinates.
    Facade,
    /// Vehicles, people, things: paint, glass, light.
    Body,
}

impl Family {
    /// Every family, in drawing order: what is near and hides much comes first.
    pub(crate) const ALL: [Self; 3] = [Self::Body, Self::Facade, Self::Ground];
}

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
    pub(crate) const ALL: [Self; 30] = [
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

    /// The family that draws it.
    pub(crate) fn family(self) -> Family {
        match self {
            Self::Asphalt
            | Self::MarkingWhite
            | Self::MarkingYellow
            | Self::Kerb
            | Self::Sidewalk
            | Self::Grass
            | Self::Roof
            | Self::Concrete => Family::Ground,
            Self::Wall => Family::Facade,
            _ => Family::Body,
        }
    }

    /// What it belongs to where nothing else is known; none for parts of actors, whose instance
    /// says it.
    pub(crate) fn tag(self) -> SemanticTag {
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

    fn looks(self) -> Looks {
        match self {
            Self::Asphalt => Looks::patterned([0.070, 0.071, 0.075], Pattern::Asphalt),
            Self::MarkingWhite => Looks::patterned([0.62, 0.62, 0.60], Pattern::Marking),
            Self::MarkingYellow => Looks::patterned([0.66, 0.40, 0.05], Pattern::Marking),
            Self::Kerb => Looks::patterned([0.34, 0.335, 0.32], Pattern::Kerb),
            Self::Sidewalk => Looks::patterned([0.30, 0.285, 0.265], Pattern::Paving),
            Self::Grass => Looks::patterned([0.075, 0.145, 0.032], Pattern::Grass),
            Self::Roof => Looks::patterned([0.20, 0.185, 0.175], Pattern::Asphalt),
            Self::Concrete => Looks::patterned([0.36, 0.35, 0.33], Pattern::Asphalt),
            Self::Wall => Looks::plain([0.50, 0.44, 0.37]),
            Self::Foliage => Looks::patterned([0.066, 0.140, 0.030], Pattern::Leaves),
            Self::Bark => Looks::plain([0.10, 0.065, 0.04]),
            Self::Metal => Looks { gloss: 0.2, ..Looks::plain([0.20, 0.21, 0.22]) },
            Self::Paint => Looks::tinted(Tint::First, 0.75),
            Self::DarkPaint => Looks { colour: [0.30; 3], ..Looks::tinted(Tint::First, 0.5) },
            Self::Glass => Looks { gloss: 1.0, ..Looks::plain([0.012, 0.015, 0.018]) },
            Self::CabinGlass => Looks::tinted(Tint::Fourth, 1.0),
            Self::Tyre => Looks::plain([0.014, 0.014, 0.015]),
            Self::Rim => Looks { gloss: 0.5, ..Looks::plain([0.36, 0.37, 0.39]) },
            Self::Chrome => Looks { gloss: 0.9, ..Looks::plain([0.45, 0.46, 0.48]) },
            Self::BlackPlastic => Looks { gloss: 0.12, ..Looks::plain([0.020, 0.020, 0.022]) },
            Self::HeadLamp => Looks { gloss: 0.8, ..Looks::tinted(Tint::Second, 0.8) },
            Self::TailLamp => Looks { gloss: 0.5, ..Looks::tinted(Tint::Third, 0.5) },
            Self::Plate => Looks::plain([0.70, 0.70, 0.66]),
            Self::Skin => Looks::tinted(Tint::First, 0.0),
            Self::Hair => Looks::tinted(Tint::Second, 0.05),
            Self::Shirt => Looks::tinted(Tint::Third, 0.0),
            Self::Trousers => Looks::tinted(Tint::Fourth, 0.0),
            Self::Shoe => Looks::plain([0.030, 0.026, 0.024]),
            Self::Prop => Looks::tinted(Tint::First, 0.05),
            Self::PropBand => Looks::plain([0.75, 0.75, 0.73]),
        }
    }
}

/// How the shaders vary a colour; the numbers are theirs.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
enum Pattern {
    Asphalt = 0,
    Marking = 1,
    Kerb = 2,
    Paving = 3,
    Grass = 4,
    Leaves = 5,
}

/// Which of an instance's four colours multiplies the material's own. The alpha of that colour is
/// how much of it glows by itself.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
enum Tint {
    /// Paint of a vehicle or thing, skin of a person.
    First = 0,
    /// Head lamps, hair.
    Second = 1,
    /// Tail lamps, shirt.
    Third = 2,
    /// Trousers, windows of a vehicle.
    Fourth = 3,
    /// The material's own colour alone.
    None = 4,
}

struct Looks {
    /// Linear RGB reflectance.
    colour: [f32; 3],
    /// 0 dull to 1 mirror-like.
    gloss: f32,
    pattern: Pattern,
    tint: Tint,
}

impl Looks {
    fn plain(colour: [f32; 3]) -> Self {
        Self { colour, gloss: 0.0, pattern: Pattern::Asphalt, tint: Tint::None }
    }

    fn patterned(colour: [f32; 3], pattern: Pattern) -> Self {
        Self { pattern, ..Self::plain(colour) }
    }

    fn tinted(tint: Tint, gloss: f32) -> Self {
        Self { gloss, tint, ..Self::plain([1.0; 3]) }
    }
}

/// One row of the shaders' material table.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MaterialRow {
    /// Linear RGB reflectance, gloss.
    pub(crate) colour_gloss: [f32; 4],
    /// Pattern number, tint slot (4: none), unused, unused.
    pub(crate) pattern_tint: [f32; 4],
}

/// The shaders' material table, at the places of the materials' numbers.
pub(crate) fn table() -> [MaterialRow; Material::ALL.len()] {
    Material::ALL.map(|material| {
        let Looks { colour: [r, g, b], gloss, pattern, tint } = material.looks();
        MaterialRow {
            colour_gloss: [r, g, b, gloss],
            pattern_tint: [f32::from(pattern as u8), f32::from(tint as u8), 0.0, 0.0],
        }
    })
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
