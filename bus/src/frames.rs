//! Frames: published after every tick, dropped rather than awaited.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use schemas::{EncodedFrame, Tenant, WorldId, keys};
use zenoh::handlers::{RingChannel, RingChannelHandler};
use zenoh::matching::MatchingStatus;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::sample::Sample;

use crate::{Bus, BusError};

/// Frames a subscriber keeps; the oldest goes when a newer one comes.
const RING_FRAMES: usize = 4;

/// The newest frames of one or many worlds.
pub struct FrameSubscription {
    subscriber: Subscriber<RingChannelHandler<Sample>>,
}

/// One frame as it came over the bus, not yet verified.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PublishedFrame {
    /// Whose world.
    pub tenant: Tenant,
    /// Which world.
    pub world: WorldId,
    /// For [`schemas::wire::decode_frame`].
    pub frame: EncodedFrame,
}

/// Knows whether anybody subscribes to any frame, so that a tick of a world that nobody watches
/// need not be published. Cheap to clone and to ask.
#[derive(Clone)]
pub struct FrameListeners {
    any: Arc<AtomicBool>,
    _publisher: Arc<Publisher<'static>>,
}

impl FrameListeners {
    /// Whether somebody may be subscribed; late by the time a subscription takes to travel.
    pub fn any(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }
}

impl Bus {
    /// Follows whether anybody subscribes to frames.
    ///
    /// # Errors
    /// [`BusError::Declare`] when the session is closed.
    pub async fn frame_listeners(&self) -> Result<FrameListeners, BusError> {
        let error = |cause: zenoh::Error| BusError::Declare {
            key: keys::ANY_WORLD_FRAME.to_owned(),
            cause: cause.to_string(),
        };
        let publisher =
            self.session.declare_publisher(keys::ANY_WORLD_FRAME).await.map_err(error)?;
        let any = Arc::new(AtomicBool::new(false));
        let note = {
            let any = Arc::clone(&any);
            move |status: MatchingStatus| any.store(status.matching(), Ordering::Relaxed)
        };
        publisher.matching_listener().callback(note).background().await.map_err(error)?;
        // Whoever subscribed before the listener was there.
        if publisher.matching_status().await.map_err(error)?.matching() {
            any.store(true, Ordering::Relaxed);
        }
        Ok(FrameListeners { any, _publisher: Arc::new(publisher) })
    }

    /// Sends a frame to whoever subscribes; nobody is waited for.
    ///
    /// **Cost:** a copy of the frame and a wake-up; the sending is done by a thread of its own.
    pub fn publish_frame(&self, tenant: &Tenant, world: WorldId, frame: &EncodedFrame) {
        self.publishing.push(keys::world_frame(tenant, world), frame.0.clone());
    }

    /// Counts frames that were given up before they were sent, as newer ones waited.
    pub fn dropped_publications(&self) -> impl Fn() -> u64 + Send + Sync + use<> {
        self.publishing.dropped()
    }

    /// The frames of one world, or of all worlds of a tenant.
    ///
    /// # Errors
    /// [`BusError::Declare`] when the session is closed.
    pub async fn subscribe_frames(
        &self,
        tenant: &Tenant,
        world: Option<WorldId>,
    ) -> Result<FrameSubscription, BusError> {
        let key = match world {
            Some(world) => keys::world_frame(tenant, world),
            None => keys::any_world_frame(tenant),
        };
        let subscriber = self
            .session
            .declare_subscriber(&key)
            .with(RingChannel::new(RING_FRAMES))
            .await
            .map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
        Ok(FrameSubscription { subscriber })
    }
}

impl FrameSubscription {
    /// The next frame; `None` when the session is closed. A gap in the ticks tells what was missed.
    pub async fn next(&self) -> Option<PublishedFrame> {
        loop {
            let sample = self.subscriber.recv_async().await.ok()?;
            // Other keys match no more than the one expression, unless a stranger uses wildcards.
            let Some((tenant, world)) = keys::parse_world_frame(sample.key_expr().as_str()) else {
                continue;
            };
            let frame = EncodedFrame(sample.payload().to_bytes().into_owned());
            return Some(PublishedFrame { tenant, world, frame });
        }
    }
}
