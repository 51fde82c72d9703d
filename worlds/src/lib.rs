//! Worlds as faces use them: where they are, and what it takes to reach them.
//!
//! [`Hosts`] knows the world services of a bus, how much each has to do, and the way to it.
//! [`Worlds`] has the worlds of one tenant made where there is room, and asks and ticks each where
//! it is: by a shortcut on one machine, else on the bus. [`ParsedMaps`] are read once per content.
//! [`Recovery`] makes a world again whose service is gone. [`Strays`] tells which nobody uses.

mod budget;
mod client;
mod hosts;
mod maps;
mod patience;
mod placement;
mod recovery;
mod roster;
mod strays;
mod uploads;

use schemas::{Request, WorldId};

pub use budget::{Budget, Share};
pub use client::Worlds;
pub use hosts::{Host, Hosts};
pub use maps::ParsedMaps;
pub use patience::Patience;
pub use recovery::{
    Maker, NewWorld, RECOVERY_BYTES, RECOVERY_TICKS, Recovery, Remade, Seen, State,
};
pub use recovery::{bytes_of, is_gone};
pub use strays::{Strays, until_sweep};

/// The one world that a request is about.
pub fn world_of(request: &Request) -> Option<WorldId> {
    match request {
        Request::DestroyWorld { world }
        | Request::SnapshotWorld { world }
        | Request::ForkWorld { world, .. }
        | Request::RunCommands { world, .. }
        | Request::DescribeActors { world, .. }
        | Request::InspectVehicles { world, .. }
        | Request::CastRays { world, .. }
        | Request::ShareClock { world, .. }
        | Request::RecordWorld { world, .. } => Some(*world),
        Request::TickWorlds(_)
        | Request::CreateWorld { .. }
        | Request::RestoreWorld { .. }
        | Request::BranchJournal { .. }
        | Request::ListWorlds
        | Request::ListMaps
        | Request::PutMap { .. } => None,
    }
}
