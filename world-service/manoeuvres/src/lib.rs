//! What vehicles do on a test track, beside what real ones do: starts, stops, curves, steps of the
//! steering wheel, slopes, kerbs.
//!
//! [`report`] drives all of it and gives a table and plots; `causeway bench dynamics` writes them
//! to a folder. [`traffic`] does the same for the world's own traffic on a ring road (`causeway
//! bench traffic`), [`drive`] lets our drivers loose on any map (`causeway bench roads`).
//! Everything is simulated, so that one run is like every other.
//!
//! Lengths in metres, angles in radians, speeds in metres per second unless a name says otherwise.

mod aids;
mod corner;
mod disturb;
mod model;
mod plot;
mod published;
mod report;
mod ring;
mod roads;
mod straight;
mod switches;
mod track;
mod traffic;

pub use self::roads::{Drive, Drivers, Stuck, Trial, drive};
pub use aids::{SplitStop, TurnStop, split_stop, turn_stop};
pub use corner::{Dwell, dwell};
pub use published::{Known, Row, VEHICLES, measure};
pub use report::{Report, report};
pub use switches::Aids;
pub use traffic::{TrafficReport, traffic};

use schemas::Error;

/// What driving may end with: a refused command or a world that diverged.
pub type Result<T> = std::result::Result<T, Error>;
