//! Keeps one process of every service running until the site is to end.

use std::process::ExitStatus;
use std::time::Instant;

use tokio::sync::watch;
use tokio::task::JoinSet;

use super::child::{Child, Service};
use super::restart::{RestartPolicy, Verdict};
use super::stop::Stop;

/// Why a service is given up. None of its processes is left.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ServiceError {
    /// The operating system starts no process.
    #[error("cannot start a process for {service}: {cause}")]
    Spawn {
        /// Which.
        service: &'static str,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// The service's own refusal is in the log above.
    #[error(
        "{service} cannot work with these settings ({status}); its reason is in the line above"
    )]
    Misconfigured {
        /// Which.
        service: &'static str,
        /// How the process ended.
        status: ExitStatus,
    },
    /// The service's own reasons are in the log above.
    #[error(
        "{service} does not start ({status}, five times in a row); its reason is in the lines above"
    )]
    CannotStart {
        /// Which.
        service: &'static str,
        /// How the last process ended.
        status: ExitStatus,
    },
}

/// Runs all services until the site is to end, and leaves no process behind.
///
/// # Errors
/// The first essential service that is given up; it ends the site.
pub(crate) async fn supervise(
    services: Vec<Service>,
    stop: &watch::Sender<Stop>,
) -> Result<(), ServiceError> {
    let mut running = JoinSet::new();
    for service in services {
        let stop = stop.subscribe();
        running.spawn(async move {
            let essential = service.essential;
            (essential, keep_running(service, stop).await)
        });
    }
    let mut outcome = Ok(());
    while let Some(ended) = running.join_next().await {
        match ended {
            Ok((_, Ok(()))) => {}
            Ok((true, Err(error))) => {
                Stop::raise(stop, Stop::InOrder);
                outcome = outcome.and(Err(error));
            }
            Ok((false, Err(error))) => tracing::warn!("{error}; everything else goes on"),
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        }
    }
    outcome
}

async fn keep_running(
    service: Service,
    mut stop: watch::Receiver<Stop>,
) -> Result<(), ServiceError> {
    let mut policy = RestartPolicy::new();
    let name = service.name;
    for generation in 1.. {
        let started = Instant::now();
        let spawn_error = |cause| ServiceError::Spawn { service: name, cause };
        let mut child = Child::start(&service, generation).map_err(spawn_error)?;
        let status = tokio::select! {
            status = child.wait() => status.map_err(spawn_error)?,
            () = Stop::requested(&mut stop) => {
                child.stop(&mut stop).await;
                return Ok(());
            }
        };
        let pause = match policy.after_death(started.elapsed(), status.code()) {
            Verdict::RestartAfter(pause) => pause,
            Verdict::Misconfigured => {
                return Err(ServiceError::Misconfigured { service: name, status });
            }
            Verdict::CannotStart => {
                return Err(ServiceError::CannotStart { service: name, status });
            }
        };
        tracing::warn!("{name} ended ({status}); starting it again in {} ms", pause.as_millis());
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = Stop::requested(&mut stop) => return Ok(()),
        }
    }
    Ok(())
}
