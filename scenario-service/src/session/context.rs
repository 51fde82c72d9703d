//! What all sessions share.

use std::sync::Arc;

use monitoring::Monitor;

use super::SessionError;
use crate::figures::Figures;
use crate::maps::Maps;
use crate::scenario::{Profile, registry};
use crate::ticker::Ticker;
use crate::world_port::WorldPort;
use crate::world_port::keeper::Keeper;

/// What all sessions share.
pub(crate) struct SessionContext {
    /// Worlds.
    pub(crate) port: Arc<dyn WorldPort>,
    /// Those that sessions use.
    pub(crate) keeper: Arc<Keeper>,
    /// Their ticks.
    pub(crate) ticker: Ticker,
    /// Their maps.
    pub(crate) maps: Maps,
    /// The scenario of a session that names none.
    pub(crate) default_scenario: String,
    /// The profile of a session that names none.
    pub(crate) profile: Profile,
    /// Whether new sessions are taken.
    pub(crate) monitor: Monitor,
    /// What is counted.
    pub(crate) figures: Figures,
}

impl SessionContext {
    /// Everything behind the sessions, over one port.
    pub(crate) fn new(
        port: Arc<dyn WorldPort>,
        default_scenario: String,
        profile: Profile,
    ) -> Self {
        Self {
            ticker: Ticker::new(Arc::clone(&port)),
            maps: Maps::new(Arc::clone(&port)),
            keeper: Keeper::new(Arc::clone(&port)),
            port,
            default_scenario,
            profile,
            monitor: Monitor::default(),
            figures: Figures::default(),
        }
    }

    /// The same, watched over.
    pub(crate) fn watched(self, monitor: &Monitor) -> Self {
        let figures = Figures::new(monitor.metrics());
        Self { monitor: monitor.clone(), figures, ..self }
    }

    /// Has the map of the default scenario ready.
    ///
    /// # Errors
    /// [`SessionError`] when it cannot be had.
    pub(crate) async fn warm_up(&self) -> Result<(), SessionError> {
        let scenario = registry::build(&self.default_scenario, self.profile)?;
        let map = self.maps.get(scenario.common().map_name()).await;
        map.map(drop).map_err(SessionError::World)
    }
}
