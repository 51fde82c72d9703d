//! The kernels' texts, put together: every kernel is the layout, what it shares, and its own file.

use std::fmt::Write;

use schemas::{DEPTH_MAX_M, SemanticTag};

/// What runs on the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kernel {
    /// Which clusters may be seen.
    Cull,
    /// Small triangles onto samples.
    Small,
    /// Large ones, block by block.
    Large,
    /// Samples to pixels.
    Shade,
}

impl Kernel {
    /// All, in the order in which they run.
    pub(crate) const ALL: [Self; 4] = [Self::Cull, Self::Small, Self::Large, Self::Shade];

    /// Its name, and that of its entry point.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Cull => "cull",
            Self::Small => "small",
            Self::Large => "large_blocks",
            Self::Shade => "shade",
        }
    }

    fn parts(self) -> &'static [&'static str] {
        match self {
            Self::Cull => &[include_str!("../shaders/cull.wgsl")],
            Self::Small => {
                &[include_str!("../shaders/triangle.wgsl"), include_str!("../shaders/small.wgsl")]
            }
            Self::Large => {
                &[include_str!("../shaders/triangle.wgsl"), include_str!("../shaders/large.wgsl")]
            }
            Self::Shade => &[
                include_str!("../shaders/light.wgsl"),
                include_str!("../shaders/arriving.wgsl"),
                include_str!("../shaders/ground.wgsl"),
                include_str!("../shaders/facade.wgsl"),
                include_str!("../shaders/cabin.wgsl"),
                include_str!("../shaders/body.wgsl"),
                include_str!("../shaders/sky.wgsl"),
                include_str!("../shaders/rain.wgsl"),
                include_str!("../shaders/shade.wgsl"),
            ],
        }
    }

    /// The whole text.
    pub(crate) fn text(self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "const DEPTH_MAX_M: f32 = {DEPTH_MAX_M:?};");
        let _ = writeln!(text, "const SKY_LABEL: u32 = {}u;", SemanticTag::Sky.number());
        text.push_str(include_str!("../shaders/layout.wgsl"));
        self.parts().iter().for_each(|part| text.push_str(part));
        text
    }
}

#[cfg(test)]
mod tests {
    use wgpu::naga;

    use super::*;

    #[test]
    fn every_kernel_is_valid_without_a_gpu() {
        use naga::valid::Capabilities;
        for kernel in Kernel::ALL {
            let text = kernel.text();
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|error| panic!("{kernel:?}: {}", error.emit_to_string(&text)));
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                Capabilities::SHADER_INT64 | Capabilities::SHADER_INT64_ATOMIC_MIN_MAX,
            );
            if let Err(error) = validator.validate(&module) {
                panic!("{kernel:?}: {}", error.emit_to_string(&text));
            }
        }
    }
}
