//! Which service of a kind is up, and the fast way to it.

use std::sync::Arc;

use schemas::{ServiceId, ServiceKind};
use tokio::sync::watch;

use crate::{Bus, Channel, Presence};

/// A service to ask, and the bus it is on.
#[derive(Clone)]
pub struct Host {
    /// The bus.
    pub bus: Bus,
    /// Of those that are up, the one that was heard of first: at the beginning the first by name.
    pub id: ServiceId,
    /// The fast way to it; `None` until it is open.
    pub channel: Option<Arc<Channel>>,
}

/// Services that are up, and which of them is told.
struct Follower {
    kind: ServiceKind,
    key: fn(&ServiceId) -> String,
    told: Arc<watch::Sender<Option<Host>>>,
}

/// Follows the services of a kind, on a bus that may still be connecting. Channels are opened to
/// what they serve under `key`.
pub fn follow_hosts(
    bus: watch::Receiver<Option<Bus>>,
    kind: ServiceKind,
    key: fn(&ServiceId) -> String,
) -> watch::Receiver<Option<Host>> {
    let (told, host) = watch::channel(None);
    tokio::spawn(Follower { kind, key, told: Arc::new(told) }.run(bus));
    host
}

impl Follower {
    async fn run(self, mut bus: watch::Receiver<Option<Bus>>) {
        let Ok(bus) = bus.wait_for(Option::is_some).await.map(|bus| bus.clone()) else { return };
        let Some(bus) = bus else { return };
        let mut presence = match bus.watch(Some(self.kind)).await {
            Ok(presence) => presence,
            Err(error) => {
                tracing::error!(kind = ?self.kind, %error, "services cannot be followed");
                return;
            }
        };
        let mut up: Vec<ServiceId> = Vec::new();
        loop {
            match presence.next().await {
                Presence::Up(alive) => {
                    tracing::info!(kind = ?self.kind, host = %alive.id, "service up");
                    up.push(alive.id);
                }
                Presence::Down(_, id) => {
                    tracing::warn!(kind = ?self.kind, host = %id, "service down");
                    up.retain(|host| *host != id);
                }
            }
            self.tell(&bus, &up);
        }
    }

    fn tell(&self, bus: &Bus, up: &[ServiceId]) {
        let known = self.told.borrow().as_ref().map(|host| host.id.clone());
        if known.as_ref() == up.first() {
            return;
        }
        let new = |id: &ServiceId| Host { bus: bus.clone(), id: id.clone(), channel: None };
        self.told.send_replace(up.first().map(new));
        if let Some(id) = up.first() {
            let key = (self.key)(id);
            tokio::spawn(open_channel(
                bus.clone(),
                key,
                self.kind,
                id.clone(),
                Arc::clone(&self.told),
            ));
        }
    }
}

/// Opens the channel to a host; where that fails, it is asked by queries for good.
async fn open_channel(
    bus: Bus,
    key: String,
    kind: ServiceKind,
    id: ServiceId,
    told: Arc<watch::Sender<Option<Host>>>,
) {
    match bus.channel(&key, (kind, &id)).await {
        Ok(channel) => {
            told.send_if_modified(|host| match host {
                Some(host) if host.id == id => {
                    host.channel = Some(Arc::new(channel));
                    true
                }
                _ => false,
            });
        }
        Err(error) => {
            tracing::warn!(host = %id, %error, "questions go as queries: no fast channel")
        }
    }
}
