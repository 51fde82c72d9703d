//! Giving frames to the recorder.

use recording::PhysicsControl;

use super::Endpoint;
use crate::dialect::VehiclePhysicsControl;
use crate::recorder::Scene;
use crate::rpc::Refusal;

impl Endpoint {
    /// Records one more frame where frames come by themselves, so that what a client asked for
    /// right before the end of the recording is in it.
    pub(crate) async fn record_last_frame(&mut self) {
        if !self.recorder.is_running() || !self.present.brief.ticks_by_itself {
            return;
        }
        if let Err(error) = self.tick().await {
            tracing::warn!(%error, "a recording ends without its last frame");
        }
    }

    /// Records the newest frame, if there is a recording.
    pub(super) async fn record(&mut self) {
        if !self.recorder.is_running() {
            return;
        }
        let physics = self.physics_to_record().await.unwrap_or_else(|refusal| {
            tracing::debug!(%refusal, "a frame is recorded without the physics of its vehicles");
            Vec::new()
        });
        let Some(episode) = &self.episode else { return };
        let scene = Scene { episode, lamps: self.lamps.lights(), weather: &self.weather, physics };
        self.recorder.record(scene);
        if !self.recorder.is_running() {
            self.end_journal().await;
        }
    }

    /// Physics of vehicles that are new or whose physics was changed, in the newest frame.
    ///
    /// # Errors
    /// Those of the world, also when it does not know one of them.
    async fn physics_to_record(&mut self) -> Result<Vec<PhysicsControl>, Refusal> {
        let wanted = |it: &Self| {
            let frame = it.episode.as_ref().map(|episode| &episode.frame);
            frame.map_or_else(Vec::new, |frame| it.recorder.vehicles_to_inspect(frame))
        };
        if wanted(self).is_empty() {
            return Ok(Vec::new());
        }
        // A vehicle that was to be destroyed is gone then.
        self.flush().await?;
        let vehicles = wanted(self);
        let reports = self.reports(&vehicles).await?;
        let episode = self.episode()?;
        let told = vehicles.into_iter().zip(&reports).filter_map(|(vehicle, report)| {
            let pose = episode.state(vehicle)?.world_from_actor;
            Some(VehiclePhysicsControl::of(&report.physics, &pose).recorded(vehicle.get()))
        });
        Ok(told.collect())
    }
}
