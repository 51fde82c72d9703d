//! How surfaces look by what they are made of: one table, shared with the shaders.

use bodies::Material;
use bytemuck::{Pod, Zeroable};

/// How a material is shaded; pixels of one family take the same branches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Family {
    /// Roads, sidewalks, lawns, roofs: patterns from the world position.
    Ground,
    /// Walls with windows: patterns from the facade coordinates.
    Facade,
    /// Vehicles, people, things, bridges: paint, glass, light.
    Body,
}

impl Family {
    /// Every family, in drawing order: what is near and hides much comes first.
    pub(crate) const ALL: [Self; 3] = [Self::Body, Self::Facade, Self::Ground];

    /// The one that draws a material.
    pub(crate) fn of(material: Material) -> Self {
        match material {
            Material::Asphalt
            | Material::MarkingWhite
            | Material::MarkingYellow
            | Material::Kerb
            | Material::Sidewalk
            | Material::Grass
            | Material::Roof => Self::Ground,
            Material::Wall => Self::Facade,
            _ => Self::Body,
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
    Bark = 6,
    CarWindow = 7,
    VanWindow = 8,
    TruckWindow = 9,
    BusWindow = 10,
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
    fn of(material: Material) -> Self {
        match material {
            Material::Asphalt => Self::patterned([0.070, 0.071, 0.075], Pattern::Asphalt),
            Material::MarkingWhite => Self::patterned([0.62, 0.62, 0.60], Pattern::Marking),
            Material::MarkingYellow => Self::patterned([0.66, 0.40, 0.05], Pattern::Marking),
            Material::Kerb => Self::patterned([0.34, 0.335, 0.32], Pattern::Kerb),
            Material::Sidewalk => Self::patterned([0.30, 0.285, 0.265], Pattern::Paving),
            Material::Grass => Self::patterned([0.075, 0.145, 0.032], Pattern::Grass),
            Material::Roof => Self::patterned([0.20, 0.185, 0.175], Pattern::Asphalt),
            Material::Concrete => Self::plain([0.36, 0.35, 0.33]),
            Material::Wall => Self::plain([0.50, 0.44, 0.37]),
            Material::Foliage => Self::patterned([0.066, 0.140, 0.030], Pattern::Leaves),
            Material::Bark => Self::patterned([0.10, 0.065, 0.04], Pattern::Bark),
            Material::Metal => Self { gloss: 0.2, ..Self::plain([0.20, 0.21, 0.22]) },
            Material::Paint => Self::tinted(Tint::First, 0.75),
            Material::DarkPaint => Self { colour: [0.30; 3], ..Self::tinted(Tint::First, 0.5) },
            Material::Glass => Self { gloss: 1.0, ..Self::plain([0.012, 0.015, 0.018]) },
            Material::CabinGlass => Self::tinted(Tint::Fourth, 1.0),
            Material::CarWindow => Self::window(Pattern::CarWindow),
            Material::VanWindow => Self::window(Pattern::VanWindow),
            Material::TruckWindow => Self::window(Pattern::TruckWindow),
            Material::BusWindow => Self::window(Pattern::BusWindow),
            Material::Tyre => Self::plain([0.014, 0.014, 0.015]),
            Material::Rim => Self { gloss: 0.5, ..Self::plain([0.36, 0.37, 0.39]) },
            Material::Chrome => Self { gloss: 0.9, ..Self::plain([0.45, 0.46, 0.48]) },
            Material::BlackPlastic => Self { gloss: 0.12, ..Self::plain([0.020, 0.020, 0.022]) },
            Material::HeadLamp => Self { gloss: 0.8, ..Self::tinted(Tint::Second, 0.8) },
            Material::TailLamp => Self { gloss: 0.5, ..Self::tinted(Tint::Third, 0.5) },
            Material::Plate => Self::plain([0.70, 0.70, 0.66]),
            Material::Skin => Self::tinted(Tint::First, 0.0),
            Material::Hair => Self::tinted(Tint::Second, 0.05),
            Material::Shirt => Self::tinted(Tint::Third, 0.0),
            Material::Trousers => Self::tinted(Tint::Fourth, 0.0),
            Material::Shoe => Self::plain([0.030, 0.026, 0.024]),
            Material::Prop => Self::tinted(Tint::First, 0.05),
            Material::PropBand => Self::plain([0.75, 0.75, 0.73]),
        }
    }

    fn plain(colour: [f32; 3]) -> Self {
        Self { colour, gloss: 0.0, pattern: Pattern::Asphalt, tint: Tint::None }
    }

    fn patterned(colour: [f32; 3], pattern: Pattern) -> Self {
        Self { pattern, ..Self::plain(colour) }
    }

    fn window(pattern: Pattern) -> Self {
        Self { pattern, ..Self::tinted(Tint::Fourth, 1.0) }
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
        let Looks { colour: [r, g, b], gloss, pattern, tint } = Looks::of(material);
        MaterialRow {
            colour_gloss: [r, g, b, gloss],
            pattern_tint: [f32::from(pattern as u8), f32::from(tint as u8), 0.0, 0.0],
        }
    })
}
