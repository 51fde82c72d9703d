//! Wires the renderer to the bus; owns all threads.

use std::sync::Arc;
use std::thread::JoinHandle;

use bus::{Announcement, Bus, BusConfig, BusError, Serving};
use monitoring::{Drain, Monitor};
use schemas::{Alive, PictureQuality, ServiceId, ServiceKind, keys};
use signals::Termination;
use tokio::sync::oneshot;

use crate::config::{Args, Config};
use crate::service::figures::Figures;
use crate::service::job_queue::{JOBS_MAX, JobQueue};
use crate::service::worker::Worker;
use crate::{AdapterChoice, RenderError, Renderer};

/// Why the service cannot start or had to end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServiceError {
    /// No place on the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The operating system refuses threads or signals.
    #[error("the operating system refuses {what}: {cause}")]
    System {
        /// What was asked of it.
        what: &'static str,
        /// What it says.
        cause: std::io::Error,
    },
    /// Our own fault; the log has the place.
    #[error("the drawing thread has panicked")]
    Panicked,
}

/// A running render service. Dropped, it takes no more jobs; [`stop`](Self::stop) also waits.
pub struct RenderService {
    bus: Bus,
    queue: Arc<JobQueue>,
    adapter: String,
    worker: JoinHandle<()>,
    ended: Option<oneshot::Receiver<()>>,
    _announcement: Announcement,
    _servings: [Serving; 2],
}

/// Runs the service until it is told to end by SIGINT or SIGTERM; in the window of its monitor it
/// sends jobs to other renderers then, and ends when those that wait here are drawn.
///
/// # Errors
/// [`ServiceError`] when it cannot start, or when its drawing thread ends on its own.
pub fn run(args: Args, monitor: &Monitor) -> Result<(), ServiceError> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(system("threads"))?;
    runtime.block_on(async {
        let mut termination = Termination::follow().map_err(system("signals"))?;
        tokio::spawn(monitor.pulse("runtime").beat_for_ever());
        let starting = start(args.into(), monitor);
        let mut service = tokio::select! {
            service = starting => service?,
            () = termination.requested() => return Ok(()),
        };
        let queue = Arc::clone(&service.queue);
        tokio::select! {
            () = termination.drained(monitor, "pictures", move || queue.waiting()) => {}
            () = service.ended() => {}
        }
        service.stop().await
    })
}

/// Starts the service inside this process; on return it is announced.
///
/// Without any adapter it starts as well, and answers every job with the reason.
///
/// # Errors
/// [`ServiceError`] when it cannot start.
pub async fn start(config: Config, monitor: &Monitor) -> Result<RenderService, ServiceError> {
    let (choice, quality) = (config.adapter.clone(), config.quality);
    let opening = tokio::task::spawn_blocking(move || open(choice, quality));
    let (connect, identity) = (config.connect, config.identity);
    let bus = Bus::open(BusConfig { connect, identity, ..BusConfig::default() }).await?;
    bus.export(monitor.metrics());
    let renderer = opening.await.map_err(|_| ServiceError::Panicked)?;
    let adapter = match &renderer {
        Ok(renderer) => renderer.adapter_name().to_owned(),
        Err(error) => error.to_string(),
    };
    let capacity = if renderer.is_ok() { JOBS_MAX as u32 } else { 0 };

    let queue = Arc::new(JobQueue::default());
    let has_adapter = monitor.condition("adapter", &adapter);
    has_adapter.set(renderer.is_ok(), &adapter);
    let of_figures = Arc::clone(&queue);
    monitor.metrics().read_gauge("causeway_render_jobs_waiting", "Jobs that wait", move || {
        of_figures.waiting() as f64
    });
    let figures = Figures::new(monitor);
    let worker = Worker::new(renderer, bus.clone(), Arc::clone(&queue), figures);
    let (ending, ended) = oneshot::channel();
    let worker = std::thread::Builder::new()
        .name("draw".to_owned())
        .spawn(move || {
            // Dropped at the end of the thread, in a panic too.
            let _ending = ending;
            worker.run();
        })
        .map_err(system("threads"))?;

    let key = keys::render_job(&config.id);
    let take = |queue: Arc<JobQueue>| move |incoming| queue.put(incoming);
    let servings = [
        bus.serve(&key, take(Arc::clone(&queue))).await?,
        bus.serve_shortcut(&key, take(Arc::clone(&queue))).await?,
    ];
    let announcement = bus
        .announce(Alive {
            kind: ServiceKind::Render,
            id: config.id.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            capacity,
            detail: adapter.clone(),
            number: 0,
        })
        .await?;
    tell_draining(bus.clone(), config.id, monitor);
    monitor.set_started();
    Ok(RenderService {
        bus,
        queue,
        adapter,
        worker,
        ended: Some(ended),
        _announcement: announcement,
        _servings: servings,
    })
}

/// Tells those who have frames drawn while others should have their jobs.
fn tell_draining(bus: Bus, id: ServiceId, monitor: &Monitor) {
    let drain = monitor.follow_drain();
    tokio::spawn(async move {
        let service = (ServiceKind::Render, id);
        bus.tell_draining(service, drain, |drain: &Drain| drain.is_on()).await;
    });
}

impl RenderService {
    /// What draws, or why nothing does.
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Returns when the drawing thread has ended, which it never does by itself.
    async fn ended(&mut self) {
        if let Some(ended) = self.ended.take() {
            // The sender is dropped, never used.
            let _ = ended.await;
        }
    }

    /// Ends the service; jobs that still wait are told so.
    ///
    /// # Errors
    /// [`ServiceError::Panicked`] when the drawing thread had ended before.
    pub async fn stop(self) -> Result<(), ServiceError> {
        self.queue.close();
        let worker = self.worker;
        let joined = tokio::task::spawn_blocking(move || worker.join()).await;
        self.bus.close().await;
        match joined {
            Ok(Ok(())) => Ok(()),
            _ => Err(ServiceError::Panicked),
        }
    }
}

fn open(choice: AdapterChoice, quality: PictureQuality) -> Result<Renderer, RenderError> {
    let renderer = Renderer::new(choice).map(|renderer| renderer.with_quality(quality));
    match &renderer {
        Ok(renderer) => {
            tracing::info!(adapter = renderer.adapter_name(), "pictures are drawn by this adapter")
        }
        Err(error) => {
            tracing::warn!(%error, "pictures cannot be drawn; every job is answered with this reason")
        }
    }
    renderer
}

fn system(what: &'static str) -> impl FnOnce(std::io::Error) -> ServiceError {
    move |cause| ServiceError::System { what, cause }
}
