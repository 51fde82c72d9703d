//! Time of sessions that goes on by itself while guests look on.

use std::sync::Arc;
use std::time::Instant;

use super::{Sessions, Slot};

impl Sessions {
    /// Has the worlds go on whose time does while no step is asked for. Nobody waits for one in
    /// which a tick takes long, and who is at work with a session lets time pass itself.
    pub(crate) fn keep_pace(&self) {
        let is_due = |slot: &&Arc<Slot>| slot.session.try_lock().is_ok_and(|it| it.is_paced());
        let due: Vec<Arc<Slot>> = self.lock().values().filter(is_due).cloned().collect();
        for slot in due {
            tokio::spawn(async move {
                if let Ok(mut session) = slot.session.try_lock() {
                    session.keep_pace(Instant::now()).await;
                }
            });
        }
    }
}
