//! The drawing thread: takes all waiting jobs, draws them together, answers each.

use std::time::Instant;

use bus::{Bus, Incoming};
use schemas::{Error, RenderJob, Reply};
use tokio::runtime::Handle;

use crate::renderer::TownJob;
use crate::{RenderError, Renderer};

use super::figures::Figures;
use super::job_queue::{JobQueue, Task, pixels_of};
use super::towns::Towns;

/// Jobs drawn together: more would only make the first ones wait for the last ones.
const TOGETHER_MAX: usize = 16;
/// Once jobs that are drawn together have so many pixels, no more join them: others would wait for
/// all of them.
const PIXELS_TOGETHER_MAX: usize = 4 * 1024 * 1024;

/// What the drawing thread owns.
pub(crate) struct Worker {
    renderer: Result<Renderer, RenderError>,
    towns: Towns,
    figures: Figures,
}

impl Worker {
    pub(crate) fn new(
        renderer: Result<Renderer, RenderError>,
        bus: Bus,
        runtime: Handle,
        figures: Figures,
    ) -> Self {
        Self { renderer, towns: Towns::new(bus, runtime), figures }
    }

    /// Answers jobs until the queue is closed.
    pub(crate) fn run(mut self, queue: &JobQueue) {
        while let Some(tasks) = queue.take(TOGETHER_MAX, PIXELS_TOGETHER_MAX) {
            let turns = std::sync::Arc::clone(&self.figures.turns);
            let _turn = turns.begin(Instant::now());
            self.answer(tasks);
        }
    }

    fn answer(&mut self, tasks: Vec<Task>) {
        let renderer = match &mut self.renderer {
            Ok(renderer) => renderer,
            Err(error) => {
                for task in tasks {
                    self.figures.refused.inc();
                    task.incoming.refuse(error.clone().into());
                }
                return;
            }
        };
        let mut drawable = Vec::with_capacity(tasks.len());
        for Task { job, incoming } in tasks {
            match self.towns.get(&job.frame.map) {
                Ok(town) => drawable.push((town, job, incoming)),
                Err(error) => self.figures.refuse(incoming, &job, error),
            }
        }
        let jobs: Vec<TownJob<'_>> =
            drawable.iter().map(|(town, job, _)| (town.clone(), job)).collect();
        let begun = Instant::now();
        let drawn = renderer.render(&jobs);
        let took = begun.elapsed();
        tracing::debug!(jobs = jobs.len(), micros = took.as_micros() as u64, "drawn");
        if !jobs.is_empty() {
            self.figures.batch_seconds.observe(took);
        }
        drop(jobs);
        for ((_, job, incoming), images) in drawable.into_iter().zip(drawn) {
            match images {
                Ok(images) => {
                    self.figures.drawn.inc();
                    self.figures.pictures.inc_by(images.images.len() as u64);
                    self.figures.pixels.inc_by(pixels_of(&job) as u64);
                    incoming.reply(&Reply::Images(images));
                }
                Err(error) => self.figures.refuse(incoming, &job, error),
            }
        }
    }
}

impl Figures {
    fn refuse(&self, incoming: Incoming, job: &RenderJob, error: Error) {
        tracing::debug!(tenant = %job.tenant, world = %job.frame.world, tick = %job.frame.tick, %error, "a job was refused");
        self.refused.inc();
        incoming.refuse(error);
    }
}
