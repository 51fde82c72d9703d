//! How far the world advances.

use std::sync::Arc;

use schemas::limits::{DT_SECS_MAX, DT_SECS_MIN, SUBSTEPS_MAX};
use schemas::{Command, TickOutcome};
use tokio::time::Instant;

use super::Endpoint;
use super::listeners::Whose;
use crate::dialect::EpisodeSettings;
use crate::pictures::Shape;
use crate::rpc::{Answer, Payload, Refusal};
use crate::sensors::merge;

impl Endpoint {
    /// A tick of its own accord: nobody else ticks any more.
    pub(crate) async fn tick_by_itself(&mut self) -> Answer {
        if self.settings.synchronous_mode {
            tracing::warn!(port = self.port, "nobody ticks any more: asynchronous mode again");
            self.settle(EpisodeSettings { synchronous_mode: false, ..self.settings.clone() });
        }
        let ticked = self.tick().await;
        if let Err(error) = &ticked {
            tracing::warn!(port = self.port, %error, "the world does not tick");
        }
        ticked.map(|_| Payload::Void)
    }

    /// Gets ready for the tick of a client; the answer is the number of the frame to come, as in
    /// CARLA: the client reads it while the world advances.
    ///
    /// Traffic Managers need that too: they are about to fall asleep when they have got an answer,
    /// and must not be woken at that moment.
    pub(crate) async fn prepare_tick(&mut self) -> Answer {
        self.get_ready().await?;
        Payload::value(&(self.frame_number + 1))
    }

    /// The tick of a client that has got its answer.
    pub(crate) async fn keep_promised_tick(&mut self) {
        let advanced = match self.visit {
            Some(_) => self.ask_visited().await,
            None => self.advance().await.map(drop),
        };
        if advanced.is_err() {
            self.show_standstill().await;
        }
    }

    /// Advances the world by one frame for the caller; where clients share the clock, or others do,
    /// as soon as all of them have asked.
    ///
    /// # Errors
    /// Those of the world.
    pub(crate) async fn tick_for_caller(&mut self) -> Result<(), Refusal> {
        if self.present.brief.shares_clock || self.visit.is_some() {
            self.present.asks_for_frame = true;
            return self.get_ready().await;
        }
        self.tick().await.map(drop)
    }

    /// Advances the world by one frame and shows it.
    ///
    /// # Errors
    /// Those of the world.
    pub(crate) async fn tick(&mut self) -> Result<u64, Refusal> {
        self.get_ready().await?;
        self.advance().await
    }

    /// Waits for what is still under way to clients.
    pub(super) async fn get_ready(&mut self) -> Result<(), Refusal> {
        self.ensure_episode().await?;
        self.move_away().await;
        self.episode()?;
        self.note_deserted_streams();
        self.await_listeners(Whose::Of(self.present.brief.caller)).await;
        self.await_pictures().await;
        Ok(())
    }

    async fn advance(&mut self) -> Result<u64, Refusal> {
        let now = Instant::now();
        let elapsed_secs = (now - self.present.brief.last_tick).as_secs_f64();
        let delta_secs = match self.settings.fixed_delta_seconds.0 {
            Some(fixed) => fixed,
            None => elapsed_secs.clamp(DT_SECS_MIN, DT_SECS_MAX),
        };
        // Longer frames than the world's longest tick are several ticks.
        let ticks = (delta_secs / DT_SECS_MAX).ceil().clamp(1.0, 100.0);
        let dt_secs = (delta_secs / ticks).clamp(DT_SECS_MIN, DT_SECS_MAX);
        self.present.brief.last_tick = now;
        self.play(delta_secs).await?;
        let outcome = self.tick_world(ticks as u32, Some(dt_secs)).await?;
        self.tell_refusals(&outcome.replies);
        let frame_dt_secs = self.episode()?.frame.dt_secs;
        let is_exact = (frame_dt_secs - dt_secs).abs() < 1e-9;
        let told_secs = if is_exact { delta_secs } else { frame_dt_secs * ticks };
        self.show_tick(outcome, told_secs).await
    }

    /// Shows the newest frame and what was measured in its tick, which took so long.
    ///
    /// # Errors
    /// Those of the world.
    pub(super) async fn show_tick(
        &mut self,
        outcome: TickOutcome,
        delta_secs: f64,
    ) -> Result<u64, Refusal> {
        self.frame_number += 1;
        let frame = self.episode()?.frame.clone();
        let before = self.shown.replace(frame);
        self.show_frame(delta_secs).await?;
        self.drop_old_shapes();
        self.tell_sensors(&merge(outcome.sensors)).await;
        self.take_pictures(outcome.cameras_due, before.as_deref());
        // Clients go on with the frame meanwhile.
        self.record().await;
        self.keep_state_if_due().await;
        Ok(self.frame_number)
    }

    /// Clients see the last frame once more under another number. Where they were promised one and
    /// the world is gone, their next call says why.
    pub(crate) async fn show_standstill(&mut self) {
        self.frame_number += 1;
        let delta_secs = self.standing_secs();
        if let Err(error) = self.show_frame(delta_secs).await {
            tracing::warn!(port = self.port, %error, "the world does not tick");
        }
    }

    /// Takes out what clients drew for a time that is over.
    fn drop_old_shapes(&mut self) {
        let Some(episode) = &self.episode else { return };
        let now_secs = episode.frame.sim_secs;
        let is_over = |shape: &Shape| shape.until_secs.is_some_and(|until| until < now_secs);
        if self.shapes.iter().any(is_over) {
            Arc::make_mut(&mut self.shapes).retain(|shape| !is_over(shape));
        }
    }

    /// Tells the world how to cut ticks into physics steps; not that of a session, who has done so.
    pub(crate) fn queue_substeps(&mut self) {
        if self.visit.is_some() {
            return;
        }
        let fixed = self.settings.fixed_delta_seconds.0;
        let dt_secs = fixed.unwrap_or(DT_SECS_MAX / 2.0).clamp(DT_SECS_MIN, DT_SECS_MAX);
        let steps = u32::try_from(self.settings.max_substeps).unwrap_or(1).clamp(1, SUBSTEPS_MAX);
        let substepping = self.settings.substepping && self.settings.max_substep_delta_time > 0.0;
        self.pending.push(Command::SetTimeStep {
            dt_secs,
            substep_secs_max: substepping.then_some(self.settings.max_substep_delta_time),
            substeps_max: substepping.then_some(steps),
        });
    }
}
