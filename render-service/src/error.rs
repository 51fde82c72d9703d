//! Why nothing can be drawn.

/// Why there is no renderer. Nothing is left open.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// No Vulkan adapter fits the choice.
    #[error("no adapter: wanted {wanted}, found {found}; `--adapter cpu` draws without Vulkan")]
    NoAdapter {
        /// The choice, as a person would say it.
        wanted: String,
        /// Names of the adapters that are there.
        found: String,
    },
    /// The adapter is there but does not open.
    #[error("adapter {adapter:?} does not open: {cause}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// What the driver says.
        cause: String,
    },
    /// The device died again and again while it was drawing.
    #[error("the device was lost {times} times in a row: {cause}")]
    DeviceLost {
        /// How often.
        times: u32,
        /// What the driver said last.
        cause: String,
    },
}

impl From<RenderError> for schemas::Error {
    fn from(error: RenderError) -> Self {
        Self::new(schemas::ErrorCode::RendererUnavailable, error.to_string())
    }
}
