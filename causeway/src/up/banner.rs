//! What a person sees: where to connect, and what came up or went away.

use std::time::Instant;

use bus::{Bus, BusConfig, BusError, Presence};
use carla_gateway::{ClientVersion, PortOfTenant};
use schemas::ServiceKind;
use tokio::sync::watch;

use super::plan::Plan;
use super::stop::Stop;
use crate::outlet::Outlet;

/// Prints where to connect.
pub(crate) fn print_addresses(plan: &Plan) {
    tell(&format!("causeway {}", env!("CARGO_PKG_VERSION")));
    tell(&format!("  OpenEnv   http://{}", plan.http));
    for PortOfTenant { port, version, tenant } in &plan.carla {
        let whose = tenant.as_ref().map(|tenant| format!(" · {tenant}")).unwrap_or_default();
        let clients = match version {
            ClientVersion::V0_9 => "",
            ClientVersion::V0_10 => " · clients of 0.10",
        };
        tell(&format!("  CARLA     127.0.0.1:{port}{clients}{whose}"));
    }
    tell(&format!("  bus       {}", plan.bus));
    if let Some(address) = plan.admin.admin {
        tell(&format!("  probes    http://{address}"));
        for service in &plan.services {
            if let Some(address) = service.admin {
                tell(&format!("            http://{address} · {}", service.stem));
            }
        }
    }
}

/// Prints every service that comes up or goes away until the site is to end.
pub(crate) async fn print_arrivals(bus: BusConfig, mut stop: watch::Receiver<Stop>) {
    tokio::select! {
        Err(error) = follow(bus) => tracing::warn!("cannot tell what comes up: {error}"),
        () = Stop::requested(&mut stop) => {}
    }
}

async fn follow(bus: BusConfig) -> Result<std::convert::Infallible, BusError> {
    let started = Instant::now();
    let bus = Bus::open(bus).await?;
    let mut watch = bus.watch(None).await?;
    loop {
        match watch.next().await {
            Presence::Up(alive) => {
                let noun = noun(alive.kind);
                let millis = started.elapsed().as_millis();
                tell(&format!(
                    "  {noun:<9} {} · {} · up after {millis} ms",
                    alive.id, alive.detail
                ));
            }
            Presence::Down(kind, id) => tell(&format!("  {:<9} {id} · gone", noun(kind))),
        }
    }
}

fn tell(line: &str) {
    Outlet::Out.tell(line);
}

fn noun(kind: ServiceKind) -> &'static str {
    match kind {
        ServiceKind::World => "worlds",
        ServiceKind::Render => "renderer",
        ServiceKind::Scenario => "scenarios",
        ServiceKind::Gateway => "CARLA",
    }
}
