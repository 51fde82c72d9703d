//! How much work a picture is worth.

/// How finely colours are computed. Shapes are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quality {
    /// Every second pixel of a row where both show one triangle, and of every second row of sky and
    /// ground; without fine grain.
    Low,
    /// Every pixel, with all that surfaces have, and edges softened by what lies beyond them.
    #[default]
    High,
}
