//! What all sessions of one tenant share.

use std::sync::Arc;
use std::time::Instant;

use monitoring::Monitor;
use schemas::{Camera, Command, Error, ErrorCode, Tenant};
use tenancy::{PixelBudget, Quotas};
use worlds::Budget;

use super::{SavedStates, SessionError, SharedWorlds};
use crate::figures::Figures;
use crate::limits::RECOVERY_BYTES_MAX;
use crate::maps::Maps;
use crate::scenario::{Profile, registry};
use crate::scenario_files::ScenarioFiles;
use crate::ticker::Ticker;
use crate::world_port::WorldPort;
use crate::world_port::collector::WorldCollector;

/// What all sessions of one tenant share.
pub(crate) struct SessionContext {
    /// Whose worlds they are.
    pub(crate) tenant: Tenant,
    /// Worlds.
    pub(crate) port: Arc<dyn WorldPort>,
    /// Those that sessions use.
    pub(crate) collector: Arc<WorldCollector>,
    /// Their ticks.
    pub(crate) ticker: Ticker,
    /// Their maps.
    pub(crate) maps: Maps,
    /// Scenarios beside the built-in ones.
    pub(crate) files: ScenarioFiles,
    /// The scenario of a session that names none.
    pub(crate) default_scenario: String,
    /// The profile of a session that names none.
    pub(crate) profile: Profile,
    /// Whether new sessions are taken.
    pub(crate) monitor: Monitor,
    /// What is counted.
    pub(crate) figures: Arc<Figures>,
    /// What may be kept to make worlds again, by sessions of all tenants.
    pub(crate) recovery: Arc<Budget>,
    /// What may still be drawn.
    pub(crate) pixels: PixelBudget,
    /// States of episodes to go on from.
    pub(crate) saved: SavedStates,
    /// Worlds that several sessions share.
    pub(crate) shared: SharedWorlds,
}

impl SessionContext {
    /// Everything behind the sessions, over one port.
    pub(crate) fn new(
        tenant: Tenant,
        port: Arc<dyn WorldPort>,
        default_scenario: String,
        profile: Profile,
    ) -> Self {
        Self {
            tenant,
            ticker: Ticker::new(Arc::clone(&port)),
            maps: Maps::new(Arc::clone(&port)),
            collector: WorldCollector::new(Arc::clone(&port)),
            port,
            files: ScenarioFiles::default(),
            default_scenario,
            profile,
            monitor: Monitor::default(),
            figures: Arc::default(),
            recovery: Budget::new(RECOVERY_BYTES_MAX),
            pixels: PixelBudget::default(),
            saved: SavedStates::default(),
            shared: SharedWorlds::default(),
        }
    }

    /// The same, with so many bytes to make worlds again.
    pub(crate) fn recovering(self, bytes_max: usize) -> Self {
        Self { recovery: Budget::new(bytes_max), ..self }
    }

    /// The same, with scenarios of files.
    pub(crate) fn playing(self, files: ScenarioFiles) -> Self {
        Self { files, ..self }
    }

    /// The same, watched over.
    pub(crate) fn watched(self, monitor: &Monitor) -> Self {
        let figures = Arc::new(Figures::new(monitor.metrics()));
        Self { monitor: monitor.clone(), figures, ..self }
    }

    /// The same for another tenant, whose worlds are reached by a port of its own.
    pub(crate) fn beside(&self, tenant: Tenant, port: Arc<dyn WorldPort>) -> Self {
        let new = Self::new(tenant, port, self.default_scenario.clone(), self.profile);
        Self {
            files: self.files.clone(),
            monitor: self.monitor.clone(),
            figures: Arc::clone(&self.figures),
            recovery: Arc::clone(&self.recovery),
            ..new
        }
    }

    /// Counts a picture against what the tenant may have drawn.
    ///
    /// # Errors
    /// Which quota is used up, and for how long; nothing is counted.
    pub(crate) fn may_draw(&self, quotas: Quotas, camera: &Camera) -> Result<(), String> {
        let Some(rate) = quotas.pixels_per_second else { return Ok(()) };
        let pixels = u64::from(camera.width_px) * u64::from(camera.height_px);
        self.pixels.take(pixels, rate, Instant::now()).map_err(|wait| {
            self.figures.pixels_refused.inc();
            let wait = wait.as_secs_f64();
            format!("the quota pixels_per_second = {rate} is used up; ask again in {wait:.2} s")
        })
    }

    /// Whether the tenant may have a world with what these commands spawn.
    ///
    /// # Errors
    /// [`SessionError::Refused`]: which quota says no.
    pub(crate) fn may_spawn(
        &self,
        quotas: Quotas,
        commands: &[Command],
    ) -> Result<(), SessionError> {
        let Some(max) = quotas.actors_per_world else { return Ok(()) };
        let is_spawn = |command: &&Command| matches!(command, Command::SpawnActor { .. });
        let count = commands.iter().filter(is_spawn).count();
        if count <= max as usize {
            return Ok(());
        }
        self.figures.actors_refused.inc();
        let text = format!("the quota actors_per_world = {max} allows no more; ask for fewer");
        let refusal = Error::new(ErrorCode::Capacity, text).wanted(max).found(count);
        Err(SessionError::Refused(refusal))
    }

    /// Has the map of the default scenario ready.
    ///
    /// # Errors
    /// [`SessionError`] when it cannot be had.
    pub(crate) async fn warm_up(&self) -> Result<(), SessionError> {
        let scenario = registry::find(&self.files, &self.default_scenario, self.profile)?;
        let map = self.maps.get(scenario.common().map_name()).await;
        map.map(drop).map_err(SessionError::World)
    }
}
