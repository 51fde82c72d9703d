//! The way of pictures past the bus: jobs and large answers arrive whole, refusals as such, and who
//! finds the shortcut closed asks on the bus.

use std::sync::Arc;
use std::time::Instant;

use bus::{Bus, Incoming, Serving};
use schemas::{Error, ErrorCode, Image, ImageEncoding, ImageKind, Images, RenderJob, Reply, keys};

use crate::common::{Site, announce_renderer, deadline, job, renderer, renderers};

const PICTURE_BYTES: usize = 3_000_000;

/// Three million bytes that tell the way and the job they are of.
fn picture(way: u8, job: &RenderJob) -> Images {
    let mut data = vec![job.frame.seed as u8; PICTURE_BYTES];
    data[0] = way;
    let (kind, encoding) = (ImageKind::Rgb, ImageEncoding::Jpeg);
    let image = Image { camera: 0, width_px: 1, height_px: 1, kind, encoding, data };
    Images { tick: job.frame.tick, state_hash: 0, images: vec![image] }
}

fn answer(way: u8) -> impl Fn(Incoming) + Send + Sync + 'static {
    move |incoming| {
        assert_eq!(incoming.key(), keys::render_job(&renderer()));
        match incoming.render_job() {
            Ok(job) => incoming.reply(&Reply::Images(picture(way, &job))),
            Err(error) => incoming.refuse(error),
        }
    }
}

async fn serve_bus(bus: &Bus) -> Serving {
    bus.serve(&keys::render_job(&renderer()), answer(b'B')).await.unwrap()
}

async fn serve_shortcut(bus: &Bus, handler: impl Fn(Incoming) + Send + Sync + 'static) -> Serving {
    bus.serve_shortcut(&keys::render_job(&renderer()), handler).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_that_are_asked_at_once_get_their_own_large_answers_past_the_bus() {
    let site = Site::open().await;
    let _on_bus = serve_bus(&site.service).await;
    let _shortcut = serve_shortcut(&site.service, answer(b'S')).await;
    let _up = announce_renderer(&site.service).await;
    let renderers = renderers(&site.client);
    // More than an asker keeps connections for.
    let asking: Vec<_> = (1..=9)
        .map(|seed| {
            let renderers = Arc::clone(&renderers);
            tokio::spawn(async move {
                let job = job(seed);
                assert!(renderers.draw(&job).await.unwrap() == picture(b'S', &job));
            })
        })
        .collect();
    for asked in asking {
        asked.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_comes_by_the_shortcut_as_one() {
    let site = Site::open().await;
    let refuse = |incoming: Incoming| {
        incoming.refuse(Error::new(ErrorCode::InvalidArgument, "no such camera"));
    };
    let _shortcut = serve_shortcut(&site.service, refuse).await;
    let _up = announce_renderer(&site.service).await;
    let renderers = renderers(&site.client);
    let refusal = renderers.draw(&job(1)).await.unwrap_err();
    assert_eq!(refusal.code, ErrorCode::InvalidArgument, "{refusal}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_shortcut_that_closes_leaves_its_job_to_the_next_who_comes_and_later_ones_to_the_bus() {
    let site = Site::open().await;
    let _on_bus = serve_bus(&site.service).await;
    let (inbox, mut kept) = tokio::sync::mpsc::channel(1);
    let shortcut =
        serve_shortcut(&site.service, move |incoming| inbox.try_send(incoming).unwrap()).await;
    let up = announce_renderer(&site.service).await;
    let renderers = renderers(&site.client);
    let drawing = {
        let renderers = Arc::clone(&renderers);
        tokio::spawn(async move { renderers.draw(&job(1)).await })
    };
    let unanswered = kept.recv().await.unwrap();
    drop(shortcut);
    // It may have heard the job: only when it comes again it is asked again.
    drop(up);
    let _up = announce_renderer(&site.service).await;
    assert!(drawing.await.unwrap().unwrap() == picture(b'B', &job(1)));
    drop(unanswered);
    assert!(renderers.draw(&job(2)).await.unwrap() == picture(b'B', &job(2)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_is_told_that_whoever_asked_has_left() {
    let site = Site::open().await;
    let (inbox, mut kept) = tokio::sync::mpsc::channel(1);
    let _shortcut =
        serve_shortcut(&site.service, move |incoming| inbox.try_send(incoming).unwrap()).await;
    let _up = announce_renderer(&site.service).await;
    let renderers = renderers(&site.client);
    let drawing = tokio::spawn(async move { renderers.draw(&job(1)).await });
    let incoming = kept.recv().await.unwrap();
    assert!(!incoming.is_given_up());
    drawing.abort();
    let left = Instant::now();
    while !incoming.is_given_up() {
        assert!(left.elapsed() < deadline(), "the service is not told that nobody waits");
        tokio::task::yield_now().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_serves_no_shortcut_is_asked_on_the_bus() {
    let site = Site::open().await;
    let _on_bus = serve_bus(&site.service).await;
    let _up = announce_renderer(&site.service).await;
    let renderers = renderers(&site.client);
    assert!(renderers.draw(&job(3)).await.unwrap() == picture(b'B', &job(3)));
}
