//! What the sessions of each tenant share.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemas::Tenant;

use super::SessionContext;
use crate::world_port::WorldPort;

type Port = Arc<dyn WorldPort>;

/// A context for each tenant that has come, made when it first does. Nobody comes whom the file of
/// tenants does not name, so there are not more than that has had.
pub(crate) struct Contexts {
    first: Arc<SessionContext>,
    port_of: Box<dyn Fn(&Tenant) -> Port + Send + Sync>,
    by_tenant: Mutex<BTreeMap<Tenant, Arc<SessionContext>>>,
}

impl Contexts {
    /// Those of one tenant, and how others reach their worlds.
    pub(crate) fn new(
        tenant: Tenant,
        first: Arc<SessionContext>,
        port_of: impl Fn(&Tenant) -> Port + Send + Sync + 'static,
    ) -> Self {
        let by_tenant = BTreeMap::from([(tenant, Arc::clone(&first))]);
        Self { first, port_of: Box::new(port_of), by_tenant: Mutex::new(by_tenant) }
    }

    /// That of the service's own tenant: what does not depend on a tenant is alike in all.
    pub(crate) fn first(&self) -> &SessionContext {
        &self.first
    }

    /// That of a tenant.
    pub(crate) fn of(&self, tenant: &Tenant) -> Arc<SessionContext> {
        let mut contexts = self.lock();
        if let Some(context) = contexts.get(tenant) {
            return Arc::clone(context);
        }
        let context = Arc::new(self.first.beside(tenant.clone(), (self.port_of)(tenant)));
        contexts.insert(tenant.clone(), Arc::clone(&context));
        context
    }

    /// All that there are.
    pub(crate) fn all(&self) -> Vec<Arc<SessionContext>> {
        self.lock().values().cloned().collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Tenant, Arc<SessionContext>>> {
        // What may panic while it holds the lock leaves the map as it was.
        self.by_tenant.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
