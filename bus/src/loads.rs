//! How much services have to do: published by each, dropped rather than awaited.

use schemas::{Load, ServiceId, ServiceKind, keys, wire};
use tokio::sync::mpsc;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

use crate::{Bus, BusError};

/// Loads that wait to be read; newer ones are dropped then.
const WAITING_MAX: usize = 256;

/// The loads of the services of a kind, as they are told.
pub struct Loads {
    told: mpsc::Receiver<(ServiceId, Load)>,
    _subscriber: Subscriber<()>,
}

impl Bus {
    /// Tells how much a service has to do. Never waits.
    pub fn tell_load(&self, kind: ServiceKind, id: &ServiceId, load: &Load) {
        self.publishing.push(keys::load(kind, id), wire::encode_load(load));
    }

    /// Follows the loads of the services of a kind.
    ///
    /// # Errors
    /// [`BusError::Declare`] when the session is closed.
    pub async fn follow_loads(&self, kind: ServiceKind) -> Result<Loads, BusError> {
        let key = keys::any_load(kind);
        let (tell, told) = mpsc::channel(WAITING_MAX);
        let on_load = move |sample: Sample| {
            let Some((_, id)) = keys::parse_load(sample.key_expr().as_str()) else { return };
            match wire::decode_load(&sample.payload().to_bytes()) {
                // The next one comes in a second.
                Ok(load) => drop(tell.try_send((id, load))),
                Err(error) => tracing::debug!(%id, %error, "a load cannot be read"),
            }
        };
        let subscriber = self.session.declare_subscriber(&key).callback(on_load);
        let subscriber = subscriber
            .await
            .map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
        Ok(Loads { told, _subscriber: subscriber })
    }
}

impl Loads {
    /// The next load that is told.
    pub async fn next(&mut self) -> (ServiceId, Load) {
        match self.told.recv().await {
            Some(told) => told,
            // The subscriber has the other end and lives as long as this.
            None => std::future::pending().await,
        }
    }
}
