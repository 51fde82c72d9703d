//! Which services take no new work: liveliness tokens beside those that say who is up, so that who
//! comes later knows it too, and nothing is left of a service that is gone.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use schemas::{ServiceId, ServiceKind, keys};
use tokio::sync::watch;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::{Bus, BusError};

/// Services of a kind of which it is known that they drain.
const DRAINING_MAX: usize = 4_096;

/// The services of a kind that take no new work.
pub struct Draining {
    services: watch::Receiver<BTreeSet<ServiceId>>,
    _subscriber: Subscriber<()>,
}

impl Bus {
    /// Tells everyone, whenever and as long as `is_draining`, that a service takes no new work.
    /// Ends when nobody can change that any more.
    pub async fn tell_draining<T>(
        &self,
        (kind, id): (ServiceKind, ServiceId),
        mut drain: watch::Receiver<T>,
        is_draining: impl Fn(&T) -> bool,
    ) {
        let key = keys::draining(kind, &id);
        let mut token: Option<LivelinessToken> = None;
        loop {
            let is_on = is_draining(&drain.borrow_and_update());
            if !is_on {
                token = None;
            } else if token.is_none() {
                match self.session.liveliness().declare_token(&key).await {
                    Ok(declared) => token = Some(declared),
                    Err(cause) => tracing::error!(key, %cause, "nobody hears that it drains"),
                }
            }
            if drain.changed().await.is_err() {
                return;
            }
        }
    }

    /// Follows which services of a kind take no new work.
    ///
    /// # Errors
    /// [`BusError::Declare`] when the session is closed.
    pub async fn follow_draining(&self, kind: ServiceKind) -> Result<Draining, BusError> {
        let key = keys::any_draining(kind);
        let (told, services) = watch::channel(BTreeSet::new());
        // Of several changes each sees the one before; then whether it was said that there are too
        // many.
        let told = Mutex::new((told, false));
        let on_change = move |sample: Sample| {
            let Some((_, id)) = keys::parse_draining(sample.key_expr().as_str()) else { return };
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            let (told, is_full_told) = &mut *told;
            told.send_if_modified(|services| match sample.kind() {
                SampleKind::Delete => services.remove(&id),
                SampleKind::Put if services.len() < DRAINING_MAX => services.insert(id.clone()),
                SampleKind::Put => {
                    if !std::mem::replace(is_full_told, true) {
                        tracing::error!(
                            max = DRAINING_MAX,
                            "more services drain than can be followed"
                        );
                    }
                    false
                }
            });
        };
        let subscriber =
            self.session.liveliness().declare_subscriber(&key).history(true).callback(on_change);
        let subscriber = subscriber
            .await
            .map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
        Ok(Draining { services, _subscriber: subscriber })
    }
}

impl Draining {
    /// Whether a service takes no new work, as far as was heard.
    pub fn has(&self, id: &ServiceId) -> bool {
        self.services.borrow().contains(id)
    }

    /// Returns when it has changed since the last time.
    pub async fn changed(&mut self) {
        if self.services.changed().await.is_err() {
            // The subscriber has the other end and lives as long as this.
            std::future::pending().await
        }
    }
}
