//! `causeway up`: a whole site on one machine.
//!
//! Checks what can be checked at once, starts every service at the same moment, and keeps them
//! running. Everything it starts ends with it.

mod banner;
mod check;
mod child;
mod plan;
mod ports;
mod readiness;
mod restart;
mod stop;
mod supervisor;

use bus::BusConfig;
use monitoring::Monitor;
use tokio::sync::watch;

use crate::failure::Failure;
use crate::watched;
use plan::Plan;
use stop::Stop;

pub(crate) use plan::Args;

/// Runs a site until SIGINT or SIGTERM.
///
/// # Errors
/// Settings that cannot work.
pub(crate) fn run(args: Args) -> Result<(), Failure> {
    let plan = Plan::resolve(args).map_err(|error| Failure::usage(&error))?;
    // The bus needs a runtime with threads; one is plenty for watching.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(|error| Failure::of(&error))?;
    let monitor = watched::begin("up", plan.admin, plan.window)?;
    readiness::follow(&plan.services, &monitor).map_err(|error| Failure::of(&error))?;
    let outcome = runtime.block_on(run_site(plan, &monitor));
    // Nobody waits for the transport, which may still be looking for a bus that is gone.
    runtime.shutdown_background();
    outcome
}

async fn run_site(plan: Plan, monitor: &Monitor) -> Result<(), Failure> {
    let (stop, _) = watch::channel(Stop::No);
    tokio::spawn(monitor.pulse("runtime").beat_for_ever());
    monitor.set_started();
    banner::print_addresses(&plan);
    let bus = BusConfig::connecting(plan.bus.clone());
    let bus = BusConfig { identity: plan.identity.clone(), ..bus };
    let announcing = tokio::spawn(banner::print_arrivals(bus, stop.subscribe()));
    let outcome = tokio::select! {
        outcome = supervisor::supervise(plan.services, &stop, monitor) => {
            outcome.map_err(|error| Failure::of(&error))
        }
        // Signals only ever end this one with an error.
        refused = stop::on_signals(&stop) => refused.map_err(|error| Failure::of(&error)),
    };
    announcing.abort();
    outcome
}
