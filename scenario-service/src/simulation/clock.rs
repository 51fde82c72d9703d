//! Time that passes when nothing is left to do at the present moment.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use tokio::sync::oneshot;

type Happening = Box<dyn FnOnce() + Send>;

/// A virtual clock, in milliseconds. Cheap to clone.
#[derive(Clone, Default)]
pub(super) struct Clock(Arc<Mutex<Agenda>>);

#[derive(Default)]
struct Agenda {
    now_millis: u64,
    /// By time, and of one time in the order in which they were noted.
    happenings: BTreeMap<(u64, u64), Happening>,
    noted: u64,
}

impl Clock {
    pub(super) fn now_millis(&self) -> u64 {
        self.0.lock().unwrap().now_millis
    }

    /// Has something happen after so many milliseconds.
    pub(super) fn after(&self, millis: u64, happening: impl FnOnce() + Send + 'static) {
        let mut agenda = self.0.lock().unwrap();
        let key = (agenda.now_millis + millis, agenda.noted);
        agenda.noted += 1;
        agenda.happenings.insert(key, Box::new(happening));
    }

    /// Returns after so many milliseconds.
    pub(super) async fn sleep(&self, millis: u64) {
        let (over, is_over) = oneshot::channel();
        self.after(millis, move || {
            // Nobody may wait any more.
            let _ = over.send(());
        });
        is_over.await.unwrap();
    }

    /// Goes to what happens next; whether there was anything.
    pub(super) fn go_on(&self) -> bool {
        let next = {
            let mut agenda = self.0.lock().unwrap();
            let next = agenda.happenings.pop_first();
            if let Some(((at_millis, _), _)) = &next {
                agenda.now_millis = *at_millis;
            }
            next
        };
        next.map(|(_, happening)| happening()).is_some()
    }
}
