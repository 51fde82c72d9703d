//! Keeps one process of every service running until the site is to end.

use std::process::ExitStatus;
use std::time::{Duration, Instant};

use monitoring::{Counter, Monitor};
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::child::{Child, Service};
use super::restart::{RestartPolicy, Verdict};
use super::stop::Stop;

/// A service cannot work with these settings. The service's own refusal is in the log above.
#[derive(Debug, thiserror::Error)]
#[error("{service} cannot work with these settings; its reason is in the line above")]
pub(crate) struct Misconfigured {
    service: &'static str,
}

/// Runs all services until the site is to end, and leaves no process behind. A service that dies
/// is started again for ever, while the others go on. In the window of the monitor faces end first,
/// and those that they ask when they have.
///
/// # Errors
/// The first essential service that refuses its settings; it ends the site.
pub(crate) async fn supervise(
    services: Vec<Service>,
    stop: &watch::Sender<Stop>,
    monitor: &Monitor,
) -> Result<(), Misconfigured> {
    let restarts = monitor.metrics().counter("causeway_up_restarts", "Services started again");
    let (mut asked, rest) = (stop.subscribe(), watch::Sender::new(Stop::No));
    let mut faces = services.iter().filter(|service| service.is_face).count();
    let mut running = JoinSet::new();
    for service in services {
        let stop = if service.is_face { stop.subscribe() } else { rest.subscribe() };
        let restarts = restarts.clone();
        running.spawn(async move {
            let (essential, is_face) = (service.essential, service.is_face);
            (essential, is_face, keep_running(service, stop, restarts).await)
        });
    }
    let mut outcome = Ok(());
    loop {
        let urgency = *asked.borrow_and_update();
        if urgency >= Stop::InOrder && !monitor.window().is_zero() && !monitor.is_ending() {
            monitor.begin_end();
        }
        if urgency == Stop::AtOnce || faces == 0 || monitor.window().is_zero() {
            Stop::raise(&rest, urgency);
        }
        let ended = tokio::select! {
            ended = running.join_next() => ended,
            // The sender is with whoever called.
            _ = asked.changed() => continue,
        };
        match ended {
            None => return outcome,
            Some(Ok((essential, is_face, ended))) => {
                faces -= usize::from(is_face);
                match ended {
                    Ok(()) => {}
                    Err(error) if essential => {
                        Stop::raise(stop, Stop::InOrder);
                        outcome = outcome.and(Err(error));
                    }
                    Err(error) => tracing::warn!("{error}; everything else goes on"),
                }
            }
            Some(Err(panic)) => std::panic::resume_unwind(panic.into_panic()),
        }
    }
}

async fn keep_running(
    service: Service,
    mut stop: watch::Receiver<Stop>,
    restarts: Counter,
) -> Result<(), Misconfigured> {
    let mut policy = RestartPolicy::new();
    for generation in 1.. {
        let started = Instant::now();
        let Some(end) = run_once(&service, generation, &mut stop).await else { return Ok(()) };
        let code = end.as_ref().ok().and_then(ExitStatus::code);
        let Verdict::Restart { pause, quick_deaths } = policy.after_death(started.elapsed(), code)
        else {
            return Err(Misconfigured { service: service.name });
        };
        tell(service.name, &end, pause, quick_deaths);
        restarts.inc();
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = Stop::requested(&mut stop) => return Ok(()),
        }
    }
    Ok(())
}

/// How one process of the service ended, or that there could be none; `None` when the site is to
/// end.
async fn run_once(
    service: &Service,
    generation: u64,
    stop: &mut watch::Receiver<Stop>,
) -> Option<std::io::Result<ExitStatus>> {
    let mut child = match Child::start(service, generation) {
        Ok(child) => child,
        Err(cause) => return Some(Err(cause)),
    };
    let ended = tokio::select! {
        ended = child.wait() => Some(ended),
        () = Stop::requested(stop) => None,
    };
    if ended.is_none() {
        child.stop(stop).await;
    }
    ended
}

fn tell(name: &str, end: &std::io::Result<ExitStatus>, pause: Duration, quick_deaths: u32) {
    let again_in_millis = pause.as_millis();
    let what = match end {
        Ok(status) => format!("{name} ended ({status})"),
        Err(cause) => format!("no process can be started for {name}: {cause}"),
    };
    if quick_deaths > 1 {
        tracing::error!(
            "{what}, {quick_deaths} times in a row before it worked; the others go on; starting \
             it again in {again_in_millis} ms"
        );
    } else {
        tracing::warn!("{what}; starting it again in {again_in_millis} ms");
    }
}
