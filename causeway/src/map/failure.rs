//! Why a command on a map ended.

use std::path::PathBuf;

/// Nothing but the named file may have been written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MapFailure {
    /// Neither a file nor a known name.
    #[error("no map {name:?}: it is no file, and the known names are {known}")]
    Unknown {
        /// As typed.
        name: String,
        /// All names.
        known: String,
    },
    /// A file or folder that cannot be read.
    #[error(transparent)]
    Read(#[from] schemas::Error),
    /// No map at all.
    #[error(transparent)]
    Refused(#[from] roads::MapError),
    /// The check found faults that CARLA's client does not survive.
    #[error("CARLA's client would not survive {name:?}")]
    BreaksClient {
        /// As typed.
        name: String,
    },
    /// The ending chooses the format.
    #[error("cannot draw {path:?}: the file must end in .png or .svg")]
    Format {
        /// As typed.
        path: PathBuf,
    },
    /// The picture cannot be made of pixels.
    #[error("cannot draw a picture of {width_px} pixels: {cause}")]
    Pixels {
        /// As typed.
        width_px: u32,
        /// What the drawing library says.
        cause: String,
    },
    /// The file cannot be written.
    #[error("cannot write {path:?}")]
    Write {
        /// As typed.
        path: PathBuf,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// Standard output is gone.
    #[error("cannot write to standard output")]
    Output(#[source] std::io::Error),
}
