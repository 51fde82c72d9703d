//! The drawing thread: takes jobs as their tenants' turns come, draws a portion of some of them
//! together, and answers those that are done.

use std::num::NonZero;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use bus::{Bus, Incoming};
use schemas::{Error, ErrorCode, RenderJob, Reply, Tenant};
use tokio::runtime::Handle;

use crate::sliced::{Portion, SlicedJob, Work};
use crate::{RenderError, Renderer};

use super::cost::CostModel;
use super::fair_queue::{FairQueue, Whose};
use super::figures::Figures;
use super::job_queue::{Arrived, JOBS_MAX, JobQueue, Taken, Wait, is_ending};
use super::prompt_askers::PromptAskers;
use super::textures::{FetchedTexture, TextureShelf};
use super::towns::{BuiltTown, Towns};
use super::turns::{Awaited, Begin, Round, SAVED_NANOS_MAX, SLICE_NANOS, next_round};

/// Jobs that are drawn in slices, begun and not answered: each keeps up to 64 MiB.
const LARGE_MAX: usize = 16;
/// Of them, those of one tenant.
const LARGE_OF_TENANT_MAX: usize = 2;

/// What the drawing thread owns.
pub(crate) struct Worker {
    renderer: Result<Renderer, RenderError>,
    queue: Arc<JobQueue>,
    runtime: Handle,
    waiting: FairQueue<Task>,
    prompt_askers: PromptAskers,
    desk: Desk,
    /// For whom nothing is drawn.
    held: Option<Awaited>,
    /// Processors that draw, unless a GPU does.
    threads: Option<u32>,
    figures: Figures,
}

/// What it takes to begin a job.
struct Desk {
    towns: Towns,
    textures: TextureShelf,
    cost: CostModel,
    large: Vec<(Tenant, Weak<Large>)>,
    figures: Figures,
}

/// A job that waits, or waits for its next turn.
struct Task {
    asker: Asker,
    stage: Stage,
}

/// Whom to answer.
struct Asker {
    incoming: Incoming,
    taken: Taken,
    /// Held until the answer is sent, if the job is large.
    large: Option<Arc<Large>>,
}

/// That a large job is under way.
struct Large;

enum Stage {
    New(Box<RenderJob>),
    Begun(Begun),
}

type Begun = Box<SlicedJob<Box<RenderJob>>>;

/// A job whose turn it is.
struct Turn {
    whose: Whose,
    asker: Asker,
    job: Begun,
    portion: Portion,
    work: Work,
    /// What it costs, in nanoseconds.
    estimate: u64,
}

impl Worker {
    pub(crate) fn new(
        renderer: Result<Renderer, RenderError>,
        bus: Bus,
        queue: Arc<JobQueue>,
        figures: Figures,
    ) -> Self {
        let runtime = Handle::current();
        let is_software = renderer.as_ref().is_ok_and(Renderer::is_software);
        let desk = Desk {
            towns: Towns::new(bus.clone(), runtime.clone(), Arc::clone(&queue)),
            textures: TextureShelf::new(bus, runtime.clone(), Arc::clone(&queue)),
            cost: CostModel::new(is_software),
            large: Vec::new(),
            figures: figures.clone(),
        };
        let processors = std::thread::available_parallelism().map_or(1, NonZero::get);
        Self {
            renderer,
            queue,
            runtime,
            waiting: FairQueue::new(JOBS_MAX, SAVED_NANOS_MAX),
            prompt_askers: PromptAskers::default(),
            desk,
            held: None,
            threads: is_software.then_some(u32::try_from(processors).unwrap_or(u32::MAX)),
            figures,
        }
    }

    /// Answers jobs until the queue is closed.
    pub(crate) fn run(mut self) {
        let queue = Arc::clone(&self.queue);
        let pulse = Arc::clone(&self.figures.turns);
        let mut wait = Wait::Ever;
        while let Some(arrived) = queue.take(wait) {
            let _turn = pulse.begin(Instant::now());
            if let Some(held) = self.held.take() {
                held.settle(&mut self.waiting, Instant::now());
            }
            self.take_in(arrived);
            let Self { waiting, prompt_askers, desk, .. } = &mut self;
            desk.large.retain(|(_, large)| large.strong_count() > 0);
            let Round { turns, awaited } = next_round(waiting, prompt_askers, desk, Instant::now());
            // Nobody pays for a moment in which something else is drawn.
            self.held = awaited.filter(|_| turns.is_empty());
            wait = match &self.held {
                _ if !turns.is_empty() => Wait::No,
                Some(held) => Wait::Until(held.until),
                None => Wait::Ever,
            };
            self.draw(turns);
        }
        for task in self.waiting.remove(|_| true) {
            task.asker.incoming.refuse(is_ending());
        }
    }

    fn take_in(&mut self, Arrived { jobs, towns, textures, used }: Arrived) {
        for (whose, nanos) in used {
            self.waiting.charge(&whose, i64::try_from(nanos).unwrap_or(i64::MAX));
        }
        for (came_at, incoming) in jobs {
            let job = match (&self.renderer, incoming.render_job()) {
                (Err(error), _) => Err(error.clone().into()),
                (Ok(_), job) => job,
            };
            match job {
                Ok(job) => self.enqueue(came_at, incoming, Box::new(job)),
                Err(error) => self.figures.refuse(incoming, error),
            }
        }
        for BuiltTown { digest, town } in towns {
            self.desk.towns.note_end(&digest);
            match town {
                Ok(town) => self.desk.towns.keep(&digest, town),
                Err(error) => {
                    for task in self.waiting.remove(|task| task.stage.lacks(&digest)) {
                        self.figures.refuse(task.asker.incoming, error.clone());
                    }
                }
            }
        }
        for FetchedTexture { digest, texture } in textures {
            self.desk.textures.note_end(&digest, texture.as_ref().ok().cloned());
            if let Err(error) = texture {
                for task in self.waiting.remove(|task| task.stage.lacks_texture(&digest)) {
                    self.figures.refuse(task.asker.incoming, error.clone());
                }
            }
        }
        let firsts = self.waiting.first_of_each();
        let wanted =
            firsts.iter().filter_map(|(tenant, task)| Some((*tenant, task.stage.unbegun()?)));
        let wanted: Vec<(&Tenant, &RenderJob)> = wanted.collect();
        self.desk.towns.want(wanted.iter().map(|(tenant, job)| (*tenant, &job.frame.map)));
        for (_, job) in wanted {
            self.desk.textures.want(&job.frame.paint);
        }
    }

    fn enqueue(&mut self, came_at: Instant, incoming: Incoming, job: Box<RenderJob>) {
        let whose = (job.tenant.clone(), job.frame.world);
        self.prompt_askers.note_question(&whose, came_at);
        let asker = Asker { incoming, taken: self.queue.note_taken(), large: None };
        if let Err((task, error)) = self.waiting.push(whose, Task { asker, stage: Stage::New(job) })
        {
            self.figures.refuse(task.asker.incoming, error);
        }
    }

    fn draw(&mut self, mut turns: Vec<Turn>) {
        let Ok(renderer) = &mut self.renderer else { return };
        if turns.is_empty() {
            return;
        }
        let begun = Instant::now();
        let portions =
            turns.iter_mut().map(|turn| (&mut *turn.job, std::mem::take(&mut turn.portion)));
        let drawn = renderer.draw_portions(portions.collect());
        let took = begun.elapsed();
        tracing::debug!(jobs = turns.len(), micros = took.as_micros() as u64, "drawn");
        self.figures.batch_seconds.observe(took);
        self.settle(&turns, took);
        for Turn { whose, asker, job, .. } in turns {
            match &drawn {
                Err(error) => self.figures.refuse(asker.incoming, error.clone().into()),
                Ok(()) if job.is_drawn() => self.answer(whose, asker, job),
                Ok(()) => self.waiting.put_back(whose, Task { asker, stage: Stage::Begun(job) }),
            }
        }
    }

    /// Has everybody pay for his part of what it took.
    fn settle(&mut self, turns: &[Turn], took: Duration) {
        let (mut work, mut estimates) = (Work::default(), 0);
        for turn in turns {
            work += turn.work;
            estimates += turn.estimate;
        }
        let ratio = took.as_nanos() as f64 / estimates.max(1) as f64;
        for turn in turns {
            let paid = turn.estimate as i64;
            let cost = (paid as f64 * ratio) as i64;
            self.waiting.charge(&turn.whose, cost - paid);
            let used = Duration::from_nanos(u64::try_from(cost).unwrap_or_default());
            self.figures.tenant_seconds.add(turn.whose.0.as_str(), used);
        }
        self.desk.cost.learn(&work, took);
    }

    fn answer(&mut self, whose: Whose, asker: Asker, job: Begun) {
        self.prompt_askers.note_answer(whose.clone(), Instant::now());
        let figures = self.figures.clone();
        let has_rows = job.has_rows();
        // Encoding takes one of the processors that draw; a GPU draws on meanwhile.
        let paid_by = self.threads.filter(|_| has_rows);
        let paid_by = paid_by.map(|threads| (Arc::clone(&self.queue), whose, threads));
        let answer = move || {
            // Counted until the answer is sent.
            let Asker { incoming, taken: _taken, large: _large } = asker;
            let (work, begun) = (Work::of(job.job()), Instant::now());
            let finished = job.finish();
            if let Some((queue, whose, threads)) = paid_by {
                queue.put_used(whose, begun.elapsed() / threads);
            }
            match finished {
                Ok(images) => {
                    figures.drawn.inc();
                    figures.pictures.inc_by(images.images.len() as u64);
                    figures.pixels.inc_by(work.colour_px + work.geometry_px);
                    incoming.reply(&Reply::Images(images));
                }
                Err(error) => figures.refuse(incoming, error),
            }
        };
        // A large picture takes so long to be encoded and sent that others would wait for it.
        if has_rows {
            drop(self.runtime.spawn_blocking(answer));
        } else {
            answer();
        }
    }
}

impl Begin<Task> for Desk {
    type Turn = Turn;

    /// Once its town and its textures are there, unless it is one large job too many.
    fn can_begin(&self, tenant: &Tenant, task: &Task) -> bool {
        match &task.stage {
            Stage::Begun(_) => true,
            Stage::New(job) => {
                self.towns.has(&job.frame.map.digest)
                    && self.textures.has(&job.frame.paint)
                    && (!is_large(job, &self.cost) || self.has_room(tenant))
            }
        }
    }

    fn cost_of_turn(&self, task: &Task) -> u64 {
        match &task.stage {
            Stage::New(job) => self.cost.nanos(&Work::of(job)).min(SLICE_NANOS),
            Stage::Begun(job) => {
                let portion = job.portion(SLICE_NANOS, |work| self.cost.nanos(work));
                self.cost.nanos(&job.work_of(&portion))
            }
        }
    }

    fn begin(&mut self, whose: &Whose, Task { mut asker, stage }: Task) -> Option<(Turn, u64)> {
        if asker.incoming.is_given_up() {
            self.figures.given_up.inc();
            asker.incoming.refuse(Error::new(ErrorCode::TimedOut, "nobody waits for it"));
            return None;
        }
        let begun = match stage {
            Stage::Begun(job) => Ok(job),
            Stage::New(job) => {
                if is_large(&job, &self.cost) {
                    let large = Arc::new(Large);
                    self.large.push((whose.0.clone(), Arc::downgrade(&large)));
                    asker.large = Some(large);
                }
                let town = self.towns.get(&job.frame.map.digest)?;
                let textures = self.textures.get(&job.frame.paint);
                SlicedJob::new(town, job, &textures).map(Box::new)
            }
        };
        match begun {
            Ok(job) => {
                let portion = job.portion(SLICE_NANOS, |work| self.cost.nanos(work));
                let work = job.work_of(&portion);
                let estimate = self.cost.nanos(&work);
                let whose = whose.clone();
                Some((Turn { whose, asker, job, portion, work, estimate }, estimate))
            }
            Err(error) => {
                self.figures.refuse(asker.incoming, error);
                None
            }
        }
    }
}

impl Desk {
    /// Whether one more large job may be begun.
    fn has_room(&self, tenant: &Tenant) -> bool {
        let of_tenant = self.large.iter().filter(|(other, _)| other == tenant).count();
        of_tenant < LARGE_OF_TENANT_MAX && self.large.len() < LARGE_MAX
    }
}

/// Whether a job is drawn in slices.
fn is_large(job: &RenderJob, cost: &CostModel) -> bool {
    cost.nanos(&Work::of(job)) > SLICE_NANOS
}

impl Stage {
    /// Whether it waits for a town.
    fn lacks(&self, digest: &str) -> bool {
        self.unbegun().is_some_and(|job| job.frame.map.digest == digest)
    }

    /// Whether it waits for a texture.
    fn lacks_texture(&self, digest: &str) -> bool {
        let is_it = |other: &String| other == digest;
        self.unbegun().is_some_and(|job| job.frame.paint.textures.iter().any(is_it))
    }

    /// The job, unless it is begun.
    fn unbegun(&self) -> Option<&RenderJob> {
        match self {
            Self::New(job) => Some(job),
            Self::Begun(_) => None,
        }
    }
}

impl Figures {
    fn refuse(&self, incoming: Incoming, error: Error) {
        tracing::debug!(%error, "a job was refused");
        self.refused.inc();
        incoming.refuse(error);
    }
}
