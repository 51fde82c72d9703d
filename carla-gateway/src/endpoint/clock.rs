//! When and how far the world advances.

use std::sync::Arc;
use std::time::Duration;

use schemas::Command;
use schemas::limits::{DT_SECS_MAX, DT_SECS_MIN, SUBSTEPS_MAX};
use tokio::time::Instant;

use super::Endpoint;
use super::cameras::Poses;
use super::changeover::Changeover;
use crate::dialect::EpisodeSettings;
use crate::pictures::Shape;
use crate::rpc::{Connection, Payload, Refusal, Request};
use crate::sensors::merge;

/// Pause after a tick that failed, before the next one of its own accord.
const PAUSE_AFTER_FAILURE: Duration = Duration::from_millis(500);

impl Endpoint {
    /// When the world ticks by itself: never while nobody is connected, while clients tick, or
    /// while the Traffic Managers of one change over to a new world.
    pub(super) fn next_tick_at(&self) -> Option<Instant> {
        if self.changeover.as_ref().is_some_and(Changeover::is_loading) {
            return None;
        }
        if self.clients.is_empty() || self.episode.is_none() || self.lost.is_some() {
            return None;
        }
        if self.settings.synchronous_mode {
            return self.config.sync_lease.map(|lease| self.last_tick + lease);
        }
        let fixed = self.settings.fixed_delta_seconds.0.map(Duration::from_secs_f64);
        Some(self.last_tick + self.config.period.max(fixed.unwrap_or_default()))
    }

    /// The tick that [`next_tick_at`](Self::next_tick_at) announced.
    pub(super) async fn tick_by_itself(&mut self) {
        if self.settings.synchronous_mode {
            tracing::warn!(port = self.port, "nobody ticks any more: asynchronous mode again");
            self.settle(EpisodeSettings { synchronous_mode: false, ..self.settings.clone() });
        }
        if let Err(error) = self.tick().await {
            tracing::warn!(port = self.port, %error, "the world does not tick");
            self.last_tick = Instant::now() + PAUSE_AFTER_FAILURE;
        }
    }

    /// Answers "tick" with the number of the frame to come, as CARLA does, and then ticks: the
    /// client reads the answer while the world advances.
    ///
    /// Traffic Managers need that too: they are about to fall asleep when they have got an answer,
    /// and must not be woken at that moment ([`traffic`](super::traffic)).
    pub(super) async fn answer_and_tick(&mut self, connection: &Connection, request: &Request) {
        let ready = self.get_ready().await;
        let answer = ready.and_then(|()| Payload::value(&(self.frame_number + 1)));
        connection.outbox.answer(request, &answer);
        if answer.is_ok() && self.advance().await.is_err() {
            self.show_standstill().await;
        }
        self.traffic_managers.note_frame(connection.id, Instant::now());
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
    async fn get_ready(&mut self) -> Result<(), Refusal> {
        self.ensure_episode().await?;
        self.episode()?;
        self.await_listeners().await;
        self.await_pictures().await;
        Ok(())
    }

    async fn advance(&mut self) -> Result<u64, Refusal> {
        let now = Instant::now();
        let elapsed_secs = (now - self.last_tick).as_secs_f64();
        let delta_secs = match self.settings.fixed_delta_seconds.0 {
            Some(fixed) => fixed,
            None => elapsed_secs.clamp(DT_SECS_MIN, DT_SECS_MAX),
        };
        // Longer frames than the world's longest tick are several ticks.
        let ticks = (delta_secs / DT_SECS_MAX).ceil().clamp(1.0, 100.0);
        let dt_secs = (delta_secs / ticks).clamp(DT_SECS_MIN, DT_SECS_MAX);
        self.last_tick = now;
        let outcome = self.tick_world(ticks as u32, Some(dt_secs)).await?;
        self.frame_number += 1;
        let poses = Poses::in_frame(&self.episode()?.frame);
        let before = std::mem::replace(&mut self.poses, poses);
        let frame_dt_secs = self.episode()?.frame.dt_secs;
        let is_exact = (frame_dt_secs - dt_secs).abs() < 1e-9;
        self.show_frame(if is_exact { delta_secs } else { frame_dt_secs * ticks }).await?;
        self.drop_old_shapes();
        self.tell_sensors(&merge(outcome.sensors)).await;
        self.take_pictures(outcome.cameras_due, &before);
        Ok(self.frame_number)
    }

    /// Keeps the promise of a frame when the world is gone: clients see the last one once more, and
    /// their next call says why.
    async fn show_standstill(&mut self) {
        self.frame_number += 1;
        if let Err(error) = self.show_frame(0.0).await {
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

    /// Tells the world how to cut ticks into physics steps.
    pub(crate) fn queue_substeps(&mut self) {
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
