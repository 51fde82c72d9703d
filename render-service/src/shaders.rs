//! The shaders' texts, put together: every pass is `common` and its own file.

use std::fmt::Write;

use bodies::Material;
use schemas::DEPTH_MAX_M;

use crate::scene::material::Family;

const COMMON: &str = include_str!("shaders/common.wgsl");
const SURFACE: &str = include_str!("shaders/surface.wgsl");

/// A pass that has a shader of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pass {
    Shadow,
    Sky,
    Rain,
    /// Depth, labels, normals.
    Geometry,
    Surface(Family),
}

/// The whole text of a pass.
pub(crate) fn text_of(pass: Pass) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "const MATERIAL_COUNT: u32 = {}u;", Material::ALL.len());
    let _ = writeln!(text, "const LAMPS_MAX: u32 = {}u;", raster::LAMPS_MAX);
    let _ = writeln!(text, "const OCCLUDERS_MAX: u32 = {}u;", raster::OCCLUDERS_MAX);
    let _ = writeln!(text, "const DEPTH_MAX_M: f32 = {DEPTH_MAX_M:?};");
    text.push_str(COMMON);
    let parts: &[&str] = match pass {
        Pass::Shadow => &[include_str!("shaders/shadow.wgsl")],
        Pass::Sky => &[include_str!("shaders/sky.wgsl")],
        Pass::Rain => &[include_str!("shaders/rain.wgsl")],
        Pass::Geometry => &[include_str!("shaders/geometry.wgsl")],
        Pass::Surface(Family::Ground) => &[SURFACE, include_str!("shaders/ground.wgsl")],
        Pass::Surface(Family::Facade) => &[SURFACE, include_str!("shaders/facade.wgsl")],
        Pass::Surface(Family::Body) => &[SURFACE, include_str!("shaders/body.wgsl")],
    };
    for part in parts {
        text.push_str(part);
    }
    text
}

#[cfg(test)]
mod tests {
    use wgpu::naga;

    use super::*;

    #[test]
    fn every_pass_is_valid_without_a_gpu() {
        let surfaces = Family::ALL.map(Pass::Surface);
        for pass in
            [Pass::Shadow, Pass::Sky, Pass::Rain, Pass::Geometry].into_iter().chain(surfaces)
        {
            let text = text_of(pass);
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|error| panic!("{pass:?}: {}", error.emit_to_string(&text)));
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::empty(),
            );
            if let Err(error) = validator.validate(&module) {
                panic!("{pass:?}: {}", error.emit_to_string(&text));
            }
        }
    }
}
