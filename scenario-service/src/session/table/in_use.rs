//! A session while somebody uses it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{Life, Sessions, Slot};

/// A session in use; what it leaves behind follows from its life.
pub(crate) struct InUse {
    pub(super) sessions: Arc<Sessions>,
    pub(super) slot: Arc<Slot>,
    pub(super) is_attached: bool,
}

impl std::ops::Deref for InUse {
    type Target = Slot;

    fn deref(&self) -> &Slot {
        &self.slot
    }
}

impl Drop for InUse {
    fn drop(&mut self) {
        self.slot.touch();
        if self.is_attached {
            self.slot.attached.store(false, Ordering::Release);
        }
        let ends =
            self.slot.life == Life::Connection || (self.is_attached && self.slot.is_closing());
        if ends {
            self.sessions.lock().remove(&self.slot.id);
        }
    }
}
