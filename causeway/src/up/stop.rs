//! How urgently the site is to end.

use signals::Termination;
use tokio::sync::watch;

/// How urgently the site is to end. Only ever becomes more urgent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Stop {
    /// It runs.
    No,
    /// Processes get time to end in good order.
    InOrder,
    /// Processes are killed.
    AtOnce,
}

impl Stop {
    /// Returns when the site is to end.
    pub(crate) async fn requested(stop: &mut watch::Receiver<Self>) {
        // A sender that is gone can no longer ask; its owner is ending too.
        let _ = stop.wait_for(|stop| *stop >= Self::InOrder).await;
    }

    /// Returns when nobody wants to wait for good order.
    pub(crate) async fn at_once(stop: &mut watch::Receiver<Self>) {
        let _ = stop.wait_for(|stop| *stop == Self::AtOnce).await;
    }

    /// Makes the end at least this urgent.
    pub(crate) fn raise(sender: &watch::Sender<Self>, urgency: Self) {
        sender.send_if_modified(|stop| {
            let more = urgency > *stop;
            *stop = (*stop).max(urgency);
            more
        });
    }
}

/// Turns signals into stops for ever: the first is patient, the second is not.
///
/// # Errors
/// When the operating system takes no signal handler.
pub(crate) async fn on_signals(sender: &watch::Sender<Stop>) -> std::io::Result<()> {
    let mut termination = Termination::follow()?;
    let mut urgency = Stop::InOrder;
    loop {
        termination.requested().await;
        Stop::raise(sender, urgency);
        urgency = Stop::AtOnce;
    }
}
