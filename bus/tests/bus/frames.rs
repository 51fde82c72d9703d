//! Frames reach whoever subscribes, and wait for nobody.

use std::time::Instant;

use crate::common::{Site, deadline, tenant};
use schemas::{EncodedFrame, WorldId};

fn frame(tick: u32) -> EncodedFrame {
    EncodedFrame(tick.to_le_bytes().to_vec())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_reaches_the_subscriber_of_its_world_only() {
    let site = Site::open().await;
    let (world, other) = (WorldId::new(1).unwrap(), WorldId::new(2).unwrap());
    let frames = site.client.subscribe_frames(&tenant(), Some(world)).await.unwrap();
    crate::common::until("a frame arrives", || async {
        site.service.publish_frame(&tenant(), other, &frame(1));
        site.service.publish_frame(&tenant(), world, &frame(2));
        let short = std::time::Duration::from_millis(20);
        match tokio::time::timeout(short, frames.next()).await {
            Ok(Some(published)) => {
                assert_eq!((published.world, published.frame), (world, frame(2)));
                true
            }
            Ok(None) => panic!("the subscription ended"),
            Err(_) => false,
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_subscriber_that_does_not_read_holds_up_nobody_and_keeps_the_newest() {
    let site = Site::open().await;
    let world = WorldId::new(1).unwrap();
    let frames = site.client.subscribe_frames(&tenant(), None).await.unwrap();
    let begun = Instant::now();
    for tick in 0..2_000 {
        site.service.publish_frame(&tenant(), world, &frame(tick));
    }
    assert!(begun.elapsed() < deadline() / 2, "{:?}", begun.elapsed());
    // One more until it is seen: the ring holds the newest few, whatever came before.
    crate::common::until("the newest frame is read", || async {
        site.service.publish_frame(&tenant(), world, &frame(5_000));
        let short = std::time::Duration::from_millis(20);
        while let Ok(Some(published)) = tokio::time::timeout(short, frames.next()).await {
            if published.frame == frame(5_000) {
                return true;
            }
        }
        false
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_publisher_knows_whether_anybody_subscribes() {
    let site = Site::open().await;
    let listeners = site.service.frame_listeners().await.unwrap();
    assert!(!listeners.any());
    let frames = site.client.subscribe_frames(&tenant(), WorldId::new(1)).await.unwrap();
    crate::common::until("the subscription is known", || async { listeners.any() }).await;
    drop(frames);
    crate::common::until("its end is known", || async { !listeners.any() }).await;
}
