//! Giving frames to the recorder.

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
    pub(super) async fn record(&mut self) -> Result<(), Refusal> {
        let Some(episode) = self.episode.as_ref().filter(|_| self.recorder.is_running()) else {
            return Ok(());
        };
        let vehicles = self.recorder.vehicles_to_inspect(&episode.frame);
        let mut physics = Vec::with_capacity(vehicles.len());
        for vehicle in vehicles {
            // One that the world does not know any more has nothing to tell.
            let Ok(report) = self.inspect(vehicle.into()).await else { continue };
            let Some(pose) = self.episode()?.state(vehicle).map(|state| state.world_from_actor)
            else {
                continue;
            };
            let control = VehiclePhysicsControl::of(&report.physics, &pose);
            physics.push(control.recorded(vehicle.get()));
        }
        let Some(episode) = &self.episode else { return Ok(()) };
        let scene = Scene { episode, lamps: self.lamps.lights(), weather: &self.weather, physics };
        self.recorder.record(scene);
        if !self.recorder.is_running() {
            self.end_journal().await;
        }
        Ok(())
    }
}
